"""A recording as the one signal that it holds, sharp or smoothed."""

from __future__ import annotations

from cvxupdate.diagnose.responses.data import signals_of
from cvxupdate.diagnose.responses.signals import Signal, smoothed
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory


def signal_of(recording: FrequencyResponse | TimeHistory, epsilon: float = 0.0) -> Signal:
    """Under Poisson's kernel of half-width ``epsilon`` f; 0 leaves the lines as they are."""
    (sharp,) = signals_of(recording)
    return smoothed(sharp, epsilon) if epsilon > 0.0 else sharp
