"""The cone program of a group lasso within linear inequalities, written down as cvxpy would.

Every diagnosis asks thirty times and more which of its candidates stay chosen, and cvxpy puts the
numbers of each into its form four times as long as it takes to be solved.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..system import Array
from .constraints.clauses import LinearClause
from .losses import LeastSquares
from .matrix_form import ConeProgram, Cones
from .problem import StepProblem
from .quadratic import quadratic_program, region, written
from .regularisers.common import reference_and_scale
from .regularisers.group_l1 import GroupL1

MOST = 400  # parameters up to which matrices may be put together with their zeros
Box = tuple[Array, Array]
Form = Callable[
    [StepProblem, Array, Array, tuple[float, ...], Box | None, Array | None],
    tuple[ConeProgram, int],
]


def form_of(problem: StepProblem) -> Form | None:
    """What writes the program of a problem down; None where cvxpy has to compile it."""
    if written(problem):
        return quadratic_program
    return group_program if grouped(problem) else None


def grouped(problem: StepProblem) -> bool:
    """Whether `group_program` can write the problem down: least squares, one group lasso, linear
    inequalities, few parameters."""
    return (
        len(problem.columns) <= MOST
        and isinstance(problem.loss, LeastSquares)
        and len(problem.regularisers) == 1
        and isinstance(problem.regularisers[0], GroupL1)
        and all(isinstance(c, LinearClause) for c in problem.clauses)
        and not np.any(problem.rows.equal)
    )


def group_program(
    problem: StepProblem,
    R: Array,
    d: Array,
    weights: tuple[float, ...],
    box: Box | None,
    present: Array | None = None,
) -> tuple[ConeProgram, int]:
    """The program over x = (residuals, a size of each group, p), and where p begins in x; its
    arguments are those of `quadratic_program`.

    A group of one is no cone but two inequalities, |p| ≤ its size.
    """
    n, rows = len(problem.columns), len(d)
    term: Any = problem.regularisers[0]  # a group lasso: `grouped` has seen to it
    reference, scale = reference_and_scale(term.name, term.reference, term.scale, n)
    groups = [list(g) for g in term.places(problem.columns)]
    begin = rows + len(groups)
    scaled, moved = np.diag(1.0 / scale), reference / scale
    alone, cones = [], []
    for k, g in enumerate(groups):
        size = np.eye(1, len(groups), k)
        if len(g) == 1:
            alone += [_rows(scaled[g], moved[g], -size), _rows(-scaled[g], -moved[g], -size)]
        else:
            cones += [_rows(np.zeros((1, n)), np.zeros(1), -size), _rows(-scaled[g], -moved[g])]
    limits = problem.rows
    below, above = np.isfinite(limits.upper), np.isfinite(limits.lower)
    C = limits.C.toarray()
    sides = [(C[below], limits.upper[below]), (-C[above], -limits.lower[above])]
    for (value, i, j), right in [] if box is None else region(*box):
        sides.append((sp.csr_array((value, (i, j)), shape=(n, n)).toarray(), right))
    blocks = [_rows(R, d), *alone, *(_rows(*side) for side in sides), *cones]
    A = np.zeros((sum(len(right) for *_, right in blocks), begin + n))
    A[:rows, :rows] = -np.eye(rows)
    A[:, begin:] = np.vstack([on_p for on_p, _, _ in blocks])
    at = 0
    for on_p, on_sizes, _ in blocks:
        if on_sizes is not None:
            A[at : at + len(on_p), rows:begin] = on_sizes
        at += len(on_p)
    soc = tuple(len(g) + 1 for g in groups if len(g) > 1)
    price = weights[0] * np.sqrt([len(g) for g in groups])
    ends = np.minimum(np.arange(begin + n + 1), rows)
    return ConeProgram(
        sp.csc_array((np.full(rows, 2.0), np.arange(rows), ends), shape=(begin + n, begin + n)),
        np.concatenate([np.zeros(rows), price, np.zeros(n)]),
        sp.csc_array(A),
        np.concatenate([right for *_, right in blocks]),
        Cones(rows, len(A) - rows - sum(soc), soc),
    ), begin


def _rows(
    on_p: Array, right: Array, on_sizes: Array | None = None
) -> tuple[Array, Array | None, Array]:
    """Of some rows the coefficients of p, those of the groups' sizes (None: zero), right sides."""
    return on_p, on_sizes, right
