"""From the tables of a problem file to the parts of a step."""

import numpy as np
import pytest

from cvxupdate.convex import L1, GroupL1, Huber, SolverChoice, Tikhonov
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.errors import InputError
from cvxupdate.update.parts import equality_rows, loop_options, solver_choice, step_problem
from cvxupdate.update.trust_region import Options
from tests.cases.structures import PORTAL, portal, structure

NAMES = (
    "column.stiffness",
    "roof.E",
    "arm.stiffness",
    "column.mass",
    "lump.m",
    "tie.k",
    "damper.c",
)


def broken(problem, p: dict[str, float]) -> list[str]:
    values = np.array([p.get(name, 0.0) for name in problem.columns])
    return [c.name for c in problem.clauses if violation(c, values) > 1e-9]


def test_every_table_becomes_its_clauses() -> None:
    tables = {
        "bounds": {"lower": -0.4, "upper": 0.6},
        "tied": [{"parameters": ["roof.E", "arm.stiffness"]}],
        "linear": [
            {"coefficients": {"tie.k": 1.0, "lump.m": 2.0}, "equals": 0.3},
            {"coefficients": {"damper.c": 1.0}, "at_most": 0.1},
        ],
    }
    spec, model = structure(
        portal(),
        PORTAL,
        constraints=tables,
        regularisation=[{"kind": "tikhonov", "weight": 2.0}],
        update={"loss": "huber"},
    )
    problem = step_problem(spec, model, ())
    assert (
        problem.columns == NAMES
        and isinstance(problem.loss, Huber)
        and isinstance(problem.regularisers[0], Tikhonov)
    )
    fine = {"tie.k": 0.1, "lump.m": 0.1}
    assert not broken(problem, fine)
    for change in (
        {"column.mass": -0.41},
        {"column.mass": 0.61},
        {"roof.E": 0.1},
        {"tie.k": 0.2},
        {"damper.c": 0.11},
    ):
        assert len(broken(problem, {**fine, **change})) == 1, change
    assert not broken(problem, {**fine, "roof.E": 0.1, "arm.stiffness": 0.1})


def test_total_mass_row_is_the_gradient_of_the_mass() -> None:
    spec, model = structure(portal(), PORTAL, constraints={"total_mass": {"conserve": True}})
    problem = step_problem(spec, model, ())
    (row,) = equality_rows(problem, model.zero())
    gradient = model.mass_gradient(model.zero())
    assert np.count_nonzero(gradient) == 2
    assert np.allclose(row / np.linalg.norm(row), gradient / np.linalg.norm(gradient))
    weighed, _ = structure(
        portal(), PORTAL, constraints={"total_mass": {"value": 1.02 * model.total_mass()}}
    )
    moved = {"lump.m": 0.02 * model.total_mass() / 0.9}
    assert not broken(step_problem(weighed, model, ()), moved) and broken(
        step_problem(weighed, model, ()), {}
    )


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        (({"group": "column", "of": "E"},), "no parameter changes the mass"),
        (
            ({"group": "column", "of": "rho"}, {"group": "column", "of": "height"}),
            "not linear in the parameters",
        ),
    ],
)
def test_a_total_mass_that_cannot_be_a_clause_is_told(parameters, says) -> None:
    spec, model = structure(portal(), parameters, constraints={"total_mass": {"conserve": True}})
    with pytest.raises(InputError, match=says):
        step_problem(spec, model, ())


def test_equality_rows_are_those_of_equalities_only() -> None:
    tables = {
        "bounds": {"lower": -0.4, "upper": 0.6},
        "tied": [{"parameters": ["roof.E", "arm.stiffness", "tie.k"]}],
        "linear": [{"coefficients": {"tie.k": 1.0}, "at_least": 0.0}],
    }
    spec, model = structure(portal(), PORTAL, constraints=tables)
    rows = equality_rows(step_problem(spec, model, ()), model.zero())
    assert rows.shape == (2, 7) and np.linalg.matrix_rank(rows) == 2
    assert np.allclose(rows @ np.array([1.0, 0.2, 0.2, 1.0, 1.0, 0.2, 1.0]), 0.0)
    spec, model = structure(portal(), PORTAL)
    assert equality_rows(step_problem(spec, model, ()), model.zero()).shape == (0, 7)


def test_regularisers_solver_and_options() -> None:
    spec, model = structure(
        portal(),
        PORTAL,
        regularisation=[{"kind": "l1", "weight": 1.0}, {"kind": "group-l1", "weight": 2.0}],
        solver={"name": "osqp", "tolerance": 1e-9, "max_iterations": 77},
        update={"tolerance": 1e-4, "max_iterations": 9},
    )
    kinds = [type(r) for r in step_problem(spec, model, ()).regularisers]
    assert kinds == [L1, GroupL1]
    assert solver_choice(spec) == SolverChoice("OSQP", 1e-9, 77)
    assert loop_options(spec, model) == Options(1e-4, 9, Options.radius)
    plain, model = structure(portal(), PORTAL)
    assert solver_choice(plain) == SolverChoice("CLARABEL", SolverChoice.tolerance, None)
    assert (
        loop_options(
            *structure(portal(), PORTAL, constraints={"trust_region": {"radius": 0.07}})
        ).radius
        == 0.07
    )
    assert (
        loop_options(
            *structure(
                portal(),
                PORTAL,
                update={"trust_radius": 0.02},
                constraints={"trust_region": {"radius": 0.07}},
            )
        ).radius
        == 0.02
    )
    every = loop_options(
        *structure(
            portal(),
            PORTAL,
            update={"form": "multiplicative", "line_search": True, "second_order": True},
        )
    )
    assert every.relative == (True,) * 7 and every.line_search and every.second_order
