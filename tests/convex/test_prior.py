"""A prior of the parameters against thesis (2.107) in closed form, about either centre; what a
table may say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cvxupdate import convex as cv
from cvxupdate.errors import InputError
from cvxupdate.spec.grammar import grammar

from ..cases.convex_cases import COLUMNS, COVARIANCE, Bench, system

PRESENT = np.array([0.2, -0.1, 0.3, 0.0, -0.2, 0.1])


def problem(about: str, *constraints: cv.Constraint, loss: cv.Loss | None = None) -> cv.StepProblem:
    prior = cv.Prior(1.0, COVARIANCE, about)
    return cv.StepProblem(loss or cv.LeastSquares(), (prior,), constraints, COLUMNS)


@pytest.mark.parametrize("about", ["nominal", "present"])
@pytest.mark.parametrize("radius", [None, 50.0])
def test_the_two_forms_in_closed_form(about: str, radius: float | None) -> None:
    """Δp = (SᵀVS + V_PP)⁻¹ SᵀV Δw about the present point; about the nominal one −V_PP p beside it.

    A bound that is far off makes cvxpy and the written program agree on both.
    """
    data = system(outliers=0)
    S, target = data.weighted()
    V = np.linalg.inv(COVARIANCE)
    right = S.T @ (target - S @ PRESENT) - (V @ PRESENT if about == "nominal" else 0.0)
    move = np.linalg.solve(S.T @ S + V, right)
    tied = cv.LinearInequality({"a.E": 1.0}, upper=99.0)
    for one in (problem(about), problem(about, tied)):
        step = cv.CompiledStep(one, 24).solve(data, PRESENT, radius)
        np.testing.assert_allclose(step.p - PRESENT, move, atol=1e-7)
        wanted = data.residual(step.p) @ data.residual(step.p)
        seen = move if about == "present" else step.p
        assert step.objective == pytest.approx(wanted + seen @ V @ seen, rel=1e-9)


def test_cvxpy_s_step_begins_where_it_is_told() -> None:
    """With a loss that is not written down, the same compiled step from two places."""
    data = system(outliers=0)
    compiled = cv.CompiledStep(problem("present", loss=cv.Huber(1e3)), 24)
    plain = cv.CompiledStep(problem("present"), 24)
    for begin in (PRESENT, -2.0 * PRESENT):
        found = compiled.solve(data, begin, 50.0)
        np.testing.assert_allclose(found.p, plain.solve(data, begin, 50.0).p, atol=1e-6)


def test_scaled_parameters_have_the_scaled_prior() -> None:
    """Deviations are in the parameters' units: a parameter counted in thousandths gives the same
    model."""
    data = system(outliers=0)
    units = np.array([1.0, 1e-3, 1.0, 10.0, 1.0, 1e4])
    other = cv.Prior(1.0, COVARIANCE / np.outer(units, units))
    one = cv.solve_step(problem("nominal"), data).p
    scaled = type(data)(data.A * units, data.b, data.weights, data.columns, data.rows)
    two = cv.solve_step(cv.StepProblem(cv.LeastSquares(), (other,), (), COLUMNS), scaled).p
    np.testing.assert_allclose(two * units, one, atol=1e-8)


def test_degrees_of_freedom_fall_as_the_prior_narrows() -> None:
    WA, _ = system().weighted()
    none = np.zeros((0, 6))
    freedom = [
        cv.Prior(1.0, size * COVARIANCE).degrees_of_freedom(WA, np.zeros(6), 1.0, none, COLUMNS)
        for size in (1e6, 1.0, 1e-6)
    ]
    assert 6.0 >= freedom[0] > freedom[1] > freedom[2] >= 0.0


def made(**keys: Any) -> cv.Prior:
    table = grammar().model_fields["regularisation"].annotation.__args__[0]
    return cv.Prior.from_spec(table(kind="prior", **keys), Bench())


def test_tables() -> None:
    assert made(deviation=0.1).weight == 1.0  # Bayes', where the file names none
    assert made(deviation=0.1, weight="gcv").weight == "gcv"
    named = made(deviation=0.1, deviations={"c.k": 0.5}, about="present")
    np.testing.assert_allclose(np.sqrt(named.covariance), [0.1, 0.1, 0.1, 0.1, 0.5, 0.1])
    assert named.of_move
    rows = tuple(tuple(row) for row in COVARIANCE.tolist())
    np.testing.assert_array_equal(made(covariance=rows).covariance, COVARIANCE)


def test_independent_parameters_need_no_matrix() -> None:
    """The same penalty, weights and degrees of freedom by the variances alone."""
    variances = np.diag(COVARIANCE).copy()
    short, full = cv.Prior(1.0, variances), cv.Prior(1.0, np.diag(variances))
    rng = np.random.default_rng(2)
    WA, Wb, p = rng.normal(size=(9, 6)), rng.normal(size=9), rng.normal(size=6)
    assert short.value(p, COLUMNS) == pytest.approx(full.value(p, COLUMNS), rel=1e-12)
    np.testing.assert_allclose(short.matrix, full.matrix)
    np.testing.assert_allclose(
        short.weight_range(WA, Wb, COLUMNS), full.weight_range(WA, Wb, COLUMNS)
    )
    none = np.zeros((0, 6))
    freedoms = [x.degrees_of_freedom(WA, p, 1.0, none, COLUMNS) for x in (short, full)]
    assert freedoms[0] == pytest.approx(freedoms[1], rel=1e-12)
    with pytest.raises(InputError, match="every variance"):
        cv.Prior(1.0, np.append(variances[:5], 0.0))
    with pytest.raises(InputError, match="6 × 6, but there are 5"):
        short.value(p[:5], COLUMNS[:5])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"deviations": {"a.E": 0.1}}, r"no deviation of a\.rho.*Add `deviation`"),
        ({"deviation": 0.1, "deviations": {"a.G": 0.1}}, r"a\.G, which is no parameter"),
        ({"covariance": ((1.0, 0.0), (0.0, 1.0))}, "6 rows of 6 numbers"),
        ({"covariance": ((1.0,) * 6,) * 6}, "positive definite"),
        ({"covariance": ((1.0,) * 6,) * 6, "deviation": 0.1}, "not both"),
        ({"deviation": 0.1, "about": "present", "weight": "l-curve"}, "one centre"),
    ],
)
def test_a_wrong_table_is_refused_in_words(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        made(**keys)
