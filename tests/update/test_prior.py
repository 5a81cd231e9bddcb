"""A prior in a problem file: about the nominal model it decides the end of the loop, about the
present point only the way there."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.update.modal import update_modal
from cvxupdate.update.modal_fit import modal_fit
from cvxupdate.update.result import Updated
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

SEEN = PORTAL[:6]
TRUE = TRUTH[:6]
STATED = {"column.stiffness": 0.05, "roof.E": 0.02}


def problem(**prior: Any) -> Any:
    tables = {"regularisation": [{"kind": "prior", **prior}]} if prior else {}
    return structure(portal(), SEEN, update={"tolerance": 1e-10, "max_iterations": 200}, **tables)


def solved(std: float = 1e-3, **prior: Any) -> tuple[Updated, np.ndarray]:
    case = problem(**prior)
    updated = update_modal(*case, [measured(case[1], TRUE, range(1, 9), std=std)])
    return updated, np.array([q.p for q in updated.parameters])


def test_about_the_nominal_model_the_end_balances_both() -> None:
    """Bayes' most probable model: Sᵀ V_εε⁻¹ r + V_PP⁻¹ p = 0, between the measurements and the
    model as it came."""
    case = problem(deviation=0.1, deviations=STATED)
    table = measured(case[1], TRUE, range(1, 9), std=0.02)
    loop, _ = modal_fit(*case, [table]).run(np.zeros(6))
    J, _ = loop.point.system().weighted()
    values, weights, _ = loop.point.differences
    pull = loop.point.p / np.array([STATED.get(q.name, 0.1) for q in case[1].parameters]) ** 2
    both = J.T @ (weights * values) + pull
    assert np.abs(both).max() < 1e-4 * np.abs(pull).max()
    assert np.linalg.norm(loop.point.p) < 0.9 * np.linalg.norm(TRUE)


def test_a_wide_prior_says_nothing_and_a_narrow_one_everything() -> None:
    assert np.abs(solved(deviation=1e4)[1] - TRUE).max() < 1e-6
    assert np.abs(solved(deviation=1e-6)[1]).max() < 1e-5


def test_about_the_present_point_the_end_is_that_of_the_measurements() -> None:
    """Only the steps are held back: more of them, to the same model; the objective that is reported
    has no penalty."""
    free, held = solved(), solved(deviation=0.02, about="present")
    assert np.abs(held[1] - TRUE).max() < 1e-5
    assert held[0].iterations > free[0].iterations
    assert held[0].fit["fit"]["objective"]["after"] < 1e-4
    falling = [h["objective"] for h in held[0].history]
    assert all(b <= a for a, b in itertools.pairwise(falling))


def test_a_covariance_takes_the_way_that_it_knows() -> None:
    """One frequency cannot tell two parameters apart; the prior's correlation does."""
    rows = [{"group": "column", "of": "stiffness"}, {"group": "roof", "of": "E"}]
    out = []
    for correlation in (0.9, -0.9):
        V = [[0.01, 0.01 * correlation], [0.01 * correlation, 0.01]]
        prior = [{"kind": "prior", "covariance": V}]
        case = structure(portal(), rows, regularisation=prior)
        table = measured(case[1], [0.1, 0.1], [1], std=1e-4)
        out.append([q.p for q in update_modal(*case, [table]).parameters])
    together, apart = np.array(out)
    assert together[0] == pytest.approx(together[1], rel=0.3) and together[0] > 0.05
    assert apart[0] * apart[1] < 0.0


def test_a_name_that_is_none_is_said() -> None:
    case = problem(deviation=0.1, deviations={"roof.G": 0.1})
    with pytest.raises(InputError, match=r"roof\.G, which is no parameter"):
        update_modal(*case, [measured(case[1], TRUE, range(1, 9))])
