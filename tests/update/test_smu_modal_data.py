"""Updating on the measured modes of smu-modal-data, beside what is published of them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from scipy.optimize import linear_sum_assignment

from cvxupdate.study import open_problem, run
from cvxupdate.update.modal_fit import modal_fit

FOLDER = Path(__file__).resolve().parents[2] / "problems/real/smu-modal-data"
DATA = Path(os.environ.get("CVXUPDATE_DATA", "")) / "smu-modal-data"
ALPHA = np.array([-0.1, 0.2, 0.2, -0.05, 0.2, 0.15, 0.15, 0.10, -0.10, -0.15, 0.20, 0.15])

pytestmark = pytest.mark.skipif(
    not (DATA / "SteelPedestrianBridgeExp.mat").is_file(),
    reason="needs the data set smu-modal-data under CVXUPDATE_DATA",
)


def test_footbridge_reaches_the_published_minimum_from_the_nominal_model() -> None:
    """0.22673 is the best of 100 random starts of the published comparison; 0.22680 is within the
    figure that its README asks for."""
    updated = run(FOLDER / "problem_footbridge.toml")
    fit = updated.fit["fit"]
    assert fit["objective"]["after"] <= 0.22680
    assert fit["frequency_error_percent_mean"]["before"] == pytest.approx(8.06, abs=0.01)
    assert fit["frequency_error_percent_mean"]["after"] < 0.2
    assert fit["mac_mean"]["after"] == pytest.approx(0.931, abs=1e-3)  # the published price


def test_footbridge_objective_is_the_published_formula() -> None:
    """Form 1 written out with dense matrices, at a point inside the bounds."""
    spec, model, recordings = open_problem(FOLDER / "problem_footbridge.toml")
    fit = modal_fit(spec, model, recordings)
    p = np.array([0.05, -0.04, *np.linspace(-0.1, 0.3, 11), 0.5, 2.0, -0.3, 1.0])
    m = model.matrices(p)
    values, shapes = la.eigh(m.M.toarray(), m.K.toarray(), subset_by_index=[model.size - 8, 945])
    values, shapes = 1.0 / values[::-1], shapes[:, ::-1]
    table = fit.residual.fit[0]
    sensors = [model.place[c.label] for c in table.channels]
    total = []
    for i, f in enumerate(table.frequency):
        lam, psi, std = (2 * np.pi * f) ** 2, table.shapes[i], table.shape_std[i]
        sigma = 2 * lam * table.frequency_std[i] / f
        w = 1 / np.linalg.norm(std[psi != 1.0])
        phi = shapes[sensors]
        mac = (phi.T @ psi) ** 2 / (np.sum(phi**2, axis=0) * (psi @ psi))
        total.append(((values - lam) / sigma) ** 2 + ((1 - np.sqrt(mac)) / np.sqrt(mac) * w) ** 2)
    cost = np.array(total)
    best = cost[linear_sum_assignment(cost)].sum()
    assert fit.objective(p) == pytest.approx(best, rel=1e-6)


def test_four_storeys_hold_their_third_and_fourth_modes() -> None:
    """Fitted to two modes at three floors; the best published: 0.75 % and MAC 0.991."""
    updated = run(FOLDER / "problem_four_storey.toml")
    held = updated.fit["hold_out"]
    assert held["frequency_error_percent_max"]["after"] <= 0.75
    assert held["mac_min"]["after"] >= 0.991
    assert held["frequency_error_percent_max"]["before"] > 3.0


@pytest.mark.parametrize("seed", [1, 2])
def test_concrete_frame_is_exact_from_far_off(seed: int) -> None:
    """The simulated target comes back to 1e-6 from a random start with |α| ≤ 0.5."""
    spec, model, recordings = open_problem(FOLDER / "problem_concrete_frame.toml")
    fit = modal_fit(spec, model, recordings)
    start = np.random.default_rng(seed).uniform(-0.5, 0.5, 12)
    loop, _ = fit.run(start)
    assert np.abs(loop.point.p - ALPHA).max() <= 1e-6
    assert np.abs(start - ALPHA).max() > 0.3


def test_a_zero_deviation_no_longer_ends_in_an_error() -> None:
    """The default form on the footbridge, whose normalised entries have a deviation of 0."""
    spec, model, recordings = open_problem(FOLDER / "problem_footbridge.toml")
    fit = modal_fit(spec, model, recordings)
    point = replace(fit.residual, form="scale", repaired=False).evaluate(model.zero())
    system = point.system()
    assert np.all(np.isfinite(system.weights)) and len(system.rows) == 5 + 5 * 57
