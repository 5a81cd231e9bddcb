"""A linear matrix inequality: a matrix that is affine in the parameters stays positive
(semi)definite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

from ...errors import InputError
from ...system import Array
from ..chordal import cliques
from ..context import Key
from ..smallest import smallest_eigenvalue
from .clauses import Clause, ConicClause, Semidefinite

# rows from which the inequality is split along its sparsity; below, the whole one is faster
# (tests/benchmarks/test_ceam.py)
DECOMPOSED = 250
# parameters from which it is split from `FEW` rows on: whole matrices (108 rows, 362 parameters: 15
# s instead of minutes)
MANY = 100
FEW = 50


@dataclass(frozen=True, eq=False)
class MatrixInequality:
    """D^-½ (base + Σ p_j derivative_j) D^-½ ⪰ floor · I, D the diagonal of ``base``.

    Parameters
    ----------
    base : (N, N) symmetric, sparse, at p = 0; derivatives : n of them, zero ones may be empty.
    floor : a pure number; 1e-3 keeps every motion at least a thousandth of its own mass (or
    stiffness), 0 asks for semidefinite.
    label : the clause in words; basis : (N, k) columns to which the inequality is confined
    (rigid-body modes taken out), None for all.
    decompose : split along the sparsity; None: when N is 250 or more, or 50 with 100 parameters,
    and ``basis`` is None.
    """

    base: Any
    derivatives: Sequence[Any]
    label: str
    floor: float = 0.0
    basis: Array | None = None
    decompose: bool | None = None
    keys: ClassVar[Mapping[str, Key]] = {}

    @cached_property
    def scaled(self) -> tuple[Any, tuple[Any, ...]]:
        """(base, derivatives) scaled to a unit diagonal, confined to the DOFs that carry anything,
        as CSC."""
        base = sp.csc_array(self.base)
        parts = tuple(sp.csc_array(d) for d in self.derivatives)
        diagonal = np.abs(base.diagonal())
        for d in parts:
            diagonal = np.where(diagonal > 0, diagonal, np.abs(d.diagonal()))
        live = np.flatnonzero(diagonal > 0)
        scale = sp.diags_array(1.0 / np.sqrt(diagonal[live]))

        def cut(A: Any) -> Any:
            return sp.csc_array(scale @ A[live][:, live] @ scale)

        if self.basis is None:
            return cut(base), tuple(cut(d) for d in parts)
        # A congruence by B changes no sign; the basis is orthonormalised in the scaled coordinates.
        Q = np.linalg.qr(np.sqrt(diagonal[live])[:, None] * np.asarray(self.basis)[live])[0]
        return (
            sp.csc_array(Q.T @ (cut(base) @ Q)),
            tuple(sp.csc_array(Q.T @ (cut(d) @ Q)) for d in parts),
        )

    def margin(self, p: Array) -> float:
        """Smallest eigenvalue of the scaled matrix at p, less ``floor``: from the matrix, whatever
        a solver says."""
        base, parts = self.scaled
        S = base + sum(
            (float(v) * d for v, d in zip(p, parts, strict=True) if v != 0.0),
            sp.csc_array(base.shape),
        )
        return smallest_eigenvalue(S) - self.floor

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One semidefinite clause; none when no parameter moves the matrix and it holds already."""
        if len(self.derivatives) != len(columns):
            raise InputError(
                f"{self.label}: {len(self.derivatives)} derivatives were given for "
                f"{len(columns)} parameters."
            )
        base, parts = self.scaled
        if base.shape[0] == 0 or (
            not any(d.nnz for d in parts) and self.margin(np.zeros(len(columns))) >= 0.0
        ):
            return ()
        large = base.shape[0] >= (FEW if len(parts) >= MANY else DECOMPOSED)
        split = self.decompose if self.decompose is not None else self.basis is None and large
        build = _split(base, parts, self.floor) if split else _whole(base, parts, self.floor)
        matrix = None if split else _upper(base, parts, self.floor)
        return (ConicClause(self.label, build, self.margin, matrix=matrix),)


def _flat(base: Any, parts: tuple[Any, ...]) -> tuple[Array, Array, Any, Array]:
    """(rows, columns, F (entries, n), f (entries,)) of the lower triangle's pattern: S_ij = F p +
    f."""
    N = base.shape[0]
    pattern = sp.tril(sum((abs(d) for d in parts), abs(base)) + sp.eye_array(N)).tocoo()
    rows, cols = pattern.coords
    order = np.lexsort((rows, cols))
    rows, cols = rows[order], cols[order]
    keys = cols.astype(np.int64) * N + rows

    def entries(A: Any) -> tuple[Array, Array]:
        low = sp.tril(A).tocoo()
        return np.searchsorted(keys, low.coords[1].astype(np.int64) * N + low.coords[0]), low.data

    at, values, column = [], [], []
    for j, d in enumerate(parts):
        place, data = entries(d)
        at.append(place)
        values.append(data)
        column.append(np.full(len(place), j))
    F = sp.csr_array(
        (
            np.concatenate([*values, np.zeros(0)]),
            (
                np.concatenate([*at, np.zeros(0, dtype=int)]).astype(int),
                np.concatenate([*column, np.zeros(0, dtype=int)]).astype(int),
            ),
        ),
        shape=(len(rows), len(parts)),
    )
    f = np.zeros(len(rows))
    place, data = entries(base)
    f[place] = data
    return rows, cols, F, f


def _whole(base: Any, parts: tuple[Any, ...], floor: float) -> Any:
    rows, cols, F, f = _flat(base, parts)
    N = base.shape[0]
    diagonal = (rows == cols).astype(float)
    # Both triangles: entry e goes to (i, j) and (j, i), column-major.
    off = rows != cols
    places = np.concatenate([cols * N + rows, rows[off] * N + cols[off]])
    entry = np.concatenate([np.arange(len(rows)), np.flatnonzero(off)])
    spread = sp.csr_array((np.ones(len(places)), (places, entry)), shape=(N * N, len(rows)))

    def constraints(p: Any, slack: Any) -> Sequence[Any]:
        import cvxpy as cp

        value = spread @ (F @ p + f - floor * diagonal) + (spread @ diagonal) * slack
        return [cp.reshape(value, (N, N), order="F") >> 0]

    return constraints


def _upper(base: Any, parts: tuple[Any, ...], floor: float) -> Semidefinite:
    """The same as rows: entry (i, j) below the diagonal is (j, i) of the upper triangle."""
    rows, cols, F, f = _flat(base, parts)
    N = base.shape[0]
    size = np.where(rows == cols, 1.0, np.sqrt(2.0))
    place = (rows * (rows + 1) // 2 + cols, np.arange(len(rows)))
    spread = sp.csr_array((size, place), shape=(N * (N + 1) // 2, len(rows)))
    value = spread @ (f - floor * (rows == cols))
    return Semidefinite(tuple(range(len(parts))), sp.csr_array(spread @ F), value, N)


def _split(base: Any, parts: tuple[Any, ...], floor: float) -> Any:
    rows, cols, F, f = _flat(base, parts)
    N = base.shape[0]
    blocks = cliques(sp.coo_array((np.ones(len(rows)), (rows, cols)), shape=(N, N)))
    diagonal = (rows == cols).astype(float)

    def constraints(p: Any, slack: Any) -> Sequence[Any]:
        import cvxpy as cp

        own = cols.astype(np.int64) * N + rows
        filled = np.unique(
            np.concatenate([np.repeat(b, len(b)) * N + np.tile(b, len(b)) for b in blocks])
        )
        filled = filled[filled % N >= filled // N]
        place = sp.csr_array(
            (np.ones(len(own)), (np.searchsorted(filled, own), np.arange(len(own)))),
            shape=(len(filled), len(own)),
        )
        total: Any = 0.0
        made = []
        for b in blocks:
            if len(b) == 1:
                X = cp.Variable((1, 1), nonneg=True)
            else:
                X = cp.Variable((len(b), len(b)), PSD=True)
            i, j = np.meshgrid(np.arange(len(b)), np.arange(len(b)), indexing="ij")
            low = i >= j
            local = j[low] * len(b) + i[low]
            keys = b[j[low]] * N + b[i[low]]
            gather = sp.csr_array(
                (np.ones(len(keys)), (np.searchsorted(filled, keys), local)),
                shape=(len(filled), len(b) ** 2),
            )
            total = total + gather @ cp.vec(X, order="F")
        made.append(total == place @ (F @ p + f - floor * diagonal) + (place @ diagonal) * slack)
        return made

    return constraints
