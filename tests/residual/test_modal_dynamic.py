"""The modal dynamic residual: nothing is left of exact modes, derivatives, weights of the measured
deviations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.residual import modal_dynamic
from cvxupdate.residual.modal_dynamic import DynamicResidual, dynamic_residual
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")
P = np.array([0.05, -0.03, 0.02, 0.04, 0.1, -0.05, 0.0])


def residual(**how: object) -> DynamicResidual:
    model = structure(portal(), PORTAL)[1]
    table = measured(model, TRUTH, [1, 2, 3, 4], channels=CHANNELS, **how)  # type: ignore[arg-type]
    return dynamic_residual(model, [table], model.zero())


def test_exact_modes_leave_nothing_at_the_truth_and_much_elsewhere() -> None:
    r = residual()
    here, zero = (np.sum(r.evaluate(p).differences[0] ** 2) for p in (TRUTH, np.zeros(7)))
    assert here < 1e-10 < 1.0 < zero
    full = r.evaluate(TRUTH).modes[2].full
    assert np.allclose(full[r.assigned[2].at], r.assigned[2].shape)
    assert np.linalg.norm(full) > 1.001 * np.linalg.norm(r.assigned[2].shape)


def test_gradient_is_that_of_the_residual_with_the_unmeasured_entries_eliminated() -> None:
    """Aᵀr against central differences of ½ ‖r‖², in every parameter: stiffness, mass, damping."""
    r = residual(noise=2)

    def half(p: np.ndarray) -> float:
        return float(np.sum(r.evaluate(p).differences[0] ** 2)) / 2.0

    system, h = r.evaluate(P).system(), 1e-5
    mine = system.weighted()[0].T @ system.residual(P)
    for j in range(len(P)):
        d = np.zeros(len(P))
        d[j] = h
        other = (half(P + d) - half(P - d)) / (2 * h)
        assert mine[j] == pytest.approx(other, rel=1e-5, abs=1e-5 * np.abs(mine).max())
    assert mine[-1] == 0.0 and np.abs(mine[:-1]).min() > 0.0  # a dashpot moves no undamped mode


def test_objective_at_the_truth_is_chi_squared_of_the_measured_entries() -> None:
    """Weighted by the deviations, the mean over noise is the number of what was measured less what
    scales each shape, whatever the model's size."""
    r = residual()
    truth = [
        float(np.sum(replace(residual(noise=seed), at=TRUTH).evaluate(TRUTH).differences[0] ** 2))
        for seed in range(1, 13)
    ]
    counted = 4 * len(CHANNELS)
    assert r.evaluate(P).system().count == counted
    spread = np.sqrt(2.0 * counted / len(truth))
    assert np.mean(truth) == pytest.approx(counted, abs=4.0 * spread)


def test_what_it_cannot_take_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    model = structure(portal(), PORTAL)[1]
    table = measured(model, TRUTH, [1, 2], channels=CHANNELS)
    certain = replace(table, shape_std=np.zeros_like(table.shapes))
    with pytest.raises(InputError, match="no deviation above 0"):
        dynamic_residual(model, [certain], model.zero())
    with pytest.raises(InputError, match="needs measured mode shapes"):
        dynamic_residual(model, [replace(table, shapes=None, shape_std=None)], model.zero())
    with monkeypatch.context() as patch:
        patch.setattr(type(model), "exact", True)
        with pytest.raises(InputError, match="exact members have a dynamic stiffness instead"):
            dynamic_residual(model, [table], model.zero())
    monkeypatch.setattr(modal_dynamic, "DENSE", 10)
    with pytest.raises(InputError, match=r'up to 10 DOFs; the model has 15. Take method "ceam"'):
        dynamic_residual(model, [table], model.zero())
