"""The cone program of the commonest step, written down as cvxpy would: least squares, Tikhonov
terms, priors, one-sided or two-sided linear rows, a trust region.

A loop of many short fits spends more on compiling such steps than on solving them. It is cvxpy's
canonical form said shorter: the same variables, rows and cones in the same order, which
tests/convex/test_quadratic.py shows for every member of the registries (docs/convex-step.md).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from ..system import Array
from .constraints.clauses import LinearClause
from .losses import LeastSquares
from .matrix_form import ConeProgram, Cones
from .problem import StepProblem
from .regularisers.common import Regulariser, reference_and_scale
from .regularisers.prior import Prior
from .regularisers.tikhonov import Tikhonov


def written(problem: StepProblem) -> bool:
    """Whether `quadratic_program` can write the problem down: nothing but least squares, Tikhonov
    terms, priors and linear inequalities."""
    return (
        isinstance(problem.loss, LeastSquares)
        and all(isinstance(r, Tikhonov | Prior) for r in problem.regularisers)
        and all(
            isinstance(c, LinearClause) and not np.any(c.lower == c.upper) for c in problem.clauses
        )
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
    terms = [_term(r, n, begin) for r in problem.regularisers]
    rows = problem.rows
    C = rows.C.toarray()
    below, above = np.isfinite(rows.upper), np.isfinite(rows.lower)
    parts = [R, *(F for F, _ in terms), C[below], -C[above]]
    right = [
        d,
        *(g for _, g in terms),
        rows.upper[below],
        -rows.lower[above],
    ]
    if box is not None:
        centre, radius = box
        on = np.isfinite(radius)
        reach = np.where(on, radius, 0.0)
        middle = np.where(on, centre, 0.0)
        free = np.where(on, 0.0, 1.0)
        parts += [np.diag(on.astype(float)), -np.diag(on.astype(float))]
        right += [middle + reach + free, free - (middle - reach)]
    equal = len(d) + n * len(terms)
    whole = np.vstack(parts)
    tail = sp.csc_array(whole)
    A: Any = sp.csc_array(
        (
            np.concatenate([np.full(equal, -1.0), tail.data]),
            np.concatenate([np.arange(equal), tail.indices]),
            np.concatenate([np.arange(equal), equal + tail.indptr]),
        ),
        shape=(len(whole), equal + n),
    )
    diagonal = np.concatenate([np.full(len(d), 2.0), *(np.full(n, 2.0 * w) for w in weights)])
    kept = np.flatnonzero(diagonal)
    counts = np.concatenate(
        [np.cumsum(np.concatenate([[0], diagonal != 0.0])), np.full(n, len(kept))]
    )
    P: Any = sp.csc_array((diagonal[kept], kept, counts), shape=(equal + n, equal + n))
    return ConeProgram(
        P, np.zeros(equal + n), A, np.concatenate(right), Cones(equal, len(whole) - equal)
    ), equal


def _term(regulariser: Regulariser, n: int, present: Array) -> tuple[Array, Array]:
    """(F, g) of a penalty ‖F p − g‖²."""
    if isinstance(regulariser, Prior):
        F = regulariser.root
        return F, F @ present if regulariser.of_move else np.zeros(n)
    scaled: Any = regulariser  # a Tikhonov term: `written` has seen to it
    reference, scale = reference_and_scale(regulariser.name, scaled.reference, scaled.scale, n)
    return np.diag(1.0 / scale), reference / scale
