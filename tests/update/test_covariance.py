"""Deviations of the parameters against Monte Carlo and closed forms; what the data leave open, in
words."""

import json

import numpy as np
import pytest

from cvxupdate.fe.parameters import Parameter
from cvxupdate.system import LinearSystem
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.modal import update_modal
from tests.cases.structures import PORTAL, TRUTH, free_chain, measured, portal, square, structure

NONE = np.zeros((0, 3))


def parameters(n: int = 3, lower: float = -np.inf, upper: float = np.inf) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(f"p{i + 1}", "stiffness", (), lower, upper, 0.0, 1.0, "1") for i in range(n)
    )


def system(A: np.ndarray, b: np.ndarray, std: float = 0.1) -> LinearSystem:
    return LinearSystem(
        A,
        b,
        np.full(len(b), 1.0 / std),
        tuple(f"p{i + 1}" for i in range(A.shape[1])),
        tuple(f"r{i}" for i in range(len(b))),
    )


def test_regular_least_squares_closed_form() -> None:
    """(AᵀW²A)⁻¹ for a residual within its deviations, whatever the bounds' widths."""
    rng = np.random.default_rng(0)
    A = rng.standard_normal((12, 3)) * [1.0, 20.0, 0.3]
    p = np.array([0.1, -0.2, 0.3])
    s = system(A, A @ p + 0.05 * rng.standard_normal(12))
    expected = np.linalg.inv(A.T @ A) * 0.1**2
    for q in (parameters(), parameters(lower=-0.01, upper=0.5)):
        u = uncertainty(s, p, q, NONE, False)
        assert np.allclose(u.covariance, expected, rtol=1e-9)
        assert np.allclose(u.std, np.sqrt(np.diag(expected)), rtol=1e-9)


def test_a_residual_too_large_widens_and_one_too_small_does_not_narrow() -> None:
    rng = np.random.default_rng(1)
    A, p = rng.standard_normal((40, 3)), np.zeros(3)
    noise = rng.standard_normal(40)
    base = np.sqrt(np.diag(np.linalg.inv(A.T @ A))) * 0.1
    large, small = (
        uncertainty(system(A, k * noise), p, parameters(), NONE, False) for k in (0.4, 0.01)
    )
    assert np.allclose(large.std, large.noise * base) and large.noise > 3
    assert np.allclose(small.std, base) and small.noise < 0.2
    weights_only = uncertainty(system(A, 0.01 * noise), p, parameters(), NONE, True)
    assert np.allclose(weights_only.std, small.noise * base)


def test_equalities_make_parameters_move_together() -> None:
    rng = np.random.default_rng(2)
    A, p = rng.standard_normal((10, 3)), np.zeros(3)
    u = uncertainty(system(A, np.zeros(10)), p, parameters(), np.array([[1.0, -1.0, 0.0]]), False)
    reduced = np.column_stack([A[:, 0] + A[:, 1], A[:, 2]])
    expected = np.sqrt(np.diag(np.linalg.inv(reduced.T @ reduced))) * 0.1
    assert np.allclose(u.std, expected[[0, 0, 1]])
    assert u.covariance[0, 1] == pytest.approx(u.covariance[0, 0])


def test_what_no_row_sees_is_not_determined_and_leaves_the_others_alone() -> None:
    rng = np.random.default_rng(3)
    A = rng.standard_normal((10, 3))
    A[:, 1] = 0.0
    u = uncertainty(system(A, np.zeros(10)), np.zeros(3), parameters(), NONE, False)
    other = np.sqrt(np.diag(np.linalg.inv(A[:, [0, 2]].T @ A[:, [0, 2]]))) * 0.1
    assert np.isinf(u.std[1]) and np.allclose(u.std[[0, 2]], other)
    assert [c.says for c in u.undetermined] == ["p2 is not determined by these recordings"]


def test_fewer_rows_than_parameters() -> None:
    A = np.array([[1.0, 1.0, 0.0]])
    u = uncertainty(system(A, np.zeros(1)), np.zeros(3), parameters(), NONE, False)
    assert np.all(np.isinf(u.std)) and len(u.undetermined) == 2
    said = " ".join(c.says for c in u.undetermined)
    assert "trade against each other" in said and "p3 is not determined" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("build", "wanted", "truth", "modes"),
    [
        (
            free_chain,
            ({"group": "k1", "of": "k"}, {"group": "k3", "of": "k"}, {"group": "m2", "of": "m"}),
            (0.1, -0.15, 0.2),
            (1, 2, 3, 4),
        ),
        (portal, (*PORTAL[:3], PORTAL[5]), (0.1, -0.15, 0.2, 0.1), range(1, 9)),
    ],
)
def test_against_monte_carlo(build, wanted, truth, modes) -> None:
    """100 draws of noise, 0.3 % on every frequency: the stated deviation is that of the scatter,
    the 95 % interval covers the truth."""
    problem = structure(build(), wanted, constraints={"bounds": {"lower": -0.6, "upper": 0.6}})
    found, stated = [], []
    for seed in range(100):
        updated = update_modal(
            *problem, [measured(problem[1], truth, modes, noise=seed, std=3e-3, pairs=list(modes))]
        )
        found.append([q.p for q in updated.parameters])
        stated.append([q.p_std for q in updated.parameters])
    scatter, typical = (
        np.std(found, axis=0, ddof=1),
        np.median(np.array(stated, dtype=float), axis=0),
    )
    coverage = np.mean(
        np.abs(np.array(found) - truth) < 1.96 * np.array(stated, dtype=float), axis=0
    )
    assert np.all(np.abs(typical / scatter - 1.0) < 0.15), (typical, scatter)
    assert np.all((coverage >= 0.90) & (coverage <= 0.99)), coverage


def test_E_and_rho_of_one_sheet_move_together() -> None:
    """Frequencies go with E/ρ: only the ratio is determined, and the words say so."""
    problem = structure(
        square(1.3),
        [{"elements": "all", "of": "E"}, {"elements": "all", "of": "rho"}],
        constraints={"bounds": {"lower": -0.5, "upper": 0.5}},
    )
    updated = update_modal(*problem, [measured(problem[1], [0.1, 0.0], range(1, 9), noise=1)])
    (one,) = updated.undetermined
    assert one["says"].startswith("all.E and all.rho move together") or one["says"].startswith(
        "all.rho and all.E move together"
    )
    assert one["standard_deviation"] is None and [
        q.standard_deviation for q in updated.parameters
    ] == [None, None]
    ratio = (1 + updated.parameters[0].p) / (1 + updated.parameters[1].p)
    assert ratio == pytest.approx(1.1, rel=2e-3)


def test_in_the_result_deviations_are_in_SI_and_safe_for_JSON() -> None:
    problem = structure(portal(), PORTAL, constraints={"bounds": {"lower": -0.5, "upper": 0.5}})
    updated = update_modal(*problem, [measured(problem[1], TRUTH, range(1, 9), noise=2)])
    spring, damper = updated.parameters[5], updated.parameters[6]
    assert spring.unit == "N/m" and spring.standard_deviation == pytest.approx(2.0e5 * spring.p_std)
    assert damper.standard_deviation is None and damper.p_std is None and not damper.at_bound
    assert [c["says"] for c in updated.undetermined] == [
        "damper.c is not determined by these recordings"
    ]
    json.dumps([q.__dict__ for q in updated.parameters], allow_nan=False)
    json.dumps(updated.undetermined, allow_nan=False)


def test_at_a_bound_the_deviation_is_that_of_the_recordings() -> None:
    """A bound that holds a parameter adds no knowledge: its deviation stays, and so does everyone
    else's."""
    tables = [
        measured(
            structure(portal(), PORTAL[:3])[1], [0.2, 0.0, 0.0], range(1, 9), relative_only=False
        )
    ]
    tight = update_modal(
        *structure(portal(), PORTAL[:3], constraints={"bounds": {"lower": -0.5, "upper": 0.15}}),
        tables,
    )
    free = update_modal(
        *structure(portal(), PORTAL[:3], constraints={"bounds": {"lower": -0.5, "upper": 0.5}}),
        tables,
    )
    assert (
        tight.parameters[0].at_bound
        and tight.parameters[0].bound == "upper"
        and tight.noise is not None
    )
    assert tight.parameters[0].p_std == pytest.approx(
        free.parameters[0].p_std * max(1.0, tight.noise), rel=0.2
    )
