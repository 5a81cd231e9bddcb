"""What internal forces do when an unknown moves: differences between variants of one march, the
modes of each variant turned within the band."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg

from cvxupdate.diagnose.motion.march import Variants, marched
from cvxupdate.diagnose.responses.signals import Real
from cvxupdate.errors import ModelError
from cvxupdate.fe.internal import internal_forces, moving
from cvxupdate.fe.synthesis.derivatives import modal_blocks

RATES = 4  # steps in a sample where only derivatives are marched
HEARD = 0.6  # of a record, for them: an exponential window hardly hears the rest
STEP = 2e-3  # of p, for differences of internal forces
STEP_DAMPING = 0.05  # of log ζ
Turned = tuple[Real, Real, Real]


@dataclass(frozen=True)
class Moves:
    """The ``unknowns`` that move internal forces and their ``steps``; of every parameter of the
    model the modes ``turned`` by its step (None: it turns none) and the ``values`` of the laws
    (parameters, laws, 4); places ``owned`` of the modes whose damping moves."""

    unknowns: list[int]
    steps: Real
    turned: list[Turned | None]
    values: Real
    owned: list[int]

    def of(self, v: Variants) -> Variants:
        """The one variant ``v`` as many, each with one unknown moved."""
        many, count, lam = len(self.unknowns), len(self.turned), v.lam[0]
        lams, slow, drive, place = (
            np.repeat(a, many, axis=0) for a in (v.lam, v.slow, v.drive, v.place)
        )
        laws = np.repeat(v.values, many, axis=0)
        laws[:count] = self.values
        for j, turned in enumerate(self.turned):
            if turned is not None:
                new, V, more = turned
                ratio = slow[j] / np.sqrt(np.maximum(lam, 1e-30))
                lams[j], slow[j] = new, ratio * np.sqrt(new) + more
                drive[j], place[j] = V.T @ drive[j], V.T @ place[j]
        slow[count] *= np.exp(STEP_DAMPING)
        for i, mode in enumerate(self.owned):
            slow[count + 1 + i, mode] *= np.exp(STEP_DAMPING)
        return replace(v, lam=lams, slow=slow, drive=drive, place=place, values=laws)


def force_rates(point: Any) -> tuple[list[int], Mapping[str, Real]]:
    """Unknowns of a `MotionPoint` that move the internal forces, and by how much: of every run
    (fine samples, places, unknowns). ModelError where springs soften until nothing holds the model
    a small step away: there is no derivative where it only just holds."""
    moves = _moves(point)
    out = {}
    for name, part in point.heard.items():
        run = point.setting.runs[name]
        force = run.interpolated(RATES)[: int(RATES * HEARD * part * run.samples)]
        given = point.variants(run)
        as_it_is, _, _ = marched(given, force, RATES * run.rate)
        many, _, _ = marched(moves.of(given), force, RATES * run.rate)
        if not (np.isfinite(as_it_is).all() and np.isfinite(many).all()):
            raise ModelError("the motion grows beyond all bounds under the recorded forces.")
        rates = np.moveaxis(many - as_it_is, 0, -1) / moves.steps
        rest = np.zeros((RATES * run.samples - len(force), *rates.shape[1:]))
        out[name] = np.concatenate([rates, rest])
    return moves.unknowns, out


def stepped_figures(point: Any) -> Iterator[tuple[int, Real]]:
    """Of each parameter that moves the figures of a law its number, and what these are a `STEP`
    further, (places, 4)."""
    model = point.setting.model
    for j in moving(model):
        p = point.p[: len(model.parameters)].copy()
        p[j] += STEP
        yield j, np.asarray(internal_forces(model, p).laws.values, dtype=float)


def _moves(point: Any) -> Moves:
    setting, n = point.setting, point.carried
    model = setting.model
    count = len(model.parameters)
    lam = np.maximum(point.modes.eigenvalues[:n], 0.0)
    turned: list[Turned | None] = []
    for blocks in point.linear.derivatives:
        parts = [np.zeros((n, n)) for _ in range(3)]
        for b in blocks:
            for k, part in enumerate(modal_blocks(point.modes.shapes[:, :n], b)[:3]):
                parts[k] += 0.0 if part is None else part
        turned.append(_turned(lam, *parts) if any(np.any(x) for x in parts) else None)
    damped = [k for k in range(setting.damped) if point.owner[k] < n]
    laws = point.forces[0]
    values = np.tile(np.asarray(laws.values, dtype=float), (count, 1, 1))
    for j, figures in stepped_figures(point):
        values[j] = figures
    return Moves(
        [*range(count), count, *(count + 1 + k for k in damped)],
        np.array([STEP] * count + [STEP_DAMPING] * (1 + len(damped))),
        turned,
        values,
        [int(point.owner[k]) for k in damped],
    )


def _turned(lam: Real, K: Real, M: Real, C: Real) -> Turned:
    """Modes of the band when its matrices move by `STEP` times K and M: eigenvalues, the new modes
    in the old ones, and what C adds to each mode's damping."""
    values, V = scipy.linalg.eigh(
        np.diag(lam) + STEP * (K + K.T) / 2.0, np.eye(len(lam)) + STEP * (M + M.T) / 2.0
    )
    V = V * np.where(np.diag(V) < 0.0, -1.0, 1.0)
    return np.maximum(values, 0.0), V, STEP * np.einsum("ir,ij,jr->r", V, C, V)
