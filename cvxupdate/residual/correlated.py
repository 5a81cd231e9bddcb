"""Rows whose errors are correlated, the full V_εε of a table (2.105, 2.106), combined to rows whose
errors are not.

To first order the errors of a table's rows are T ε, ε those of its frequencies and shape entries:
−2λ/f for an eigenvalue; −1 for an entry, and the measured ratio for the one by which the others are
divided (form "difference"), whose own error so counts in each. With T V_εε Tᵀ = L Lᵀ the rows
L⁻¹ r have independent errors of deviation 1 (row i is what is left of it once those before are
known), and their squares are those of generalised least squares. In the form "scale" the scale of
a shape is no measurement: L⁻¹ r without what any scale of any shape of the table could make of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cvxupdate.errors import RecordingError
from cvxupdate.fe.elements.base import Real
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.shape_forms import held_entry
from cvxupdate.residual.shape_gradients import Compared, ShapeRow
from cvxupdate.residual.shape_rows import Index

LEAST = 1e-10  # eigenvalue of the rows' correlations below which a combination is known exactly


@dataclass(frozen=True, eq=False)
class Joint:
    """The rows ``at`` (m,) of the fitted ``table`` and the Cholesky factor ``lower`` (m, m) of
    their covariance; ``free``, of each shape whose scale is free: its number among those
    compared, its rows among the m, its entries."""

    table: int
    at: Index
    lower: Real
    free: tuple[tuple[int, Index, Index], ...]

    def whitened(self, columns: Real) -> Real:
        """L⁻¹ columns."""
        return np.asarray(la.solve_triangular(self.lower, columns, lower=True))

    def scales(self, phis: Sequence[Real]) -> Real:
        """L⁻¹ Φ (m, scales), a column for every shape whose scale is free."""
        columns = np.zeros((len(self.at), len(self.free)))
        for column, (number, rows, entries) in enumerate(self.free):
            columns[rows, column] = phis[number][entries]
        return self.whitened(columns)

    def values(self, values: Real, phis: Sequence[Real]) -> Real:
        """The combined rows (m,) of all ``values``; ``phis`` are the model's compared shapes at
        their sensors."""
        r = self.whitened(values[self.at])
        if not self.free:
            return r
        F = self.scales(phis)
        return np.asarray(r - F @ (np.linalg.pinv(F) @ r))

    def derivative(
        self, A: Real, values: Real, phis: Sequence[Real], rates: Sequence[Real]
    ) -> Real:
        """Their derivative (m, parameters), for that of all ``values``, ``A``, and ``rates`` of
        ``phis``: with δ the scales that leave least, d(L⁻¹(r + Φδ))."""
        B = self.whitened(A[self.at])
        if not self.free:
            return B
        F, r = self.scales(phis), self.whitened(values[self.at])
        inverse = np.linalg.pinv(F)
        delta = -inverse @ r
        left = la.solve_triangular(self.lower, r + F @ delta, lower=True, trans="T")
        moved, turned = np.zeros((len(self.at), A.shape[1])), []
        for column, (number, rows, entries) in enumerate(self.free):
            rate = rates[number][entries]
            moved[rows] = delta[column] * rate
            turned.append(left[rows] @ rate)
        B = B + self.whitened(moved)
        return np.asarray(B - F @ (inverse @ B + inverse @ inverse.T @ np.array(turned)))


def joints(
    fit: Sequence[ModeTable],
    places: Sequence[Index],
    shapes: Sequence[ShapeRow],
    form: str,
    shape_weight: float,
    eigenvalues: bool,
) -> tuple[Joint, ...]:
    """The joint rows of every table with a covariance, among the rows of all tables' paired
    eigenvalues and then of the compared ``shapes``; without ``eigenvalues`` of the shapes alone.

    Raises
    ------
    RecordingError
        Where a covariance says that a combination of its rows is known exactly.
    """
    begin = np.cumsum([0, *(int(np.sum(p >= 0)) for p in places[: len(fit)])])
    out = []
    for k, table in enumerate(fit):
        if table.covariance is None:
            continue
        C, count = table.covariance, len(table.frequency)
        at: list[int] = []
        maps: list[Real] = []
        if eigenvalues:
            paired = np.flatnonzero(places[k] >= 0)
            at += list(range(begin[k], begin[k] + len(paired)))
            T = np.zeros((len(paired), len(C)))
            T[np.arange(len(paired)), paired] = -8.0 * np.pi**2 * table.frequency[paired]
            maps.append(T)
        free, row = [], int(begin[-1])
        for number, s in enumerate(shapes):
            entries, T = _errors(s, form, count, len(table.channels))
            if s.table == k and len(C) > count:
                if form == "scale":
                    free.append((number, len(at) + np.arange(len(entries)), entries))
                at += list(range(row, row + len(entries)))
                maps.append(T / shape_weight)
            row += len(entries)
        if at:
            where = f"{table.origin.source}: its covariance"
            L = _factor(C, np.vstack(maps), free, shapes, where)
            out.append(Joint(k, np.array(at), L, tuple(free)))
    return tuple(out)


def _errors(s: ShapeRow, form: str, count: int, width: int) -> tuple[Index, Real]:
    """The entries of the rows of shape ``s``, and what its channels' errors make of the rows."""
    first = count + s.mode * width
    if form == "mac":
        return np.zeros(1, dtype=np.int64), np.zeros((1, count * (1 + width)))
    entries = np.flatnonzero(s.std > 0.0)
    T = np.zeros((len(entries), count * (1 + width)))
    if form == "difference":
        held, entries = held_entry(s.measured, s.std)
        T = T[: len(entries)]
        T[:, first + s.channels[held]] = s.measured[entries] / s.measured[held]
    T[np.arange(len(entries)), first + s.channels[entries]] = -1.0
    return entries, T


def _factor(
    C: Real,
    T: Real,
    free: Sequence[tuple[int, Index, Index]],
    shapes: Sequence[ShapeRow],
    where: str,
) -> Real:
    """The Cholesky factor of T C Tᵀ."""
    used = np.any(T != 0.0, axis=0)[: len(C)]
    T = T[:, : len(C)][:, used]
    V = T @ C[np.ix_(used, used)] @ T.T
    if free and _least(V) < LEAST:  # shapes of a fixed length: along them nothing was measured
        for number, rows, entries in free:
            x = shapes[number].measured[entries]
            V[np.ix_(rows, rows)] += np.trace(V[np.ix_(rows, rows)]) / (x @ x) * np.outer(x, x)
    if _least(V) < LEAST:
        raise RecordingError(
            f"{where} says that a combination of the {len(V)} figures that are fitted is known "
            "exactly, as one from fewer repeats than figures does. Estimate it from more, or give "
            "deviations (frequency_std, shape_std)."
        )
    return np.asarray(la.cholesky(V, lower=True))


def _least(V: Real) -> float:
    """The least eigenvalue of the correlations of a covariance; 0 where a variance is."""
    std = np.sqrt(np.maximum(np.diag(V), 0.0))
    return float(np.linalg.eigvalsh(V / np.outer(std, std))[0]) if np.all(std > 0.0) else 0.0


def joined(
    joints: Sequence[Joint],
    form: Compared,
    shapes: Sequence[ShapeRow],
    seen: Sequence[Real],
    rows: Sequence[Real],
    values: Real,
) -> Real:
    """The derivative (rows, n) of all rows, those of ``joints`` combined; of none, ``rows`` as they
    are.

    ``rows`` are the derivatives of the eigenvalues and then, entry by entry, of the ``shapes`` that
    the model has as ``seen`` at their sensors; ``values`` are the rows before they are combined.
    """
    if not joints:
        return np.vstack(rows)
    first = len(rows) - len(shapes)
    rates = rows[first:]
    plain = [
        form.derivative(phi, s.measured, s.std) @ rate
        for s, phi, rate in zip(shapes, seen, rates, strict=True)
    ]
    A = np.vstack([*rows[:first], *plain])
    out = A.copy()
    for joint in joints:
        out[joint.at] = joint.derivative(A, values, seen, rates)
    return out
