"""Take out the variables that an equality merely defines, such as residuals y = R p − d.

The dense solvers and those that need a positive definite Hessian get min ½ pᵀRᵀR p this way;
`restore` brings primal and dual back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..system import Array
from .matrix_form import ConeProgram, Cones


@dataclass(frozen=True, eq=False)
class Elimination:
    """x = T u + t, u and ``rows`` stay; each ``defined`` variable had its ``defining`` row and
    ``pivot`` there."""

    full: ConeProgram
    small: ConeProgram
    T: Any
    t: Array
    rows: Any
    defined: Any
    defining: Any
    pivot: Array

    def restore(self, u: Array, z_small: Array) -> tuple[Array, Array]:
        """x and z of the full program from those of the small one; the defining rows' z follow from
        stationarity."""
        x = self.T @ u + self.t
        z = np.zeros(self.full.b.size)
        z[self.rows] = z_small
        gradient = self.full.P @ x + self.full.q
        z[self.defining] = -gradient[self.defined] / self.pivot
        return np.asarray(x), z


def eliminate(program: ConeProgram) -> Elimination:
    """Eliminate every variable with a single entry in A, in an equality row, one variable to a
    row."""
    A, zero = sp.csc_array(program.A), program.cones.zero
    counts = np.diff(A.indptr)
    single = np.flatnonzero(counts == 1)
    entry = A.indptr[single]
    row, value = A.indices[entry], A.data[entry]
    has_cost = np.asarray(program.P.diagonal())[single] > 0
    usable = (row < zero) & has_cost
    _, first = np.unique(row[usable], return_index=True)
    defined, defining, pivot = single[usable][first], row[usable][first], value[usable][first]

    n, m = program.q.size, program.b.size
    kept = np.setdiff1d(np.arange(n), defined)
    rows = np.setdiff1d(np.arange(m), defining)
    by_row = sp.csr_array(A)
    defines = (
        sp.csr_array(by_row[defining])[:, kept] if defined.size else sp.csr_array((0, kept.size))
    )
    # Stacked as [kept; defined], then put back in order.
    order = np.argsort(np.concatenate([kept, defined]))
    T = sp.csc_array(
        sp.vstack([sp.eye_array(kept.size), -sp.diags_array(1 / pivot) @ defines]).tocsr()[order]
    )
    t = np.concatenate([np.zeros(kept.size), program.b[defining] / pivot])[order]
    Pt = program.P @ t
    rest = by_row[rows]
    cones = Cones(
        zero - defining.size,
        program.cones.nonneg,
        program.cones.soc,
        program.cones.psd,
        program.cones.exp,
    )
    small = ConeProgram(
        sp.csc_array(_congruence(T, program.P)),
        np.asarray(T.T @ (Pt + program.q)),
        sp.csc_array(rest @ T),
        np.asarray(program.b[rows] - rest @ t),
        cones,
        float(program.constant + 0.5 * t @ Pt + program.q @ t),
    )
    return Elimination(program, small, T, t, rows, defined, defining, np.asarray(pivot))


def filled_by_squares(program: ConeProgram) -> float:
    """Entries of half the Hessian once the defined variables are gone, at least: the square of the
    longest defining row fills that of its variables. Known before anything is formed, since for
    9000 parameters what is formed takes 650 MB."""
    A = sp.csc_array(program.A)
    single = np.flatnonzero(np.diff(A.indptr) == 1)
    rows = A.indices[A.indptr[single]]
    lengths = np.bincount(A.indices, minlength=program.b.size)[rows[rows < program.cones.zero]]
    longest = float(lengths.max(initial=1)) - 1.0
    return 0.5 * longest**2


def _congruence(T: Any, P: Any) -> Any:
    """Tᵀ P T; by dense products when T is mostly full, as with a full data matrix."""
    if T.nnz < 0.1 * T.shape[0] * T.shape[1]:
        return T.T @ P @ T
    full = T.toarray()
    return full.T @ (P @ full)
