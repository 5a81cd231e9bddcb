"""Forms that compare shapes: derivatives, invariances, and what a deviation of zero means."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.residual.modal import ModalResidual, modal_residual
from cvxupdate.residual.shape_forms import FORMS, deviations
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

RNG = np.random.default_rng(4)
X = RNG.standard_normal(7)
PHI = 0.4 * X + 0.1 * RNG.standard_normal(7)
STD = 0.02 + 0.03 * RNG.random(7)
FIXED = np.where(np.arange(7) == 3, 0.0, STD)
CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")


@pytest.mark.parametrize("std", [STD, FIXED], ids=["stated", "one fixed"])
@pytest.mark.parametrize("name", FORMS)
def test_derivative_is_that_of_the_rows(name: str, std: np.ndarray) -> None:
    form, h = FORMS[name], 1e-6
    mine = form.derivative(PHI, X, std)
    for k in range(len(PHI)):
        d = np.zeros(len(PHI))
        d[k] = h
        other = form.rows(PHI + d, X, std).values - form.rows(PHI - d, X, std).values
        assert np.allclose(mine[:, k], other / (2 * h), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("std", [STD, FIXED], ids=["stated", "one fixed"])
@pytest.mark.parametrize("name", FORMS)
def test_misfits_of_many_shapes_are_those_of_their_rows(name: str, std: np.ndarray) -> None:
    form, many = FORMS[name], np.column_stack([PHI, -2.0 * X, RNG.standard_normal(7)])
    found = [form.rows(phi, X, std) for phi in many.T]
    each = [np.sum((f.weights * f.values) ** 2) for f in found]
    assert np.allclose(form.misfits(many, X, std), each, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("name", FORMS)
def test_scale_and_sign_of_the_model_do_not_count(name: str) -> None:
    form = FORMS[name]
    rows = form.rows(PHI, X, FIXED)
    assert np.allclose(form.rows(-3.7 * PHI, X, FIXED).values, rows.values, atol=1e-13)
    assert np.allclose(form.rows(2.0 * X, X, FIXED).values, 0.0, atol=1e-14)
    assert np.linalg.norm(rows.values) > 1e-3


def test_mac_form_is_the_published_one() -> None:
    mac = float((PHI @ X) ** 2 / ((PHI @ PHI) * (X @ X)))
    rows = FORMS["mac"].rows(PHI, X, FIXED)
    assert rows.values[0] == pytest.approx((1 - np.sqrt(mac)) / np.sqrt(mac))
    assert rows.weights[0] == pytest.approx(1 / np.sqrt(np.sum(FIXED**2)))


def test_an_entry_fixed_by_normalisation_is_no_row_and_has_no_weight() -> None:
    for name in ("scale", "difference"):
        rows = FORMS[name].rows(PHI, X, FIXED)
        assert 3 not in rows.entry and len(rows.values) == 6
        assert np.all(np.isfinite(rows.weights))
    # the difference form divides the model's shape as the measured one was
    others = [k for k in range(7) if k != 3]
    assert np.allclose(
        FORMS["difference"].rows(PHI, X, FIXED).values, PHI[others] * X[3] / PHI[3] - X[others]
    )


def test_rounding_of_zero_is_zero_and_all_zeros_are_refused() -> None:
    std = deviations(np.array([0.1, 1e-16, np.nan]), np.array([1.0, 1.0, -4.0]), 0.05, "here")
    assert np.allclose(std, [0.1, 0.0, 0.2])
    with pytest.raises(RecordingError, match="every deviation of its shape is 0"):
        deviations(np.zeros(3), np.ones(3), 0.05, "here")


def compared(form: str) -> ModalResidual:
    """The portal with an entry of each shape fixed by normalisation."""
    model = structure(portal(), PORTAL)[1]
    table = measured(model, TRUTH, [1, 2, 3, 4], channels=CHANNELS, noise=2, shape_std=0.03)
    top = np.argmax(np.abs(table.shapes), axis=1)
    shapes = table.shapes / table.shapes[np.arange(4), top][:, None]
    std = np.full(shapes.shape, 0.03)
    std[np.arange(4), top] = 0.0
    table = replace(table, shapes=shapes, shape_std=std)
    return replace(modal_residual(model, [table], [], True), form=form, shape_weight=0.7)


@pytest.mark.parametrize("form", FORMS)
def test_system_of_each_form_is_the_derivative_of_its_differences(form: str) -> None:
    r = compared(form)
    p = np.array([0.05, -0.03, 0.02, 0.04, 0.1, -0.05, 0.0])
    point = r.evaluate(p)
    A, h = point.system().A, 1e-5
    for j in range(len(p)):
        d = np.zeros(len(p))
        d[j] = h
        other = (
            r.evaluate(p + d, point).differences[0] - r.evaluate(p - d, point).differences[0]
        ) / (2 * h)
        size = np.abs(A).max(axis=1) + 1e-9
        assert np.all(np.abs(A[:, j] - other) <= 2e-5 * size)
    assert np.all(np.isfinite(point.differences[1]))


def test_shapes_alone_leave_the_eigenvalues_without_weight() -> None:
    r = compared("mac")
    point = replace(r, only_shapes=True).evaluate(TRUTH)
    assert np.all(point.differences[1][:4] == 0.0) and np.all(point.differences[1][4:] > 0.0)


def test_pairing_anew_takes_the_least_misfit() -> None:
    """Two partners exchanged on purpose: paired anew they are right again, and the objective is the
    lower."""
    r = compared("mac")
    right = r.evaluate(TRUTH)
    places = right.places[0][[1, 0, 2, 3]]
    wrong = replace(right, places=(places,))
    again = replace(r, repaired=True).evaluate(TRUTH, wrong)
    assert np.array_equal(again.places[0], right.places[0])
    assert np.sum((again.differences[0] * again.differences[1]) ** 2) < np.sum(
        (wrong.differences[0] * wrong.differences[1]) ** 2
    )
