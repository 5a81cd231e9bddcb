"""Whether a concealed internal force can be seen at all, by the laboratory's own means.

Over all runs to be fitted, the force is split into what the best spring, dashpot and mass at its
place do and a rest that no linear model has. What the rest makes of the sensors, with spring,
dashpot and mass in the structure, is compared with noise and with 2 % of the responses together:
1 is just visible. Linear effects are judged as in the laboratory of rigs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from validation.motions.cases import Case
from validation.motions.march import Marched
from validation.rigs import visible as rigs

Real = NDArray[np.float64]
KNOWN = 0.02  # of the responses: what a sound model with its scatter leaves


def margin(
    case: Case, index: int, runs: Sequence[Marched], clean: Sequence[Real], noise: Real
) -> float:
    """How clearly an effect shows: 1 is just visible."""
    linear = len(case.truths) - len(case.laws)
    if index < linear:
        return rigs.margin(case.plain, index)
    k = index - linear
    fit = [i for i, r in enumerate(case.runs) if r.use == "fit"]
    b = case.laws[k][1] @ case.bench.basis
    columns = np.vstack(
        [np.column_stack([runs[i].x[:, k], runs[i].v[:, k], runs[i].second @ b]) for i in fit]
    )
    force = np.concatenate([runs[i].force[:, k] for i in fit])
    size = np.linalg.norm(columns, axis=0)
    best = np.linalg.lstsq(columns / size, force, rcond=None)[0] / size
    rest = np.split(force - columns @ best, len(fit))
    shown, unknown = 0.0, 0.0
    for part, i in zip(rest, fit, strict=True):
        heard = _response(case, b, best, part)
        scale = noise**2 + (KNOWN * np.std(clean[i], axis=0)) ** 2
        shown += float(np.sum(np.mean(heard**2, axis=0) / scale))
        unknown += heard.shape[1]
    return float(np.sqrt(shown / unknown))


def _response(case: Case, b: Real, best: Real, force: Real) -> Real:
    """At the sensors (samples, sensors), to a force at a place where spring, dashpot and mass have
    been added."""
    k, c, m = best
    bench = case.bench
    n = len(bench.omega)
    M = np.eye(n) + m * np.outer(b, b)
    if np.linalg.eigvalsh(M)[0] <= 0.05:
        M = np.eye(n)
    K = np.diag(bench.omega**2) + k * np.outer(b, b)
    C = bench.damping + c * np.outer(b, b)
    inverse = np.linalg.inv(M)
    size, rate = len(force), case.drive.fine
    s = 2j * np.pi * np.fft.rfftfreq(2 * size, 1.0 / rate)
    F = np.fft.rfft(force, 2 * size)
    Z = s[:, None, None] ** 2 * np.eye(n) + s[:, None, None] * (inverse @ C) + inverse @ K
    eta = np.linalg.solve(Z, (inverse @ b)[:, None] * F[:, None, None])[:, :, 0]
    order = ("displacement", "velocity", "acceleration").index(case.quantity)
    rows = np.array([case.modal.structure.at(*p) for p in case.plain.sensors]) @ bench.basis
    motion = np.fft.irfft(s[:, None] ** order * eta @ rows.T, 2 * size, axis=0)[:size]
    return case.drive.recorded(motion)
