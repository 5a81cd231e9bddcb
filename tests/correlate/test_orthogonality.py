"""Orthogonality checks with a mass matrix, with an improved one, and without any."""

import numpy as np
import pytest

from cvxupdate.correlate import (
    cross_orthogonality,
    improved_mass,
    mac,
    mass_orthogonality,
    off_diagonal,
    pseudo_orthogonality,
    reciprocal_vectors,
    reduced_pseudo_orthogonality,
    weighted_mac,
)
from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction import serep

SENSORS = np.array([7, 19, 22, 28, 37, 40, 43, 46, 48, 51])


def noisy(phi, seed=0, level=0.05):
    rng = np.random.default_rng(seed)
    return phi + level * np.abs(phi).max() * rng.standard_normal(phi.shape)


def test_the_models_own_modes_are_orthogonal(frame):
    phi = frame.phi[:, :6]
    assert np.allclose(mass_orthogonality(phi * np.arange(1, 7), frame.M), np.eye(6), atol=1e-9)
    assert np.allclose(cross_orthogonality(phi, frame.M, phi * 1j), 1j * np.eye(6), atol=1e-9)
    assert off_diagonal(mass_orthogonality(noisy(phi), frame.M)) > 0.01
    assert np.allclose(np.diag(mass_orthogonality(noisy(phi), frame.M)), 1.0)
    assert np.all(weighted_mac(phi, noisy(phi), frame.M) <= 1 + 1e-12)


def test_weighted_mac_with_unit_mass_is_mac(frame):
    a, x = frame.phi[:, :4], noisy(frame.phi[:, :4])
    assert np.allclose(weighted_mac(a, x, np.eye(frame.size)), mac(a, x))


def test_improved_mass_makes_measured_modes_orthonormal_and_changes_nothing_else(frame):
    x = noisy(frame.phi[:, :5])
    MI = improved_mass(frame.M, x)
    assert np.allclose(mass_orthogonality(x, MI), np.eye(5), atol=1e-9)
    dense = MI @ np.eye(frame.size)
    assert np.allclose(dense, dense.T)
    # A vector that M makes orthogonal to the measured modes has the mass it had.
    v = np.random.default_rng(1).standard_normal(frame.size)
    v -= x @ np.linalg.solve(x.T @ (frame.M @ x), x.T @ (frame.M @ v))
    assert v @ (MI @ v) == pytest.approx(v @ (frame.M @ v))
    assert np.allclose(improved_mass(frame.M, frame.phi[:, :5]) @ v, frame.M @ v)
    with pytest.raises(ModelError, match="not independent"):
        improved_mass(frame.M, np.column_stack([x, x[:, 0]]))


def test_the_four_pseudo_orthogonality_checks(frame):
    a = frame.phi[:, :5]
    perfect = pseudo_orthogonality(a, a * 3.0, frame.M)
    assert np.allclose(perfect.raw, 3 * np.eye(5), atol=1e-9)
    for check in (perfect.normalised, perfect.normalised_improved):
        assert np.allclose(check, np.eye(5), atol=1e-9)
    x = noisy(a) * np.array([1.0, 4.0, 0.1, 2.0, 7.0])
    some = pseudo_orthogonality(a, x, frame.M)
    assert np.allclose(some.raw, np.diag(np.sqrt(np.diag(x.T @ (frame.M @ x)))) @ some.normalised)
    # Scored by the mass that they themselves improved, the measured vectors lean to themselves: ε₄
    # = E⁻¹ ε₃.
    E = mass_orthogonality(x, frame.M)
    assert np.allclose(some.normalised_improved, np.linalg.solve(E, some.normalised), atol=1e-8)


def test_reduced_pseudo_orthogonality_equals_the_full_one_without_a_mass_matrix(frame):
    """O'Callahan (1995): full space with expanded shapes, reduced mass at the sensors, and no mass
    at all: one number."""
    a = frame.phi[:, :6]
    x = noisy(a)[SENSORS][:, :4]
    T = serep(a, SENSORS)
    short = reduced_pseudo_orthogonality(a[SENSORS], x)
    full = a.T @ (frame.M @ T.expand(x))
    at_sensors = a[SENSORS].T @ T.reduce(frame.M) @ x
    assert np.allclose(short, full, atol=1e-10 * np.abs(full).max())
    assert np.allclose(short, at_sensors, atol=1e-10 * np.abs(full).max())
    gap = x.copy()
    gap[3, 1] = np.nan
    rows = np.delete(np.arange(10), 3)
    assert np.allclose(
        reduced_pseudo_orthogonality(a[SENSORS], gap)[:, 1],
        np.linalg.pinv(a[SENSORS[rows]]) @ x[rows, 1],
    )
    with pytest.raises(InputError, match="keep fewer"):
        reduced_pseudo_orthogonality(frame.phi[SENSORS[:3]][:, :4], x[:3])


def frf(frame, sensors, references, lines, eta):
    omega2 = (2 * np.pi * lines) ** 2
    value = (2 * np.pi * frame.frequency) ** 2
    modal = 1 / (value[None, :] * (1 + 1j * eta) - omega2[:, None])
    return np.einsum(
        "ir,lr,jr->lij", frame.phi[sensors], modal, frame.phi[references]
    )  # all flexible modes


def test_reciprocal_vectors_from_frfs_alone(frame):
    """Right shapes are orthogonal to them, with structural damping, for any reference; one wrong
    shape shows by itself."""
    lines = np.linspace(20, 300, 400)
    eta = 0.01
    H = frf(frame, SENSORS, SENSORS[[0, 4]], lines, eta)
    phi, f = frame.phi[SENSORS][:, :5], frame.frequency[:5]
    loss = np.full(5, eta)
    good = reciprocal_vectors(lines, H, phi, f, loss)
    assert np.allclose(good.orthogonality, np.eye(5), atol=0.02)
    assert np.all(good.fit < 0.02)
    assert np.allclose(np.sum(good.vectors * phi, axis=0), 1.0)
    accelerance = -((2 * np.pi * lines) ** 2)[:, None, None] * H
    same = reciprocal_vectors(lines, accelerance, phi, f, loss, quantity="acceleration")
    assert np.allclose(same.orthogonality, good.orthogonality, atol=1e-6)
    one = reciprocal_vectors(lines, H[:, :, 0], phi, f, loss)
    assert np.allclose(one.orthogonality, np.eye(5), atol=0.05)

    wrong = phi.copy()
    wrong[:, 2] += 0.4 * np.linalg.norm(phi[:, 2]) / np.linalg.norm(phi[:, 4]) * phi[:, 4]
    seen = reciprocal_vectors(lines, H, wrong, f, loss)
    rest = seen.orthogonality - np.eye(5)
    worst = np.unravel_index(np.argmax(np.abs(rest)), rest.shape)
    assert worst == (4, 2) and rest[4, 2] > 0.3
    without = reciprocal_vectors(
        lines, H, phi, f
    )  # Imregun & Ewins's point: leaving the damping out costs
    assert np.all(without.fit > 3 * good.fit)


def test_reciprocal_vectors_with_noise(frame):
    lines = np.linspace(20, 300, 400)
    H = frf(frame, SENSORS, SENSORS[[0, 4]], lines, 0.01)
    rng = np.random.default_rng(0)
    H = H * (1 + 0.01 * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)))
    out = reciprocal_vectors(
        lines, H, frame.phi[SENSORS][:, :5], frame.frequency[:5], np.full(5, 0.01), rcond=1e-3
    )
    assert off_diagonal(out.orthogonality) < 0.1


def test_bad_input_is_named(frame):
    with pytest.raises(InputError, match="reduce M to the measured"):
        mass_orthogonality(frame.phi[:5, :2], frame.M)
    with pytest.raises(InputError, match="NaN"):
        mass_orthogonality(np.full((frame.size, 1), np.nan), frame.M)
    with pytest.raises(ModelError, match="not positive"):
        mass_orthogonality(np.zeros((frame.size, 1)), frame.M)
    with pytest.raises(InputError, match="quantity"):
        reciprocal_vectors(
            np.ones(3), np.ones((3, 2)), np.ones((2, 1)), np.ones(1), quantity="strain"
        )
    with pytest.raises(InputError, match="do not agree"):
        reciprocal_vectors(np.ones(3), np.ones((3, 2)), np.ones((4, 1)), np.ones(1))
