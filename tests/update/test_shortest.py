"""Minimum norm (2.101): fewer measurements than parameters leave many steps that fit; the shortest
moves only what the measurements ask for."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from cvxupdate.errors import InputError
from cvxupdate.update.modal import update_modal
from cvxupdate.update.modal_fit import modal_fit
from cvxupdate.update.trust_region import LoopResult
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

FREE = PORTAL[:6]


def case(solution: str, bounds: float = 2.0, **more: Any) -> tuple[Any, ...]:
    spec, model = structure(
        portal(),
        FREE,
        update={"solution": solution, "trust_radius": 10.0, **more.pop("update", {})},
        constraints={"bounds": {"lower": -0.9, "upper": bounds}},
        **more,
    )
    return spec, model, [measured(model, TRUTH[:6], [1, 2, 3])]


def after(solution: str, steps: int, **more: Any) -> LoopResult[Any]:
    fit = modal_fit(*case(solution, **more))
    fit = dataclasses.replace(fit, options=dataclasses.replace(fit.options, max_iterations=steps))
    return fit.run(fit.residual.model.zero())[0]


def test_the_first_step_is_the_pseudo_inverse() -> None:
    loop = after("minimum-norm", 1)
    J, b = loop.start.system().weighted()
    assert np.linalg.matrix_rank(J) == 3
    np.testing.assert_allclose(loop.step.p, np.linalg.pinv(J) @ b, atol=1e-7)
    assert loop.step.certificate.is_optimal()


def test_bounds_are_kept_and_the_step_is_the_shortest_inside() -> None:
    free = after("minimum-norm", 1).step.p
    most = 0.6 * float(free.max())
    loop = after("minimum-norm", 1, bounds=most)
    p, (J, b) = loop.step.p, loop.start.system().weighted()
    np.testing.assert_allclose(J @ p, b, atol=1e-6 * np.abs(b).max())
    assert p.max() == pytest.approx(most, abs=1e-7)
    size = np.linalg.norm(J, axis=1)
    best = minimize(
        lambda q: q @ q,
        np.clip(free, -0.9, most),
        jac=lambda q: 2.0 * q,
        bounds=[(-0.9, most)] * len(p),
        constraints=[
            {
                "type": "eq",
                "fun": lambda q: (J @ q - b) / size,
                "jac": lambda q: J / size[:, None],
            }
        ],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 200},
    )
    assert p @ p == pytest.approx(best.fun, rel=1e-6)


def test_the_loop_meets_the_measurements_with_less_change() -> None:
    short, plain = after("minimum-norm", 30), after("convex", 30)
    for loop in (short, plain):
        values, weights, _ = loop.point.differences
        assert np.abs(weights * values).max() < 1e-4
    assert np.linalg.norm(short.point.p) < np.linalg.norm(plain.point.p)


def test_where_everything_is_determined_nothing_changes() -> None:
    spec, model, _ = case("minimum-norm")
    table = measured(model, TRUTH[:6], range(1, 8), channels=("n3.x", "n4.y", "n6.x", "n6.y"))
    spec = dataclasses.replace(
        spec, update=spec.update.model_copy(update={"method": "sensitivity"})
    )
    updated = update_modal(spec, model, [table])
    np.testing.assert_allclose([q.p for q in updated.parameters], TRUTH[:6], atol=1e-6)


def test_a_penalty_leaves_nothing_to_choose() -> None:
    with pytest.raises(InputError, match="minimum-norm.*penalty tikhonov leaves one only"):
        modal_fit(*case("minimum-norm", regularisation=[{"kind": "tikhonov", "weight": 1.0}]))
