"""Whether a concealed effect can be seen at all, by the laboratory's own means.

The laboratory's model with everything but the effect (rig and other effects known) is fitted to
noise-free recordings of the whole truth: stiffness and mass of every group within their usual
scatter, damping of every mode. What the best fit leaves is compared with noise. Tables: the sum of
squares is the non-centrality of a chi-square test; the effect is visible when it is twice what a
test at 0.1 % needs to find it in 99 of 100 draws. FRFs: the r.m.s. over lines and channels is at
least as large as noise, 2 % of the response and 0.1 % of frequency together; or materials and
damping have been pulled from what is usual by twice what the same test needs (both are added).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from validation.rigs.bench import Structure
from validation.rigs.cases import MASS, STIFFNESS, Case, without
from validation.rigs.response import Modal, modal, paired

Real = NDArray[np.float64]
KEPT = 70  # modes that a fit sees the structure through
MODEL = 1e-3  # of a frequency: what no model knows better
SHAPE = 5e-3  # of a shape's largest entry
RESPONSE = 0.02  # of an FRF's magnitude
DAMPING, MEASURED = 0.3, 0.1  # logarithms: usual scatter of damping, its deviation in a table
LINES = 240
STEPS = 8
MARGIN = 2.0


def margin(case: Case, index: int) -> float:
    """How clearly an effect shows: 1 is just visible."""
    rest = without(case, index)
    structure = _reduced(rest.modal(), case)
    groups = list(structure.groups)
    prior = [STIFFNESS] * len(groups) + [MASS] * len(groups)
    if case.kind == "frf":
        truth, predict, modes = _responses(case, rest, structure)
        priors = np.array([*prior, *[DAMPING] * modes])
        left, x = fitted(truth, predict, priors)
        pull = float(np.sum((x / priors) ** 2))
        limit = MARGIN * detectable(len(priors))
        return float(np.sqrt((left - pull) / len(truth) + pull / limit))
    truth, predict, modes = _table(case, rest, structure)
    left, _ = fitted(truth, predict, np.array([*prior, *[DAMPING] * modes]))
    return left / (MARGIN * detectable(len(truth)))


@cache
def detectable(freedom: int) -> float:
    """Non-centrality that a chi-square test at 0.1 % finds in 99 of 100 draws."""
    limit = chi2.isf(1e-3, freedom)
    return float(brentq(lambda x: ncx2.sf(limit, freedom, x) - 0.99, 1e-3, 1e4))


def fitted(truth: Real, predict: Callable[[Real], Real], prior: Real) -> tuple[float, Real]:
    """(sum of squares that remains, priors included, parameters) after Levenberg–Marquardt steps on
    weighted data with Gaussian priors about 0."""
    x, damping = np.zeros(len(prior)), 1e-2
    now = predict(x)
    best = float(np.sum((truth - now) ** 2))
    for _ in range(STEPS):
        J = np.array([(predict(x + step) - now) / 1e-4 for step in 1e-4 * np.eye(len(x))]).T
        for _ in range(4):
            A = J.T @ J + np.diag(1.0 / prior**2 + damping * np.sum(J**2, axis=0))
            new = x + np.linalg.solve(A, J.T @ (truth - now) - x / prior**2)
            there = predict(new)
            cost = float(np.sum((truth - there) ** 2) + np.sum((new / prior) ** 2))
            if cost < best:
                break
            damping = max(4.0 * damping, 1e-3)
        else:
            return best, x
        done = cost > 0.999 * best
        x, now, best, damping = new, there, cost, damping / 5.0
        if done:
            break
    return best, x


def _reduced(m: Modal, case: Case) -> Structure:
    """The structure in its own lowest modes; nominal materials are those of the truth."""
    B = m.shapes[:, :KEPT]
    s = m.structure
    scatter = case.scatter

    def cut(A: Real, factor: float = 1.0) -> Real:
        return np.asarray(factor * B.T @ A @ B)

    return Structure(
        {g: (cut(k, scatter[g][0]), cut(mass, scatter[g][1])) for g, (k, mass) in s.groups.items()},
        (cut(s.other[0]), cut(s.other[1])),
        tuple((B.T @ b, c) for b, c in s.dampers),
        lambda node, dof: s.at(node, dof) @ B,
    )


def _moved(structure: Structure, x: Real, zeta: Real) -> Modal:
    groups = list(structure.groups)
    n = len(groups)
    scatter = {g: (np.exp(x[i]), np.exp(x[n + i])) for i, g in enumerate(groups)}
    m = modal(structure, scatter, np.array([0.0]))
    factor = np.ones(len(m.omega))
    factor[: len(x) - 2 * n] = np.exp(x[2 * n :])
    full = np.concatenate([zeta, np.full(max(0, len(m.omega) - len(zeta)), zeta[-1])])
    return replace(m, zeta=factor * full[: len(m.omega)])


def _responses(
    case: Case, rest: Case, structure: Structure
) -> tuple[Real, Callable[[Real], Real], int]:
    f = np.linspace(case.low, case.top, LINES)
    drive = case.drives[0]
    m = case.modal()
    exact, beside = (m.accelerance(x, case.sensors, drive) for x in (f, f * (1.0 + MODEL)))
    level = np.mean(np.abs(exact) ** 2, axis=0)  # each channel has its own noise
    unknown = RESPONSE * np.abs(exact) + np.abs(beside - exact)
    scale = np.sqrt(unknown**2 + case.noise**2 * level)
    zeta = rest.modal().zeta

    def real(H: NDArray[np.complex128]) -> Real:
        values = (H / scale).ravel()
        return np.asarray(np.sqrt(2.0) * np.concatenate([values.real, values.imag]))

    def predict(x: Real) -> Real:
        return real(_moved(structure, x, zeta).accelerance(f, case.sensors, drive))

    modes = int(np.sum(rest.modal().omega < 2.0 * np.pi * 1.2 * case.top))
    return real(exact), predict, modes


def _table(
    case: Case, rest: Case, structure: Structure
) -> tuple[Real, Callable[[Real], Real], int]:
    places = case.drawing.places()
    seen = np.array([places.index(s) for s in case.sensors])
    truth = case.modal()
    f, z, shapes = truth.damped(places, case.top)
    keep = f > case.low
    f, z, shapes = f[keep], z[keep], shapes[:, keep]
    losses = bool(truth.structure.dampers)
    sf, ss = np.hypot(case.spread, MODEL), np.hypot(case.noise, SHAPE)
    zeta = rest.modal().zeta
    peak = np.max(np.abs(shapes[seen]), axis=0)
    target = shapes[seen] / peak

    rows = len(f) * (1 + len(seen) + losses)

    def data(f: Real, z: Real, s: Real) -> Real:
        out = [np.log(f) / sf, (s / ss).ravel()]
        return np.concatenate([*out, np.log(z) / MEASURED] if losses else out)

    def predict(x: Real) -> Real:
        g, y, others = _moved(structure, x, zeta).damped(places, 2.0 * case.top)
        pair = paired(f, shapes, g, others)
        if len(pair) < len(f):  # far off some mode has left the band: no step goes there
            return np.full(rows, np.inf)
        mine = others[seen][:, pair]
        scale = np.sum(mine * target, axis=0) / np.maximum(np.sum(mine**2, axis=0), 1e-300)
        return data(g[pair], y[pair], mine * scale)

    modes = int(np.sum(rest.modal().omega < 2.0 * np.pi * 1.2 * case.top)) if losses else 0
    return data(f, z, target), predict, modes
