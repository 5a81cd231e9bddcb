"""Equation error (2.8.4) with the model's receptances where nothing was measured, and on the
model's modes: what is exact and what is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.convex import SolverChoice
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.residual.frf import FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.spec import Spec
from cvxupdate.study import run, solvers
from cvxupdate.update.parts import step_problem
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import LoopResult, Options
from tests.cases.elements import toml
from tests.cases.structures import free_chain, structure
from tests.update.test_rfm_instruments import ROWS, TRUTH, recorded

FAR = np.array([0.5, -0.4, 0.45, -0.35, 0.4])


@pytest.fixture(scope="module")
def chain() -> tuple[Spec, Model]:
    return structure(free_chain(), ROWS, constraints={"bounds": {"lower": -0.6, "upper": 0.6}})


def measured_at(data: FrfData, sensors: list[int]) -> FrfData:
    """The same at some of the DOFs."""
    return replace(
        data,
        X=data.X[:, sensors],
        std=data.std[:, sensors],
        responses=data.responses[sensors],
        used=data.used[sensors],
    )


def end(
    chain: tuple[Spec, Model], data: FrfData, kind: str, start: np.ndarray
) -> LoopResult[FrfPoint]:
    spec, model = chain
    problem = step_problem(spec, model, [])
    return fit_responses(
        model, [data], problem, SolverChoice(), Options(1e-9, 60, 0.6), kind, start
    )


# --- Lin and Ewins: residual.frf_filled ------------------------------------------------------


def test_filled_is_exact_and_linear_however_far_where_all_is_measured(
    chain: tuple[Spec, Model],
) -> None:
    """H − X = H ΔZ X holds for any ΔZ: the truth satisfies the equations of a far-off model, and
    their rows change with p by exactly what they state."""
    model = chain[1]
    data = recorded_of(model, TRUTH)
    residual = FrfResidual(model, (data,), "filled", FAR)
    at = residual.evaluate(FAR)
    assert np.abs(residual.evaluate(TRUTH).values).max() <= 1e-10 * np.abs(data.X).max()
    moved = residual.evaluate(FAR + 0.3 * np.arange(5))
    np.testing.assert_allclose(
        moved.values - at.values, at.jacobian @ (0.3 * np.arange(5)), atol=1e-12
    )
    balance = FrfResidual(model, (data,), "flexibility", FAR).evaluate(TRUTH + 0.1)
    np.testing.assert_allclose(
        residual.evaluate(TRUTH + 0.1).values, balance.values, atol=1e-9 * np.abs(data.X).max()
    )


def test_at_the_truth_filled_is_the_output_error(chain: tuple[Spec, Model]) -> None:
    """There nothing is missing, and the derivatives are those of the responses."""
    model = chain[1]
    data = measured_at(recorded_of(model, TRUTH), [0, 2, 4])
    filled = FrfResidual(model, (data,), "filled", TRUTH).evaluate(TRUTH)
    output = FrfResidual(model, (data,), "receptance").evaluate(TRUTH)
    np.testing.assert_allclose(filled.values, output.values, atol=1e-14)
    scale = np.abs(output.jacobian).max()
    np.testing.assert_allclose(filled.jacobian, output.jacobian, atol=1e-7 * scale)


@pytest.mark.parametrize("sensors", [[0, 1, 2, 3, 4], [0, 1, 3, 4]])
def test_filled_ends_at_the_truth(chain: tuple[Spec, Model], sensors: list[int]) -> None:
    data = measured_at(recorded_of(chain[1], TRUTH), sensors)
    loop = end(chain, data, "filled", np.zeros(5))
    assert loop.status == "converged"
    np.testing.assert_allclose(loop.point.p, TRUTH, atol=1e-5)


# --- Friswell and Penny: residual.frf_modal --------------------------------------------------


def test_on_all_modes_the_balance_is_that_of_all_dofs(chain: tuple[Spec, Model]) -> None:
    """Φ is then a change of coordinates: the truth satisfies the equations of a far-off model."""
    model = chain[1]
    data = recorded_of(model, TRUTH)
    residual = FrfResidual(model, (data,), "modal-balance", FAR)
    size = np.abs(residual.evaluate(FAR).values).max()
    assert np.abs(residual.evaluate(TRUTH).values).max() <= 1e-10 * size
    assert len(residual.labels) == len(residual.weights) == residual.evaluate(FAR).values.size
    at, move = residual.evaluate(FAR), 0.1 * np.arange(5)  # linear, with the derivatives it states
    moved = residual.evaluate(FAR + move).values - at.values
    np.testing.assert_allclose(moved, at.jacobian @ move, atol=1e-10 * size)
    loop = end(chain, data, "modal-balance", np.zeros(5))
    np.testing.assert_allclose(loop.point.p, TRUTH, atol=1e-6)


def test_few_modes_leave_a_bias_that_lines_far_below_the_last_keep_small(
    chain: tuple[Spec, Model],
) -> None:
    """Three springs from four sensors and four of five modes."""
    spec, model = structure(
        free_chain(), ROWS[:3], constraints={"bounds": {"lower": -0.6, "upper": 0.6}}
    )
    truth, sensors = TRUTH[:3], [0, 1, 3, 4]
    full = recorded_of(model, truth)
    high = measured_at(full, sensors)
    low = measured_at(full.at(np.flatnonzero(full.frequency < 120.0)), sensors)
    off = {
        name: np.abs(end((spec, model), data, "modal-balance", np.zeros(3)).point.p - truth).max()
        for name, data in (("high", high), ("low", low))
    }
    assert off["low"] < 0.02 and off["low"] < off["high"]


def recorded_of(model: Model, truth: np.ndarray) -> FrfData:
    """`recorded` of a model with any of the parameters, exact."""
    empty = recorded(structure(free_chain(), ROWS)[1], 1e-9, 0)
    exact = FrfResidual(model, (replace(empty, X=np.zeros(empty.X.shape)),), "receptance")
    return replace(empty, X=exact.evaluate(truth).values.reshape(empty.X.shape))


def test_sensors_that_do_not_tell_modes_apart_are_refused(chain: tuple[Spec, Model]) -> None:
    model = chain[1]
    data = measured_at(recorded_of(model, TRUTH), [0])
    with pytest.raises(InputError, match="modal-balance.*do not tell from each other"):
        FrfResidual(model, (data,), "modal-balance").evaluate(model.zero())


# --- from a problem file ------------------------------------------------------------------------


@pytest.mark.parametrize("residual", ["filter", "filled", "modal-balance"])
def test_by_name_from_a_problem_file(residual: str, tmp_path: Path) -> None:
    """A chain recorded at every mass: the command finds the truth, `solvers` has a step to
    compare."""
    model = structure(free_chain(), ROWS)[1]
    data = recorded_of(model, TRUTH)
    labels = [c.split(".")[0][1:] for c in model.labels]
    np.savez(
        tmp_path / "frf.npz",
        frequency=data.frequency,
        H=data.X.astype(complex),
        response_node=np.array(labels, dtype=int),
        response_dof=np.ones(5, dtype=int),
        reference_node=np.array([labels[i] for i in data.references], dtype=int),
        reference_dof=np.ones(2, dtype=int),
    )
    tables = {
        "model": free_chain(),
        "recordings": [{"kind": "frf", "file": "frf.npz", "response": "displacement"}],
        "update": {
            "method": "rfm",
            "residual": residual,
            "noise": 0.01,
            "frequency_points": "all",
            "parameters": [{**row, "lower": -0.6, "upper": 0.6} for row in ROWS],
        },
    }
    path = tmp_path / "problem.toml"
    path.write_text("\n".join(f"{k} = {toml(v)}" for k, v in tables.items()) + "\n")
    updated = run(path)
    assert updated.status == "converged"
    np.testing.assert_allclose([q.p for q in updated.parameters], TRUTH, atol=1e-4)
    _, rows, spread = solvers(path)
    assert sum(r.status == "optimal" for r in rows) > 1 and spread < 1e-6
