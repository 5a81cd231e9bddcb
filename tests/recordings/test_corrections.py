"""Faults of channels taken out: what the sound channels recorded comes back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.corrections import corrected
from cvxupdate.recordings.types import Channel, FrequencyResponse, ModeTable, Origin, TimeHistory
from cvxupdate.spec.recordings import ChannelName, CorrectionRow

RNG = np.random.default_rng(3)
CHANNELS = (
    Channel(1, "x", "force"),
    Channel(1, "x", "acceleration"),
    Channel(2, "y", "acceleration"),
)
LINES = np.arange(1.0, 40.0)
GAIN, LATE = CorrectionRow(node=2, dof="y", gain=-0.6), CorrectionRow(node=2, dof="y", delay=3.7e-3)
SWAP = CorrectionRow(node=1, dof="x", exchanged_with=ChannelName(node=2, dof="y"))


def frf() -> FrequencyResponse:
    H = RNG.normal(size=(len(LINES), 2, 1)) + 1j * RNG.normal(size=(len(LINES), 2, 1))
    return FrequencyResponse(
        Origin("a", "a.npz"),
        LINES,
        H,
        "acceleration",
        CHANNELS[1:],
        (CHANNELS[0],),
        np.abs(H) ** 2 * 1e-4,
    )


def history(delay: float = 0.0) -> TimeHistory:
    """Smooth pulses at rest at both ends, sampled at 1 kHz; the last channel comes late."""
    t = np.arange(2000) / 1000.0
    pulse = [
        np.exp(-(((t - at) / 0.02) ** 2)) * np.sin(2 * np.pi * f * t)
        for at, f in ((0.5, 30.0), (0.6, 41.0))
    ]
    shifted = np.exp(-(((t - delay - 0.8) / 0.02) ** 2)) * np.sin(2 * np.pi * 37.0 * (t - delay))
    return TimeHistory(Origin("b", "b.npz"), 1000.0, CHANNELS, np.column_stack([*pulse, shifted]))


def test_gain_and_delay_of_an_frf() -> None:
    sound = frf()
    H = sound.H.copy()
    H[:, 1] *= -0.6 * np.exp(-2j * np.pi * LINES * 3.7e-3)[:, None]
    wrong = replace(sound, H=H, variance=sound.variance * np.array([1.0, 0.36])[:, None])  # type: ignore[operator]
    found = corrected(wrong, [GAIN, LATE])
    np.testing.assert_allclose(found.H, sound.H, rtol=1e-12)  # type: ignore[union-attr]
    np.testing.assert_allclose(found.variance, sound.variance, rtol=1e-12)  # type: ignore[union-attr,arg-type]


def test_the_gain_of_a_force_is_taken_out_of_all_its_responses() -> None:
    """What a force channel reads too low, responses to it are too large by."""
    low = CorrectionRow(node=1, dof="x", quantity="force", gain=0.8)
    sound = frf()
    read = replace(sound, H=sound.H / 0.8, variance=sound.variance / 0.8**2)
    again = corrected(read, [low])
    np.testing.assert_allclose(again.H, sound.H)
    np.testing.assert_allclose(again.variance, sound.variance)
    run = history()
    data = run.data.copy()
    data[:, 0] *= 0.8
    again_run = corrected(replace(run, data=data), [low])
    np.testing.assert_allclose(again_run.data, run.data, atol=1e-15)
    with pytest.raises(RecordingError, match="no force channel n2"):
        corrected(run, [CorrectionRow(node=2, dof="y", quantity="force", gain=0.8)])


def test_gain_and_delay_of_a_time_history() -> None:
    late = history(3.7e-3)
    wrong = replace(late, data=late.data * [1.0, 1.0, -0.6])
    np.testing.assert_allclose(corrected(wrong, [GAIN, LATE]).data, history().data, atol=1e-9)  # type: ignore[union-attr]


def test_exchanged_channels_get_each_others_labels() -> None:
    """The force at the same place is no response and stays where it is."""
    found = corrected(history(), [SWAP])
    assert [(c.label, c.quantity) for c in found.channels] == [
        ("n1.x", "force"),
        ("n2.y", "acceleration"),
        ("n1.x", "acceleration"),
    ]  # type: ignore[union-attr]
    responses = corrected(frf(), [SWAP])
    assert [c.label for c in responses.responses] == ["n2.y", "n1.x"]  # type: ignore[union-attr]


def test_the_order_counts() -> None:
    """After the exchange the gain is that of the other column."""
    sound = frf()
    one, other = (corrected(sound, order) for order in ([SWAP, GAIN], [GAIN, SWAP]))
    assert np.abs(one.H / other.H)[0, :, 0] == pytest.approx([1 / 0.6, 0.6])  # type: ignore[union-attr]


def test_shapes_of_a_mode_table() -> None:
    table = ModeTable(
        Origin("c", "c"),
        np.ones(1),
        np.ones(1),
        np.ones(1),
        np.ones(1),
        CHANNELS[1:],
        np.array([[0.4, -0.6]]),
        np.array([[0.01, 0.02]]),
        np.zeros(1, dtype=np.int64),
    )
    found = corrected(table, [GAIN])
    np.testing.assert_allclose(found.shapes, [[0.4, 1.0]])  # type: ignore[union-attr,arg-type]
    np.testing.assert_allclose(found.shape_std, [[0.01, 0.02 / 0.6]])  # type: ignore[union-attr,arg-type]
    assert corrected(replace(table, shapes=None), [GAIN]).shapes is None  # type: ignore[union-attr]


def test_a_channel_that_is_not_there_is_said() -> None:
    with pytest.raises(
        RecordingError,
        match=r"b\.npz: corrections: there is no response channel n9\.z\. It has n1\.x, n2\.y",
    ):
        corrected(history(), [CorrectionRow(node=9, dof="z", gain=2.0)])
