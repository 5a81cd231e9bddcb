"""Pairing: optimal, order-free, honest about what it cannot pair."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate.correlate import mac, pair_frequencies, pair_modes
from cvxupdate.errors import InputError


@given(st.integers(0, 10_000))
@settings(max_examples=50, deadline=None)
def test_a_shuffled_scaled_subset_is_found_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    phi = np.linalg.qr(rng.standard_normal((12, 8)))[0]
    order = rng.permutation(8)[:5]
    measured = phi[:, order] * rng.standard_normal(5) * np.exp(1j * rng.uniform(0, 6, 5))
    pairs = pair_modes(phi, measured)
    assert np.array_equal(pairs.model, order) and np.array_equal(pairs.measured, np.arange(5))
    assert np.allclose(pairs.mac, 1.0)
    assert pairs.unpaired.size == 0 and set(pairs.unpaired_model) == set(range(8)) - set(
        order.tolist()
    )


@given(st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_the_assignment_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, x = rng.standard_normal((5, 4)), rng.standard_normal((5, 4))
    macs = mac(a, x)
    allowed = np.where(macs >= 0.3, macs, 0.0)
    best = max(sum(allowed[p[j], j] for j in range(4)) for p in itertools.permutations(range(4)))
    pairs = pair_modes(a, x, threshold=0.3)
    assert pairs.mac.sum() == pytest.approx(best)
    assert np.all(pairs.mac >= 0.3)


def test_greedy_pairing_would_lose_a_mode() -> None:
    def at(*degrees: float) -> np.ndarray:
        return np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])

    # MACs [[0.98, 0.82], [0.96, 0.50]]: the best single pair leaves the other two below the
    # threshold.
    pairs = pair_modes(at(0.0, 20.0), at(9.0, -25.0), threshold=0.6)
    assert pairs.model.tolist() == [1, 0] and pairs.unpaired.size == 0


def test_a_mode_below_the_threshold_stays_alone() -> None:
    a = np.eye(4)[:, :3]
    x = np.column_stack([np.eye(4)[:, 1], np.eye(4)[:, 3]])
    pairs = pair_modes(a, x, np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.5]))
    assert pairs.model.tolist() == [1] and pairs.measured.tolist() == [0]
    assert pairs.unpaired.tolist() == [1] and pairs.unpaired_model.tolist() == [0, 2]


def test_of_equal_shapes_the_nearer_frequency_wins() -> None:
    a = np.array([[1.0, 1.0], [1.0, 1.001]])
    x = np.array([[1.0], [1.001]])
    near = pair_modes(a, x, np.array([10.0, 90.0]), np.array([11.0]))
    assert near.model.tolist() == [0]
    assert pair_modes(
        a, x, np.array([10.0, 90.0]), np.array([11.0]), frequency_weight=0.0
    ).model.tolist() == [1]
    assert pair_modes(a, x, np.array([0.0, 90.0]), np.array([0.0])).model.tolist() == [0]


@given(st.integers(0, 10_000))
@settings(max_examples=50, deadline=None)
def test_pairing_by_frequency_does_not_depend_on_the_order(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fa, fx = rng.uniform(1, 100, 9), rng.uniform(1, 100, 6)
    std = rng.uniform(0.1, 2, 6)
    pa, px = rng.permutation(9), rng.permutation(6)
    first, second = pair_frequencies(fa, fx, std), pair_frequencies(fa[pa], fx[px], std[px])
    assert {(i, j) for i, j in zip(first.model, first.measured, strict=True)} == {
        (pa[i], px[j]) for i, j in zip(second.model, second.measured, strict=True)
    }
    assert len(first) == 6 and np.all(np.isnan(first.mac))


def test_pairing_by_frequency_skips_a_model_mode_that_was_not_measured() -> None:
    pairs = pair_frequencies(np.array([10.0, 20.0, 30.0, 40.0]), np.array([10.5, 29.0, 41.0]))
    assert pairs.model.tolist() == [0, 2, 3]
    limited = pair_frequencies(np.array([10.0, 20.0]), np.array([10.5, 29.0]), limit=0.1)
    assert limited.model.tolist() == [0] and limited.unpaired.tolist() == [1]


def test_bad_input_is_named() -> None:
    with pytest.raises(InputError, match="threshold"):
        pair_modes(np.eye(2), np.eye(2), threshold=2.0)
    with pytest.raises(InputError, match="one per column"):
        pair_modes(np.eye(2), np.eye(2), np.array([1.0]), np.array([1.0, 2.0]))
    with pytest.raises(InputError, match="std"):
        pair_frequencies(np.array([1.0]), np.array([1.0]), np.array([0.0]))
    with pytest.raises(InputError, match="finite"):
        pair_frequencies(np.array([np.nan]), np.array([1.0]))


def test_far_modes_that_few_sensors_take_for_near_ones_do_not_win() -> None:
    """Two sensors: the first mode and one twenty times as high look alike, and noise makes the far
    one a little liker."""
    a = np.array([[1.0, 1.0, 1.0], [0.50, -0.60, 0.52]])
    x = np.array([[1.0], [0.53]])
    found = pair_modes(a, x, np.array([10.0, 40.0, 210.0]), np.array([8.0]))
    assert found.model.tolist() == [0]
    alone = pair_modes(a, x, np.array([10.0, 40.0, 210.0]), np.array([8.0]), frequency_weight=0.0)
    assert alone.model.tolist() == [2]
