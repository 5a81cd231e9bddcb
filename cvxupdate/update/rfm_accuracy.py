"""How accurate the recordings of an update by frequency responses must be (thesis chapter 5), as a
result: said before, and beside, the update."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_accuracy import accuracy
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.residual.frf_points import Points, best_lines
from cvxupdate.system import Array
from cvxupdate.update.result import AccuracyResult

CHANGE = 0.05
"""The deviation of every parameter that is sought, where nothing is known of it."""
LINES = 240
"""Lines at most."""
WORK = 2e7
"""Lines × parameters × sensors² at most: fewer lines where there are many of the others."""
LARGE = 20_000
"""Free DOFs above which only the fitted lines are looked at: each costs a factorisation."""
FILLED = 5e10
"""Lines × DOFs³ at most of a model whose modal damping fills C, where a line takes the factors of a
full matrix: 40 lines of 1100 DOFs, which take six seconds."""
ROUNDS = 4
SENSORS = 80
"""Sensors up to which the spectral radius is computed."""


def accuracy_results(
    model: Model, fit: Sequence[FrfData], points: Sequence[Points]
) -> tuple[AccuracyResult, ...]:
    """One for each fitted recording; none for one whose lines meet a frequency of the structure
    held at its sensors."""
    out = []
    for data, chosen in zip(fit, points, strict=True):
        try:
            out.append(_result(model, data, chosen))
        except ModelError:
            continue
    return tuple(out)


def relative_noise(data: FrfData) -> float:
    """The median over the used entries of deviation / size."""
    return float(
        np.median(
            data.std[:, data.used] / np.maximum(np.abs(data.X[:, data.used]), np.finfo(float).tiny)
        )
    )


def _result(model: Model, data: FrfData, points: Points) -> AccuracyResult:
    lines = _lines(model, data, points.lines)
    some, noise = data.at(lines), relative_noise(data)
    a = accuracy(
        model,
        some.frequency,
        data.responses,
        noise,
        CHANGE,
        ROUNDS if len(data.responses) <= SENSORS else 0,
    )
    spread = _spread(model, data.at(points.lines))
    best = best_lines(some, points, a.log_function, len(points.lines))
    return AccuracyResult(
        recording=data.name,
        noise=noise,
        stated=not data.relative_only,
        change=CHANGE,
        frequency=_row(a.frequency),
        error=_row(a.error),
        system=_row(a.system),
        bearable=_row(a.bearable),
        radius=tuple(r if np.isfinite(r) else None for r in a.radius.tolist()),
        relative_model=_row(a.relative_model),
        fitted=_row(data.frequency[points.lines]),
        best=_row(some.frequency[best]),
        spread=spread,
        borne=None if spread is None else noise * CHANGE / spread,
    )


def _lines(model: Model, data: FrfData, fitted: Index) -> Index:
    """The fitted lines and others evenly over the recording, thinned to what may be afforded."""
    most = int(np.clip(WORK / (len(model.parameters) * len(data.responses) ** 2), 2, LINES))
    if any(model.modal_damping):
        most = max(2, min(most, int(FILLED / model.size**3)))
    every = np.arange(len(data.frequency)) if model.size <= LARGE else fitted
    kept = fitted[_evenly(len(fitted), most)]
    return np.union1d(kept, every[_evenly(len(every), max(0, most - len(kept)))])


def _evenly(count: int, most: int) -> Index:
    return np.unique(np.round(np.linspace(0, count - 1, min(count, most))).astype(np.int64))


def _row(values: Array) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


def _spread(model: Model, data: FrfData) -> float | None:
    """Median deviation of p that the output error at these lines leaves, linearised at the model as
    it stands; None where that is unbounded."""
    J, _ = FrfResidual(model, (data,), "receptance").evaluate(model.zero()).system().weighted()
    R = (
        np.linalg.qr(J, mode="r") if J.shape[0] > J.shape[1] else J
    )  # thousands of rows: their U would fill the memory
    _, s, Vt = np.linalg.svd(R, full_matrices=True)
    known = s > 1e-10 * s.max(initial=0.0)
    variance = np.sum((Vt[: len(s)][known] / s[known, None]) ** 2, axis=0)
    open_ = np.sum(np.vstack([Vt[: len(s)][~known], Vt[len(s) :]]) ** 2, axis=0) > 1e-12
    middle = float(np.median(np.where(open_, np.inf, np.sqrt(variance))))
    return middle if np.isfinite(middle) and middle > 0.0 else None


def says(result: AccuracyResult) -> str:
    """The bearable noise at the fitted lines in one sentence."""
    at = np.isin(result.frequency, result.fitted)
    borne = np.asarray(result.bearable)[at]
    return (
        f"{result.recording}: by the characteristic log function (5.32), with "
        f"{100 * result.change:g} % on every parameter, the chosen lines bear "
        f"{100 * borne.min():.2g} to {100 * borne.max():.2g} % noise (r.m.s.); the recording "
        f"has {100 * result.noise:.2g} %. It is a sufficient condition on norms, far stricter "
        "than what weighted steps need."
    )
