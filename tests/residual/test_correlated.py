"""Rows weighed by a full covariance: what it comes to where it is diagonal, derivatives, what no
scale of a shape may change, and chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import modal_residual
from cvxupdate.residual.modal_point import ModalPoint, ModalResidual
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")
MODEL = structure(portal(), PORTAL)[1]
P = 0.4 * TRUTH
FORMS = ("scale", "difference")


def with_covariance(table: ModeTable, C: np.ndarray) -> ModeTable:
    n, std = len(table.frequency), np.sqrt(np.diag(C))
    assert table.shapes is not None
    spread = std[n:].reshape(table.shapes.shape) if len(C) > n else table.shape_std
    return replace(table, covariance=C, frequency_std=std[:n], shape_std=spread)


def diagonal(table: ModeTable) -> np.ndarray:
    assert table.shapes is not None and table.shape_std is not None
    spread = np.broadcast_to(table.shape_std, table.shapes.shape)
    return np.diag(np.concatenate([table.frequency_std, spread.ravel()]) ** 2)


def full(table: ModeTable, seed: int = 3) -> np.ndarray:
    """Correlations of every entry with every other."""
    std = np.sqrt(np.diag(diagonal(table)))
    root = np.random.default_rng(seed).standard_normal((len(std), len(std) + 4))
    R = root @ root.T
    d = np.sqrt(np.diag(R))
    return R / np.outer(d, d) * np.outer(std, std)


def table_of(noise: int | None = 7) -> ModeTable:
    return measured(MODEL, TRUTH, [1, 2, 4], channels=CHANNELS, noise=noise, shape_std=0.02)


def residual_of(table: ModeTable, form: str) -> ModalResidual:
    return replace(modal_residual(MODEL, [table], [], True), form=form, correlated=True)


def chi2(point: ModalPoint) -> float:
    values, weights, _ = point.differences
    return float(np.sum((weights * values) ** 2))


@pytest.mark.parametrize("form", FORMS)
def test_a_diagonal_covariance_is_its_deviations(form: str) -> None:
    table = table_of()
    assert table.shapes is not None and table.shape_std is not None
    spread = np.array(np.broadcast_to(table.shape_std, table.shapes.shape))
    # else the difference form takes the largest entry for known, and a covariance does not
    spread[np.arange(3), np.abs(table.shapes).argmax(axis=1)] = 0.0
    table = replace(table, shape_std=spread)
    plain = residual_of(table, form).evaluate(P)
    joint = residual_of(with_covariance(table, diagonal(table)), form).evaluate(P)
    assert chi2(joint) == pytest.approx(chi2(plain), rel=1e-10)
    one, other = (q.system().weighted() for q in (plain, joint))
    np.testing.assert_allclose(other[0].T @ other[0], one[0].T @ one[0], rtol=1e-8, atol=1e-6)
    gradients = [A.T @ (A @ P - b) for A, b in (one, other)]
    np.testing.assert_allclose(gradients[1], gradients[0], rtol=1e-7, atol=1e-6)


def test_a_covariance_of_the_frequencies_leaves_the_shapes_alone() -> None:
    table = table_of()
    C = np.diag(table.frequency_std**2)
    for form in (*FORMS, "mac"):
        plain, joint = (
            residual_of(t, form).evaluate(P) for t in (table, with_covariance(table, C))
        )
        assert chi2(joint) == pytest.approx(chi2(plain), rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_derivatives_are_those_of_the_rows(form: str) -> None:
    table = table_of()
    residual = residual_of(with_covariance(table, full(table)), form)
    A, h = residual.evaluate(P).system().weighted()[0], 1e-5
    for j in range(len(P) - 1):  # the last is a dashpot
        d = np.zeros(len(P))
        d[j] = h
        up, down = (np.multiply(*residual.evaluate(p).differences[:2]) for p in (P + d, P - d))
        np.testing.assert_allclose(A[:, j], (up - down) / (2 * h), atol=2e-6 * np.abs(A).max())


def test_the_least_over_every_scale_of_every_shape() -> None:
    """The form "scale" against the minimum over the three scales by generalised least squares."""
    table = table_of()
    C = full(table)
    point = residual_of(with_covariance(table, C), "scale").evaluate(P)
    assert table.shapes is not None
    n, at = 3, [MODEL.place[c] for c in CHANNELS]
    f, phi = point.modes.frequencies, point.modes.shapes
    rate = 8 * np.pi**2 * table.frequency
    y = np.concatenate(
        [-((2 * np.pi) ** 2) * (f[point.places[0]] ** 2 - table.frequency**2), table.shapes.ravel()]
    )
    F = np.zeros((len(y), n))
    for i, k in enumerate(point.places[0]):
        F[n + 6 * i : n + 6 * (i + 1), i] = phi[at, k]
    scale = np.concatenate([rate, np.ones(18)])
    W = np.linalg.inv(C * np.outer(scale, scale))
    q = np.linalg.solve(F.T @ W @ F, F.T @ W @ y)
    rest = y - F @ q
    assert chi2(point) == pytest.approx(rest @ W @ rest, rel=1e-8)


def test_errors_of_the_scale_alone_change_nothing() -> None:
    """Entries that are normalised by the one held: an error along the shape itself is none."""
    table = table_of()
    C, wide = full(table), full(table)
    assert table.shapes is not None
    for i, x in enumerate(table.shapes):
        at = slice(3 + 6 * i, 9 + 6 * i)
        wide[at, at] += 0.5 * np.outer(x, x)
    one, other = (
        chi2(residual_of(with_covariance(table, V), "difference").evaluate(P)) for V in (C, wide)
    )
    assert other == pytest.approx(one, rel=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_the_unit_of_a_shape_does_not_count(form: str) -> None:
    table = table_of()
    assert table.shapes is not None
    C, factor = full(table), np.concatenate([np.ones(3), np.repeat([4.0, -0.3, 25.0], 6)])
    turned = replace(table, shapes=table.shapes * factor[3:].reshape(3, 6))
    one = residual_of(with_covariance(table, C), form).evaluate(P)
    other = residual_of(with_covariance(turned, C * np.outer(factor, factor)), form).evaluate(P)
    assert chi2(other) == pytest.approx(chi2(one), rel=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_errors_of_that_covariance_leave_what_chance_does(form: str) -> None:
    """At the truth χ² has the mean of its degrees of freedom: 3 frequencies and 5 ratios of each
    shape; by the deviations alone it has not."""
    table = table_of(None)
    assert table.shapes is not None
    C = 0.01 * full(table)
    L, rng = np.linalg.cholesky(C), np.random.default_rng(11)
    joint, alone = [], []
    for _ in range(300):
        e = L @ rng.standard_normal(len(C))
        noisy = replace(
            table, frequency=table.frequency + e[:3], shapes=table.shapes + e[3:].reshape(3, 6)
        )
        point = residual_of(with_covariance(noisy, C), form).evaluate(TRUTH)
        joint.append(chi2(point))
        plain = replace(point.residual, correlated=False)
        alone.append(chi2(replace(point, residual=plain)))
    assert np.mean(joint) == pytest.approx(18.0, abs=4.0 * np.sqrt(2 * 18.0 / 300))
    assert np.var(alone) > 1.5 * np.var(joint)


@pytest.mark.parametrize("form", FORMS)
def test_shapes_of_unit_length_have_no_error_along_themselves(form: str) -> None:
    table = table_of()
    assert table.shapes is not None
    shapes = table.shapes / np.linalg.norm(table.shapes, axis=1, keepdims=True)
    table = replace(table, shapes=shapes, shape_std=np.full(shapes.shape, 0.01))
    C = full(table)
    N = np.eye(len(C))
    for i, x in enumerate(shapes):
        at = slice(3 + 6 * i, 9 + 6 * i)
        N[at, at] -= np.outer(x, x)
    singular = N @ C @ N.T
    assert np.linalg.eigvalsh(singular)[2] < 1e-12 * np.abs(singular).max()
    found = residual_of(with_covariance(table, singular), form).evaluate(P)
    free = residual_of(with_covariance(table, C), form).evaluate(P)
    assert np.all(np.isfinite(found.system().A))
    # the difference form knows no scale at all, the other to first order
    assert chi2(found) == pytest.approx(chi2(free), rel=1e-7 if form == "difference" else 0.2)


def test_what_is_known_exactly_is_refused() -> None:
    """A covariance of fewer repeats than figures."""
    table = table_of()
    few = np.linalg.cholesky(full(table)) @ np.random.default_rng(0).standard_normal((21, 6))
    C = few @ few.T / 5
    with pytest.raises(RecordingError, match=r"combination of the 21 figures.*fewer repeats"):
        assert residual_of(with_covariance(table, C), "scale").evaluate(P).differences


def test_only_what_is_compared_counts() -> None:
    """A shape's missing entry takes its rows of the covariance with it: the marginal one."""
    table = table_of()
    assert table.shapes is not None
    C, shapes = full(table), table.shapes.copy()
    shapes[1, 2] = np.nan
    gap = with_covariance(replace(table, shapes=shapes), C)
    system = residual_of(gap, "scale").evaluate(P).system()
    assert len(system.rows) == 20
    keep = np.delete(np.arange(21), 3 + 6 + 2)
    wanted = np.linalg.cholesky(C[np.ix_(keep, keep)])
    joint = residual_of(gap, "scale").evaluate(P).joints[0]
    rate = np.concatenate([8 * np.pi**2 * table.frequency, np.ones(17)])
    np.testing.assert_allclose(
        joint.lower @ joint.lower.T, (wanted @ wanted.T) * np.outer(rate, rate)
    )
