"""A force balance by itself: its weights are taken anew until they belong to its solution, and the
noise in A that is left shows as bias."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from cvxupdate.convex import SolverChoice
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import Options, iterate, objective_at
from validation.studies.bay_case import CORNER, TRUTH, bay, data_of, error, fe1, step
from validation.studies.rfm_noise_in_a import summary

LINES = np.array(
    [20.0, 30, 46, 66, 75, 90, 117, 124, 145, 170, 190, 200, 240, 250, 281, 305, 330, 335, 370, 380]
)
OPTIONS = Options(1e-6, 60, 0.1)


@pytest.fixture(scope="module")
def frame():
    return fe1(), bay.receptance(bay.build("X1"), LINES, bay.TEN, CORNER)


def noisy(model, exact, seed, level=0.02):
    return (
        data_of(model, LINES, bay.noisy(exact, level, seed), bay.TEN, CORNER, level / np.sqrt(3)),
    )


@pytest.mark.parametrize("kind", ["force-balance", "flexibility"])
def test_weights_belong_to_the_solution(frame, kind):
    model, exact = frame
    data = noisy(model, exact, 1)
    loop = fit_responses(model, data, step(model), SolverChoice(), OPTIONS, kind)
    assert loop.status == "converged" and [h.number for h in loop.history] == list(
        range(1, len(loop.history) + 1)
    )
    own = FrfResidual(model, data, kind, loop.point.p)
    assert loop.point.residual.weights == pytest.approx(own.weights, rel=0.05)
    again = iterate(own, step(model), SolverChoice(), OPTIONS, loop.point.p)
    assert np.abs(again.point.p - loop.point.p).max() < 1e-3
    assert objective_at(loop.problem, loop.point) < objective_at(
        loop.problem, loop.start
    )  # both in the last weights
    assert loop.start.residual is loop.point.residual


def test_exact_data_need_no_second_weights(frame):
    model, exact = frame
    data = (data_of(model, LINES[:10], exact[:10], bay.TEN, CORNER, 1e-3),)
    loop = fit_responses(model, data, step(model), SolverChoice(), OPTIONS, "flexibility")
    assert loop.point.residual.at == pytest.approx(np.zeros(40)) and error(loop.point.p) < 1e-6


def test_weights_that_have_settled_are_not_taken_anew(frame, monkeypatch):
    """From where the force balance with the covariance of its own solution ends, the whole method
    solves one balance more, which stays where it is, and then the output error."""
    model, exact = frame
    data = (
        data_of(
            model,
            LINES[:10],
            bay.noisy(exact[:10], 0.02, 1),
            bay.TEN,
            CORNER,
            0.02 / np.sqrt(3),
        ),
    )
    problem, choice = step(model), SolverChoice()
    settled = fit_responses(model, data, problem, choice, OPTIONS, "flexibility").point.p
    loops = importlib.import_module("cvxupdate.update.rfm_loop")
    solved = []

    def watched(residual, *rest):
        solved.append(residual.kind)
        return iterate(residual, *rest)

    monkeypatch.setattr(loops, "iterate", watched)
    fit_responses(model, data, problem, choice, OPTIONS, p0=settled)
    assert solved == ["flexibility", "receptance"]
    assert np.abs(settled).max() > 0.1  # far from where the model came


@pytest.mark.slow
def test_noise_in_a_with_the_covariance_of_the_solution(frame):
    """With the weights of the start 3 % of noise in A drown the answer; with those of the solution
    they do not (`validation/studies/rfm_noise_in_a.py` has the bias)."""
    model, exact = frame
    data = noisy(model, exact, 2, 0.03)
    held = iterate(
        FrfResidual(model, data, "flexibility", model.zero()),
        step(model),
        SolverChoice(),
        OPTIONS,
        model.zero(),
    )
    anew = fit_responses(model, data, step(model), SolverChoice(), OPTIONS, "flexibility")
    assert error(anew.point.p) < 0.2 * error(held.point.p)
    assert error(anew.point.p) < 0.6


def test_bias_is_that_of_the_mean():
    """The summary of the study: a constant shift is bias, scatter about the truth is none."""
    size = np.linalg.norm(TRUTH)
    shifted = TRUTH + 0.3 * size * np.ones((5, 40)) / np.sqrt(40)
    assert summary(shifted) == pytest.approx((0.3, 0.0, 0.3))
    scattered = TRUTH + np.concatenate([np.eye(40), -np.eye(40)])
    bias, _, mean = summary(scattered)
    assert bias == pytest.approx(0.0, abs=1e-12) and mean == pytest.approx(1.0 / size)
