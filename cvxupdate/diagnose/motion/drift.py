"""Whether the structure changed while it was measured: stiffness that goes with time, not with the
level.

In the same form as the laws: what a model leaves is the answer to the force −ΔK(t) x along the
smoothed motion, so a change of stiffness that ramps within each run and steps from run to run is a
few columns more. A law at one place moves all runs of a level alike and follows the motion; drift
follows the clock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.motion.scene import Scene
from cvxupdate.diagnose.motion.smoother import Beyond
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.settings import HALVED
from cvxupdate.fe.synthesis.derivatives import modal_blocks

GROUPS = 8  # whose stiffness is looked at one by one


@dataclass(frozen=True)
class Drift:
    """What a change of stiffness with time explains of the projected residual (``fraction``, 0 to
    1), of which group (None: of all), and the relative change ``steps`` of each run by name, with
    ``ramps`` within it."""

    fraction: float
    group: str | None
    steps: Mapping[str, float]
    ramps: Mapping[str, float]

    @property
    def says(self) -> str:
        """In words."""
        where = "of the whole structure" if self.group is None else f"of group '{self.group}'"
        within = max((abs(r) for r in self.ramps.values()), default=0.0)
        between = np.ptp(list(self.steps.values())) if len(self.steps) > 1 else 0.0
        runs = ", ".join(f"{100 * s:+.2g} % in {name}" for name, s in self.steps.items())
        return (
            f"The stiffness {where} follows the clock, not the level: it changes by up to "
            f"{100 * within:.2g} % within a run and by {100 * between:.2g} % between runs "
            f"({runs}); that explains {100 * self.fraction:.3g} % of what a model that stays the "
            "same leaves."
        )


def drift_of(scene: Scene) -> Drift:
    """The best explanation by a stiffness that goes with time."""
    motions = {b.run.name: smoothed_modes(b, scene) for b in scene.beyond}
    best = Drift(0.0, None, {}, {})
    for group, K in _stiffness(scene).items():
        columns = _columns(scene, motions, K)
        freed = scene.left.freed(columns)
        found, *_ = np.linalg.lstsq(freed, scene.left.residual, rcond=1e-8)
        rest = scene.left.residual - freed @ found
        fraction = 1.0 - float(rest @ rest) / max(scene.left.total, 1e-300)
        n = len(motions)
        if fraction > best.fraction:
            names = list(motions)
            steps = dict(zip(names, found[:n].tolist(), strict=True))
            best = Drift(fraction, group, steps, dict(zip(names, found[n:].tolist(), strict=True)))
    return best


def clock_not_level(drift: Drift, best_law: float) -> bool:
    """Whether drift is the better explanation: it halves what the model leaves, and leaves less
    than half of what the best law does."""
    return drift.fraction > HALVED and 1.0 - drift.fraction < HALVED * (1.0 - best_law)


def smoothed_modes(b: Beyond, scene: Scene) -> Real:
    """Modal coordinates (samples, modes) by forces at every DOF that moves mass: the smoother of
    `Beyond.smoother` with as many latent forces as modes."""
    H = b.drive[:, :, None] * b.at[None] * b.inverse[:, None, :]
    power = np.sum(np.abs(H) ** 2, axis=2).sum(axis=1)
    said = np.sum(np.abs(b.residual) ** 2, axis=1)
    width = max(5, len(said) // 100)
    kernel = np.ones(width) / width
    noise = float(b.noise.sum())
    total = np.convolve(said, kernel, mode="same")
    variance = np.maximum(total - noise, 0.0) / np.maximum(
        np.convolve(power, kernel, mode="same"), 1e-300
    )
    heard = np.flatnonzero(total > 4.0 * noise)
    if len(heard) and heard[0] > 0:
        variance[: heard[0]] = np.median(variance[heard[0] : 3 * heard[0] + 1])
    G = H @ np.conj(np.swapaxes(H, 1, 2)) * variance[:, None, None] + np.diag(b.noise)
    known = np.linalg.solve(G, b.residual[:, :, None])
    force = variance[:, None] * (np.conj(np.swapaxes(H, 1, 2)) @ known)[:, :, 0]
    return b.run.samples_of(b.eta + b.inverse * force)


def _stiffness(scene: Scene) -> dict[str | None, Real]:
    """Modal stiffness of every group and of all (modes, modes)."""
    point = scene.point
    model = point.setting.model
    shapes = point.modes.shapes
    out: dict[str | None, Real] = {None: np.diag(np.maximum(point.modes.eigenvalues, 0.0))}
    own = [k for k, q in enumerate(model.parameters) if q.of == "stiffness" and q.group is not None]
    for k in own[:GROUPS] if len(own) > 1 else []:
        parts = (modal_blocks(shapes, b)[0] for b in model.derivative(k))
        out[model.parameters[k].group] = sum(
            (x for x in parts if x is not None), np.zeros((shapes.shape[1],) * 2)
        )
    return out


def _columns(scene: Scene, motions: Mapping[str, Real], K: Real) -> Real:
    """(rows, 2 runs): a step of the stiffness K in each run, then a ramp from −½ to ½ in each."""
    names = list(motions)
    forces: dict[str, Sequence[Real]] = {}
    for name, eta in motions.items():
        f = -eta @ K.T
        forces[name] = (f, f * (np.arange(len(f)) / len(f) - 0.5)[:, None])
    parts = []
    for s, reach in zip(scene.point.setting.signals, scene.reaches(np.eye(len(K))), strict=True):
        n, at = reach.shape[0] * reach.shape[1], names.index(s.name)
        run = scene.point.setting.runs[s.name]
        block = np.zeros((2 * n, 2 * len(names)))
        for kind, f in enumerate(forces[s.name]):
            spectra: Complex = run.decaying(f, s.s)
            flat = np.einsum("smr,sr->sm", reach, spectra).reshape(-1)
            block[:n, kind * len(names) + at], block[n:, kind * len(names) + at] = (
                flat.real,
                flat.imag,
            )
        parts.append(block)
    return np.vstack(parts)
