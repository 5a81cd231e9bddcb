"""The program that is written down is the one that cvxpy compiles, entry by entry."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.convex import Bounds, StepProblem, Tikhonov
from cvxupdate.convex.losses import AbsoluteLoss
from cvxupdate.convex.matrix_form import cone_program
from cvxupdate.convex.problem import compile_step
from cvxupdate.convex.quadratic import quadratic_program, written

COLUMNS = ("a", "b", "c", "d")
BOUNDS = Bounds(np.array([-1.0, -2.0, -np.inf, -3.0]), np.array([4.0, 5.0, 6.0, np.inf]))
PRIOR = Tikhonov(1.0, np.array([0.0, 0.1, 0.2, 0.0]), np.array([0.1, 0.2, 0.3, 1e4]))
ROUGH = Tikhonov(0.3)


@pytest.mark.parametrize("boxed", [False, True])
@pytest.mark.parametrize(
    ("terms", "weights"), [((), ()), ((PRIOR,), (1.0,)), ((PRIOR, ROUGH), (0.7, 0.0))]
)
@pytest.mark.parametrize("bounds", [(), (BOUNDS,)])
def test_it_is_cvxpy_s_program(
    boxed: bool, terms: tuple[Tikhonov, ...], weights: tuple[float, ...], bounds: tuple[Bounds, ...]
) -> None:
    problem = StepProblem(regularisers=terms, constraints=bounds, columns=COLUMNS)
    assert written(problem)
    rng = np.random.default_rng(3)
    R, d = np.triu(rng.normal(size=(4, 4))), rng.normal(size=4)
    box = (rng.normal(size=4), np.array([0.3, np.inf, 0.2, 1.0])) if boxed else None
    model = compile_step(problem, 9, boxed)
    if box is not None:
        model.set_box(*box)
    model.set_data(R, d, weights)
    wanted, (at,) = cone_program(model.problem, model.p)
    found, begins = quadratic_program(problem, R, d, weights, box)
    assert (begins, found.cones, found.constant) == (at, wanted.cones, wanted.constant)
    for mine, theirs in ((found.P, wanted.P), (found.A, wanted.A)):
        np.testing.assert_array_equal(mine.toarray(), theirs.toarray())
        assert mine.nnz == theirs.nnz
    np.testing.assert_array_equal(found.q, wanted.q)
    np.testing.assert_allclose(found.b, wanted.b, rtol=1e-15, atol=1e-15)


def test_others_are_left_to_cvxpy() -> None:
    held = Bounds(np.array([0.0, -1.0, -1.0, -1.0]), np.array([0.0, 1.0, 1.0, 1.0]))
    assert not written(StepProblem(constraints=(held,), columns=COLUMNS))  # an equality
    assert not written(StepProblem(loss=AbsoluteLoss(), columns=COLUMNS))
