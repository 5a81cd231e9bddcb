"""Sensor places: what they maximise, and what the report says of bad ones."""

import itertools
import json

import numpy as np
import pytest

from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction import effective_independence, qr_places, visibility


def information(phi, rows):
    return np.linalg.slogdet(phi[rows].T @ phi[rows])[1]


def test_effective_independence_is_near_the_best_of_all_choices():
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(10):
        phi = rng.standard_normal((11, 3))
        best = max(information(phi, list(c)) for c in itertools.combinations(range(11), 4))
        ratios.append(information(phi, effective_independence(phi, 4)) - best)
    assert max(ratios) <= 1e-9 and np.mean(ratios) > -0.3


def test_one_deletion_is_the_best_deletion_and_downdates_agree(beam):
    phi = beam.phi[:, :5]
    rows = effective_independence(phi, beam.size - 1)
    gone = np.setdiff1d(np.arange(beam.size), rows)[0]
    all_ = [information(phi, np.delete(np.arange(beam.size), i)) for i in range(beam.size)]
    assert np.argmax(all_) == gone
    left = np.arange(beam.size)
    while left.size > 5:  # textbook: the projector anew at every deletion
        share = np.sum(np.linalg.qr(phi[left])[0] ** 2, axis=1)
        left = np.delete(left, np.argmin(share))
    assert np.array_equal(effective_independence(phi, 5), left)


@pytest.mark.parametrize("choose", [effective_independence, qr_places])
def test_places_beat_random_ones_and_do_not_depend_on_scale(beam, choose):
    phi = beam.phi[:, :5]
    translations = np.arange(0, beam.size, 2)
    rows = choose(phi, 8, translations)
    assert set(rows.tolist()) <= set(translations.tolist()) and np.unique(rows).size == 8
    rng = np.random.default_rng(1)
    random = [information(phi, rng.choice(translations, 8, replace=False)) for _ in range(200)]
    assert information(phi, rows) > np.quantile(random, 0.95)
    assert set(choose(phi * np.array([1e-6, 5.0, 1.0, 1e4, 3.0]), 8, translations)) == set(rows)


def test_visibility_of_everything_is_perfect_and_bad_places_are_named(beam):
    phi = beam.phi[:, :4]
    Q = np.linalg.qr(phi)[0]
    full = visibility(Q, np.arange(beam.size))
    assert (
        full.condition == pytest.approx(1.0)
        and full.rank == 4
        and np.allclose(full.independence, 1.0)
    )
    assert (
        full.confused == ()
        and full.hidden.size == 0
        and np.allclose(full.alike, np.eye(4), atol=1e-12)
    )

    poor = visibility(
        phi, np.array([0, 2]), compared=np.arange(0, beam.size, 2)
    )  # two places near the clamp
    assert poor.rank == 2 and np.isinf(poor.condition)
    assert (
        0 in poor.hidden
        and len(poor.confused) > 0
        and np.allclose(poor.independence, 0.0, atol=1e-6)
    )
    words = " ".join(poor.says())
    assert "Mode 1 hardly moves" in words and "look alike" in words and "impossible" in words
    assert json.loads(json.dumps(poor.to_json()))["condition"] is None


def test_independence_is_the_noise_gain(beam):
    phi = beam.phi[:, :4]
    rows = np.array([4, 8, 12, 20, 30])
    seen = visibility(phi, rows)
    unit = phi[rows] / np.linalg.norm(phi[rows], axis=0)
    assert np.allclose(1 / seen.independence**2, np.diag(np.linalg.inv(unit.T @ unit)))


def test_impossible_requests_are_named(beam):
    phi = beam.phi[:, :4]
    for choose in (effective_independence, qr_places):
        with pytest.raises(InputError, match="at least the 4 modes"):
            choose(phi, 3)
        with pytest.raises(ModelError, match="cannot distinguish the modes"):
            choose(np.repeat(phi[:, :1], 4, axis=1), 6)
        with pytest.raises(InputError, match="real shapes"):
            choose(phi * 1j, 6)
