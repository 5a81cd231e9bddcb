"""The cone program of the commonest steps, written down as cvxpy would: least squares, Tikhonov
terms, priors, linear rows, small semidefinite blocks, a trust region.

A loop of many short fits spends more on compiling such steps than on solving them, and the step of
a thousand families of element matrices (docs/generic-elements.md) is not compiled in a quarter of
an hour. It is cvxpy's canonical form said shorter: the same variables, rows and cones in the same
order, which tests/convex/test_quadratic.py shows for every member of the registries
(docs/convex-step.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..system import Array
from .constraints.clauses import ConicClause, LinearClause
from .losses import LeastSquares
from .matrix_form import ConeProgram, Cones
from .problem import StepProblem
from .regularisers.common import Regulariser, reference_and_scale
from .regularisers.prior import Prior
from .regularisers.tikhonov import Tikhonov

# entries of a sparse matrix: values, rows, columns
Entries = tuple[Array, Any, Any]


def written(problem: StepProblem) -> bool:
    """Whether `quadratic_program` can write the problem down: nothing but least squares, Tikhonov
    terms, priors, linear rows and semidefinite blocks."""
    return (
        isinstance(problem.loss, LeastSquares)
        and all(isinstance(r, Tikhonov | Prior) for r in problem.regularisers)
        and all(isinstance(c, LinearClause) or c.matrix is not None for c in problem.clauses)
    )


def quadratic_program(
    problem: StepProblem,
    R: Array,
    d: Array,
    weights: tuple[float, ...],
    box: tuple[Array, Array] | None,
    present: Array | None = None,
) -> tuple[ConeProgram, int]:
    """The program over x = (residuals, quadratic terms, p), and where p begins in x.

    Parameters
    ----------
    R, d : reduced data (rows, n), (rows,); weights : of the quadratic terms.
    box : centre and radius (n,) of the trust region, inf where free; None for none.
    present : (n,), where the step begins; None for 0.
    """
    n = len(problem.columns)
    begin = np.zeros(n) if present is None else present
    parts = [(_dense(R), d)]
    parts += [_term(r, n, begin) for r in problem.regularisers]
    rows = problem.rows
    equal = rows.equal
    below, above = np.isfinite(rows.upper) & ~equal, np.isfinite(rows.lower) & ~equal
    linear = _entries(rows.C)
    defining = len(d) + n * len(problem.regularisers)
    zero = defining + int(equal.sum())
    if zero > defining:
        parts.append((_chosen(linear, equal, 1.0), rows.upper[equal]))
    parts += [
        (_chosen(linear, below, 1.0), rows.upper[below]),
        (_chosen(linear, above, -1.0), -rows.lower[above]),
    ]
    if box is not None:
        parts += region(*box)
    blocks = [c.matrix for c in problem.clauses if isinstance(c, ConicClause) and c.matrix]
    inequalities = sum(len(b) for _, b in parts) - zero
    for block in blocks:
        value, i, j = _entries(block.F)
        parts.append(((-value, i, np.asarray(block.on, dtype=int)[j]), block.f))
    orders = tuple(block.order for block in blocks)
    right = np.concatenate([b for _, b in parts])
    A = _stacked((entries, len(b)) for entries, b in parts)
    own = (np.full(defining, -1.0), np.arange(defining), np.arange(defining))
    whole = [
        np.concatenate([a, b]) for a, b in zip(own, (A[0], A[1], A[2] + defining), strict=True)
    ]
    diagonal = np.concatenate([np.full(len(d), 2.0), *(np.full(n, 2.0 * w) for w in weights)])
    kept = np.flatnonzero(diagonal)
    size = defining + n
    counts = np.concatenate(
        [np.cumsum(np.concatenate([[0], diagonal != 0.0])), np.full(n, len(kept))]
    )
    return ConeProgram(
        sp.csc_array((diagonal[kept], kept, counts), shape=(size, size)),
        np.zeros(size),
        _by_columns(whole, (len(right), size)),
        right,
        Cones(zero, inequalities, psd=orders),
    ), defining


def _dense(M: Array) -> Entries:
    rows, columns = np.nonzero(M)
    return M[rows, columns], rows, columns


def _entries(M: Any) -> Entries:
    """Of a CSR array."""
    return M.data, np.repeat(np.arange(M.shape[0]), np.diff(M.indptr)), M.indices


def _chosen(entries: Entries, keep: Any, sign: float) -> Entries:
    """The rows where ``keep`` is, numbered anew, times ``sign``."""
    value, rows, columns = entries
    number = np.cumsum(keep) - 1
    on = keep[rows]
    return sign * value[on], number[rows[on]], columns[on]


def _diagonal(v: Array) -> Entries:
    on = np.flatnonzero(v)
    return v[on], on, on


def _stacked(parts: Iterable[tuple[Entries, int]]) -> Entries:
    """Blocks of rows below one another, each with its number of rows."""
    at, values, rows, columns = 0, [], [], []
    for (value, i, j), count in parts:
        values.append(value)
        rows.append(i + at)
        columns.append(j)
        at += count
    return np.concatenate(values), np.concatenate(rows), np.concatenate(columns)


def _by_columns(entries: Sequence[Any], shape: tuple[int, int]) -> sp.csc_array:
    """No two entries in one place, and those of a column by rising rows: what SciPy would have to
    find out."""
    values, rows, columns = entries
    order = np.argsort(columns, kind="stable")
    ends = np.append(0, np.cumsum(np.bincount(columns, minlength=shape[1])))
    return sp.csc_array((values[order], rows[order], ends), shape=shape)


def region(centre: Array, radius: Array) -> list[tuple[Entries, Array]]:
    """|p − centre| ≤ radius, upper sides first; where it is infinite, 0 ≤ 1."""
    on = np.isfinite(radius)
    reach, middle = np.where(on, radius, 0.0), np.where(on, centre, 0.0)
    free = np.where(on, 0.0, 1.0)
    return [
        (_diagonal(on.astype(float)), middle + reach + free),
        (_diagonal(-on.astype(float)), free - (middle - reach)),
    ]


def _term(regulariser: Regulariser, n: int, present: Array) -> tuple[Entries, Array]:
    """(F, g) of a penalty ‖F p − g‖²."""
    if isinstance(regulariser, Prior):
        centre = present if regulariser.of_move else np.zeros(n)
        if regulariser.deviations is not None:
            return _diagonal(1.0 / regulariser.deviations), centre / regulariser.deviations
        return _dense(regulariser.root), regulariser.root @ centre
    scaled: Any = regulariser  # a Tikhonov term: `written` has seen to it
    reference, scale = reference_and_scale(regulariser.name, scaled.reference, scaled.scale, n)
    return _diagonal(1.0 / scale), reference / scale
