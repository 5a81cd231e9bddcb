"""Energies sum, forces balance, and both point at the one element that is wrong."""

import numpy as np
import pytest

from cvxupdate.correlate import (
    balance_map,
    element_balance,
    element_energies,
    element_energy_fractions,
    energy_comparison,
    energy_map,
    force_balance,
    modal_scale_factor,
    static_balance,
)
from cvxupdate.correlate.elements import ElementBatch
from cvxupdate.errors import InputError
from cvxupdate.reduction import dynamic, partition, serep

SENSORS = np.array(
    [7, 19, 22, 28, 37, 40, 43, 46, 48, 51]
)  # ten translations, by effective independence of 7 modes
MODES = 5


def test_element_energies_sum_to_the_models(frame):
    phi = frame.phi[:, :6]
    for name, A in (("K", frame.K), ("M", frame.M)):
        assert np.allclose(
            element_energies(frame.batches, phi, name).sum(axis=0),
            0.5 * np.sum(phi * (A @ phi), axis=0),
        )
        assert np.allclose(element_energy_fractions(frame.batches, phi * 1j, name).sum(axis=0), 1.0)


def test_potential_is_kinetic_energy_at_a_natural_frequency(frame):
    phi = frame.phi[:, :6]
    e = energy_comparison(frame.K, frame.M, phi, 1.1 * phi)
    omega2 = (2 * np.pi * frame.frequency[:6]) ** 2
    assert np.allclose(e.potential_model, omega2 * e.kinetic_model, rtol=1e-8)
    assert np.allclose(e.kinetic_difference, 0.21 * e.kinetic_model) and np.allclose(
        e.kinetic_model, 0.5
    )
    assert np.allclose(e.potential_difference, 0.21 * e.potential_model)
    assert np.allclose(e.rayleigh_frequency, frame.frequency[:6])


def test_rayleigh_bounds_the_first_frequency(frame):
    rng = np.random.default_rng(0)
    x = frame.phi[:, :1] + 0.01 * np.abs(frame.phi[:, :1]).max() * rng.standard_normal(
        (frame.size, 1)
    )
    flexible = frame.phi @ (frame.phi.T @ (frame.M @ x))  # without the rigid-body part
    assert (
        energy_comparison(frame.K, frame.M, flexible, flexible).rayleigh_frequency[0]
        >= frame.frequency[0]
    )


def test_the_model_is_in_balance_with_itself(frame):
    phi, f = frame.phi[:, :MODES], frame.frequency[:MODES]
    force = force_balance(frame.K, frame.M, phi, f)
    assert np.abs(force).max() < 1e-7 * np.abs(frame.K @ phi).max()
    assert balance_map(frame.K, frame.M, phi, f).max() < 1e-6
    assert element_balance(frame.batches, frame.K, frame.M, phi, f).imbalance < 1e-6


@pytest.mark.parametrize(("element", "change"), [(2, -0.3), (9, 0.4), (13, -0.1), (19, -0.5)])
def test_a_changed_stiffness_is_found_exactly_with_complete_shapes(
    frame, frame_maker, element, change
):
    x = frame_maker(stiffness={element: change})
    phi, f = x.phi[:, :MODES] * np.array([1, -3, 0.2, 5, 1j]), x.frequency[:MODES]
    found = element_balance(frame.batches, frame.K, frame.M, phi, f)
    assert np.argmax(found.stiffness) == element
    assert found.stiffness[element] == pytest.approx(1.0, abs=1e-6)
    assert found.stiffness_change[element] == pytest.approx(change, rel=1e-5)
    dofs = np.concatenate([b.dofs for b in frame.batches])[element]
    where = balance_map(frame.K, frame.M, phi, f)
    assert np.argmax(where) in dofs
    others = np.setdiff1d(np.arange(frame.size), dofs)
    assert where[others].max() < 1e-3 * where[dofs].max()


def test_a_changed_mass_is_found_too_and_not_taken_for_stiffness(frame, frame_maker):
    x = frame_maker(mass={6: 0.5})
    found = element_balance(frame.batches, frame.K, frame.M, x.phi[:, :MODES], x.frequency[:MODES])
    assert np.argmax(found.mass) == 6 and found.mass[6] == pytest.approx(1.0, abs=1e-6)
    assert found.mass_change[6] == pytest.approx(0.5, rel=1e-5)
    assert found.stiffness.max() < 0.9


def test_every_element_is_found_with_complete_shapes_by_the_energy_map(frame, frame_maker):
    hits = 0
    for e in range(20):
        x = frame_maker(stiffness={e: -0.3})
        hits += int(
            np.argmax(energy_map(frame.batches, frame.phi[:, :MODES], x.phi[:, :MODES])) == e
        )
    assert hits == 20


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_nearly_every_element_is_found_with_ten_sensors(frame, frame_maker, noise):
    """Condensed force balance, dynamic expansion at each measured frequency, five modes, 1 % noise
    on the shapes."""
    rng = np.random.default_rng(0)
    split = partition(frame.K, frame.M, SENSORS)
    hits = 0
    for e in range(20):
        x = frame_maker(stiffness={e: -0.3})
        f = x.frequency[:MODES]
        seen = x.phi[SENSORS][:, :MODES] * (1 + noise * rng.standard_normal((10, MODES)))
        found = element_balance(
            frame.batches, frame.K, frame.M, seen, f, [dynamic(split, v) for v in f]
        )
        hits += int(np.argmax(found.stiffness) == e)
    assert hits >= 19 - 2 * (noise > 0)


def test_the_energy_map_with_ten_sensors_has_the_element_among_its_first_three(frame, frame_maker):
    """SEREP from eight modes smooths the jump of deformation, so the map is blunter than the force
    balance."""
    T = serep(frame.phi[:, :8], SENSORS)
    places = []
    for e in range(20):
        x = frame_maker(stiffness={e: -0.3})
        found = energy_map(frame.batches, frame.phi[:, :MODES], T.expand(x.phi[SENSORS][:, :MODES]))
        places.append(int(np.sum(found > found[e])) + 1)
    assert sum(p == 1 for p in places) >= 12 and sum(p <= 3 for p in places) >= 19


def test_static_balance_shows_forces_where_shapes_hardly_differ(frame, frame_maker):
    x = frame_maker(stiffness={9: -0.3})
    a, b = frame.phi[:, :1], x.phi[:, :1]
    b = b / modal_scale_factor(a, b)
    fa, fb = static_balance(frame.K, a, b)
    assert np.allclose(fa, frame.K @ a) and np.allclose(fb, frame.K @ b)
    dofs = np.concatenate([e.dofs for e in frame.batches])[9]
    assert np.argmax(np.abs(fa - fb)[:, 0] / np.sqrt(frame.K.diagonal())) in dofs


def test_supported_dofs_are_left_out():
    k = np.array([[[2.0, -2.0], [-2.0, 2.0]], [[3.0, -3.0], [-3.0, 3.0]]])
    batch = ElementBatch(np.array([[-1, 0], [0, 1]]), k)
    K = np.array([[5.0, -3.0], [-3.0, 3.0]])
    phi = np.array([[1.0], [-2.0]])
    assert element_energies([batch], phi).sum() == pytest.approx(0.5 * (phi.T @ K @ phi).item())
    with pytest.raises(InputError, match="no mass"):
        element_energies([batch], phi, "M")
    with pytest.raises(InputError, match="need matrices"):
        ElementBatch(np.array([[0, 1]]), k)


def test_bad_input_is_named(frame):
    with pytest.raises(InputError, match="expand incomplete shapes"):
        force_balance(frame.K, frame.M, frame.phi[:5, :2], frame.frequency[:2])
    gap = frame.phi[:, :2].copy()
    gap[0, 0] = np.nan
    with pytest.raises(InputError, match="gaps"):
        energy_comparison(frame.K, frame.M, gap, gap)
    split = partition(frame.K, frame.M, SENSORS)
    with pytest.raises(InputError, match="one each"):
        element_balance(
            frame.batches,
            frame.K,
            frame.M,
            frame.phi[SENSORS][:, :2],
            frame.frequency[:2],
            [dynamic(split, 5.0)],
        )
