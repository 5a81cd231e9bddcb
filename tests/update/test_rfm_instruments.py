"""Equation error (2.8.4): noise in the measured responses stands on both sides of the balance, so
least squares is biased; with the model's own responses as instruments it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.convex import SolverChoice
from cvxupdate.fe.model import Model
from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.residual.contraction import derivatives
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.residual.frf_output import output_rows
from cvxupdate.spec import Spec
from cvxupdate.update.parts import step_problem
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import Options
from tests.cases.structures import free_chain, structure

ROWS = [{"group": f"k{i}", "of": "stiffness"} for i in (1, 2, 3, 4)] + [{"group": "m3", "of": "m"}]
TRUTH = np.array([0.2, -0.15, 0.1, 0.05, -0.1])
LINES = np.linspace(22.0, 215.0, 24)
DRAWS = 40


@pytest.fixture(scope="module")
def chain() -> tuple[Spec, Model]:
    return structure(free_chain(), ROWS, constraints={"bounds": {"lower": -0.6, "upper": 0.6}})


def recorded(model: Model, level: float, seed: int) -> FrfData:
    """Every DOF measured, two references; noise of ``level`` of each line's r.m.s."""
    size = (len(LINES), 5, 2)
    empty = FrfData(
        "simulated", "fit", LINES, np.zeros(size), np.ones(size), np.arange(5), np.array([0, 3]),
        None, False, np.ones(size[1:], dtype=bool),
    )  # fmt: skip
    pairs = output_rows(matrices_with_damping(model, TRUTH), derivatives(model, TRUTH), empty)
    H = np.concatenate([differences for differences, _ in pairs])
    std = np.broadcast_to(level * np.sqrt(np.mean(H**2, axis=(1, 2), keepdims=True)), size)
    noise = np.random.default_rng(seed).standard_normal(size)
    return replace(empty, X=H + std * noise, std=std)


def fitted(chain: tuple[Spec, Model], kind: str, level: float, seed: int) -> np.ndarray:
    spec, model = chain
    data = [recorded(model, level, seed)]
    problem = step_problem(spec, model, [])
    loop = fit_responses(model, data, problem, SolverChoice(), Options(1e-8, 40, 0.3), kind)
    assert loop.status == "converged"
    return loop.point.p


def test_exact_responses_give_the_exact_model(chain: tuple[Spec, Model]) -> None:
    assert np.abs(fitted(chain, "instrumental", 1e-9, 0) - TRUTH).max() < 1e-7


def test_as_many_equations_as_parameters(chain: tuple[Spec, Model]) -> None:
    model = chain[1]
    point = FrfResidual(model, (recorded(model, 0.02, 1),), "instrumental").evaluate(model.zero())
    system = point.system()
    assert system.A.shape == (5, 5) and len(system.rows) == 5
    step = 1e-6
    for j in range(5):  # the balance is linear in p, and its rows are the derivatives stated
        moved = model.zero()
        moved[j] = step
        ahead = point.residual.evaluate(moved).values
        np.testing.assert_allclose((ahead - point.values) / step, system.A[:, j], rtol=1e-5)


@pytest.mark.slow
def test_unbiased_where_least_squares_is_biased(chain: tuple[Spec, Model]) -> None:
    """Means over draws in units of their standard errors: χ² of five parameters."""
    off = {}
    for kind in ("force-balance", "instrumental"):
        p = np.array([fitted(chain, kind, 0.1, seed) for seed in range(DRAWS)])
        apart = p.mean(axis=0) - TRUTH
        off[kind] = float(apart @ np.linalg.solve(np.cov(p.T) / DRAWS, apart))
    assert off["force-balance"] > 60.0
    assert off["instrumental"] < 20.0  # 99.9 % of χ² of five
