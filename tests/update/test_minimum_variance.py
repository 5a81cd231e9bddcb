"""Minimum variance (2.8.2): Bayes' rule with the correlation that builds up, and Collins's form,
which counts the same measurements again at every iteration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec import Spec
from cvxupdate.update.minimum_variance import gain, posterior, within
from cvxupdate.update.modal import update_modal
from cvxupdate.update.result import Updated
from tests.cases.structures import PORTAL, measured, portal, structure

PRIOR = 0.08
FREE = np.zeros((0, 3))
ALL = (
    {"groups": ["column", "roof", "arm"], "of": "stiffness", "name": "all"},
    {"group": "tie", "of": "k", "name": "tie"},
)


def problem(parameters: Any, estimates: str, *, tied: bool = False, **update: Any) -> Any:
    tables = {"constraints": {"tied": [{"parameters": ["all", "tie"]}]}} if tied else {}
    return structure(
        portal(),
        parameters,
        update={"method": "minimum-variance", "estimates": estimates, **update},
        regularisation=[{"kind": "prior", "deviation": PRIOR}],
        **tables,
    )


def known(updated: Updated) -> tuple[np.ndarray, np.ndarray]:
    std = [q.p_std for q in updated.parameters]
    return np.array([q.p for q in updated.parameters]), np.array(std, dtype=float)


# --- the recursion ----------------------------------------------------------------------------


def covariance(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 5))
    return root @ root.T, rng.normal(size=(5, 3))


@pytest.mark.parametrize("seed", range(4))
def test_friswells_recursion_stands_still_where_the_derivatives_do(seed: int) -> None:
    """T = (V Sᵀ − D) V_z⁻¹ with D = 0 is the first step's gain; V and D after it are those that
    the method takes, (V₀⁻¹ + SᵀS)⁻¹ and V Sᵀ; with them the next gain is 0."""
    V0, S = covariance(seed)
    T = np.linalg.solve(S @ V0 @ S.T + np.eye(5), S @ V0).T
    np.testing.assert_allclose(gain(V0, S, FREE), T, atol=1e-9)
    V = posterior(V0, S, T)
    np.testing.assert_allclose(V, np.linalg.inv(np.linalg.inv(V0) + S.T @ S), atol=1e-9)
    D = T  # (1 − T S) 0 + T
    np.testing.assert_allclose(D, V @ S.T, atol=1e-9)
    Vz = S @ V @ S.T - S @ D - D.T @ S.T + np.eye(5)
    np.testing.assert_allclose(np.linalg.solve(Vz, (V @ S.T - D).T), 0.0, atol=1e-9)


def test_friswells_gain_grows_without_limit_where_the_derivatives_change_little() -> None:
    """One parameter, known well after the first step: his second gain is about 1/(S′ − S), which
    is why the covariances are taken at the present derivatives here."""
    V0, S = np.array([[1e4]]), np.array([[1e3]])
    T = gain(V0, S, np.zeros((0, 1)))
    V, D = posterior(V0, S, T), T
    for change in (1e-2, 1e-3, 1e-4):
        moved = S * (1.0 + change)
        Vz = moved @ V @ moved.T - moved @ D - D.T @ moved.T + 1.0
        again = ((V @ moved.T - D) / Vz).item()
        assert again == pytest.approx(1.0 / (S.item() * change), rel=0.05)


def test_a_parameter_that_is_held_keeps_its_covariance() -> None:
    V, S = covariance(3)
    held = np.array([[0.0, 1.0, 0.0]])
    after = posterior(V, S, gain(V, S, held))
    assert after[1, 1] == pytest.approx(V[1, 1], rel=1e-12)
    assert np.trace(after) < np.trace(V)
    tied = within(V, np.array([[1.0, -1.0, 0.0]]))
    assert tied[0, 0] == pytest.approx(tied[1, 1]) == pytest.approx(tied[0, 1])


# --- a linear model ---------------------------------------------------------------------------


def scaled(estimates: str, most: int) -> tuple[Updated, float, float, float]:
    """Every eigenvalue is proportional to the stiffness of all: linear. With Bayes' estimate, the
    measurements' own precision, and that of the prior."""
    case = problem(ALL, estimates, tied=True, max_iterations=most, tolerance=1e-14)
    table = measured(case[1], [0.1, 0.1], [1, 2, 3], std=0.03, noise=5)
    base = measured(case[1], [0.0, 0.0], [1, 2, 3]).frequency
    relative = 2.0 * table.frequency_std / table.frequency
    ratio = (base / table.frequency) ** 2
    S, wanted = ratio / relative, (1.0 - ratio) / relative
    told, before = float(S @ S), 2.0 / PRIOR**2  # two parameters that are one
    return update_modal(*case, [table]), float(S @ wanted) / (told + before), told, before


def test_correlated_estimates_stay_at_bayes_rule() -> None:
    updated, p, told, before = scaled("correlated", 20)
    found, deviations = known(updated)
    np.testing.assert_allclose(found, p, rtol=1e-6)
    np.testing.assert_allclose(deviations, (told + before) ** -0.5, rtol=1e-6)
    assert updated.status == "converged"


@pytest.mark.parametrize("count", [1, 4, 9])
def test_independent_estimates_count_the_measurements_at_every_iteration(count: int) -> None:
    """After k iterations estimate and deviation are those of k tables of the same numbers."""
    updated, p, told, before = scaled("independent", count)
    assert updated.iterations == count
    found, deviations = known(updated)
    np.testing.assert_allclose(deviations, (count * told + before) ** -0.5, rtol=1e-6)
    many = p * (told + before) * count / (count * told + before)
    np.testing.assert_allclose(found, many, rtol=1e-6)
    assert any("too small" in note for note in updated.notes)


# --- a nonlinear model ------------------------------------------------------------------------


@pytest.mark.slow
def test_stated_deviations_are_true_of_correlated_estimates_only() -> None:
    """Parameters drawn from the prior, frequencies with noise: (p − truth)² over the variance is 1
    on average with the correlation, and well above without."""
    free = PORTAL[:4]
    rng, ratio = np.random.default_rng(11), {}
    drawn = PRIOR * rng.standard_normal((40, len(free)))
    for estimates in ("correlated", "independent"):
        case = problem(free, estimates, max_iterations=12, tolerance=1e-9)
        squares = []
        for seed, truth in enumerate(drawn):
            table = measured(case[1], truth, range(1, 6), std=0.01, noise=seed)
            p, std = known(update_modal(*case, [table]))
            squares.append(((p - truth) / std) ** 2)
        ratio[estimates] = float(np.mean(squares))
    assert 0.75 < ratio["correlated"] < 1.3
    assert ratio["independent"] > 2.0


# --- refusals ---------------------------------------------------------------------------------


def tables(case: tuple[Spec, Model]) -> list[ModeTable]:
    return [measured(case[1], np.zeros(4), [1, 2, 3])]


def test_deviations_have_to_be_known() -> None:
    spec, model = problem(PORTAL[:4], "correlated")
    with pytest.raises(InputError, match='one kind = "prior"'):
        update_modal(replace(spec, regularisation=()), model, tables((spec, model)))


def test_many_ways_have_no_one_covariance() -> None:
    case = problem(PORTAL[:4], "correlated", release_bounds=True)
    with pytest.raises(InputError, match="release_bounds does not go with minimum-variance"):
        update_modal(*case, tables(case))
