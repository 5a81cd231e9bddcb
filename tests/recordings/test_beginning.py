"""Records that begin in motion: told from those that begin at rest, and their FRFs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.beginning import beginning_of, settled
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory
from cvxupdate.spec import load_problem
from tests.cases.in_motion import STATE, history, receptances


@pytest.mark.parametrize("size", [0.3, 1.0, 5.0])
def test_a_record_that_begins_in_motion_gives_the_frfs_of_the_structure(size: float) -> None:
    run = history(tuple(size * x for x in STATE))
    frf = settled(run, None)
    assert isinstance(frf, FrequencyResponse) and "begins in motion (" in frf.origin.remarks[0]
    H = receptances(frf.frequency)
    gap, std = np.abs(frf.H[:, :, 0] - H), np.sqrt(frf.variance[:, :, 0])
    assert np.linalg.norm(gap) < 0.02 * np.linalg.norm(H)
    assert np.median(gap / std) < 2.0, "the deviations that are stated hold"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_record_from_rest_stays_what_it_is(seed: int) -> None:
    run = history(seed=seed)
    assert settled(run, None) is run
    found = beginning_of(run)
    assert found is not None and found.share < 0.1 and found.left < 0.005


def test_the_problem_file_may_say_it() -> None:
    run = history(STATE)
    assert settled(run, "at-rest") is run
    said = settled(history(), "in-motion")
    assert isinstance(said, FrequencyResponse)
    assert "as the problem file says" in said.origin.remarks[0]


def test_what_a_linear_structure_does_not_explain_is_only_said() -> None:
    run = history(STATE, noise=0.2)
    told = settled(run, None)
    assert isinstance(told, TimeHistory) and np.array_equal(told.data, run.data)
    assert "is taken as if it began at rest" in told.origin.remarks[0]


def test_several_quantities_come_as_one() -> None:
    run = history(STATE)
    velocity = np.cumsum(run.data[:, 1]) / run.rate
    channels = (run.channels[0], replace(run.channels[1], quantity="velocity"), *run.channels[2:])
    data = run.data.copy()
    data[:, 1] = velocity - velocity.mean()
    frf = settled(replace(run, channels=channels, data=data), "in-motion")
    assert isinstance(frf, FrequencyResponse) and frf.quantity == "acceleration"
    keep = (frf.frequency > 5.0) & (frf.frequency < 20.0)
    H = receptances(frf.frequency[keep])[:, 0]
    assert np.linalg.norm(frf.H[keep, 0, 0] - H) < 0.3 * np.linalg.norm(H)


def test_an_impact_is_not_taken_for_an_initial_state() -> None:
    run = history(noise=0.0)
    t = np.arange(len(run.data)) / run.rate
    decay = np.exp(-0.5 * t)[:, None] * np.sin(2.0 * np.pi * np.outer(t, [11.0, 25.0, 39.0]))
    data = np.column_stack([np.exp(-((200.0 * (t - 0.02)) ** 2)), decay])
    hit = replace(run, data=data)
    assert settled(hit, None) is hit
    sine = replace(
        run, data=np.column_stack([np.sin(60.0 * t), np.sin(60.0 * t + 1.0), decay[:, 1:]])
    )
    assert settled(sine, None) is sine


def test_what_comes_later_is_no_initial_state() -> None:
    """A free decay is there from the first sample: what follows a silence is something else."""
    run = history(STATE)
    quiet = np.random.default_rng(1).normal(size=(200, run.data.shape[1]))
    later = replace(run, data=np.vstack([1e-3 * np.std(run.data, axis=0) * quiet, run.data]))
    assert settled(later, None) is later
    found = beginning_of(later)
    assert found is not None and found.share < 0.1 < found.needed


def test_a_sweep_against_a_stop_begins_at_rest() -> None:
    """80 ms of silence, then a sweep from below the band; the stop is what no force explains."""
    spec = load_problem(Path(__file__).parents[2] / "problems/strange/n2_clearance/problem.toml")
    runs = load_recordings(spec)
    assert len(runs) == 3 and not any(r.origin.remarks for r in runs)
    assert all(isinstance(r, TimeHistory) for r in runs)


def test_what_cannot_be_estimated_is_refused() -> None:
    run = history(STATE)
    with pytest.raises(RecordingError, match="has no force or no motion"):
        settled(replace(run, channels=run.channels[1:], data=run.data[:, 1:]), "in-motion")
    with pytest.raises(RecordingError, match="it begins in motion: .* lines in the band"):
        settled(replace(run, data=run.data[:40]), "in-motion")
    assert beginning_of(replace(run, channels=run.channels[1:], data=run.data[:, 1:])) is None
    assert beginning_of(replace(run, data=run.data[:40])) is None
