"""The error of the responses: one figure for a model and a recording, in every command.

``frf_error`` = ‖H − Hₓ‖/‖Hₓ‖ (Frobenius) over all lines in the fitted band and all channels of a
recording, in the recorded quantity; of several recordings the r.m.s. ``before`` is always the file
as it came, mesh included, with the damping of the file. `run`, `correlate` and `diagnose` give the
same figure for the same model.

``response_error`` is the same for time histories: ‖Y − Yₓ‖/‖Yₓ‖ over the lines k/T of the band and
all channels, Yₓ the spectra of e^{−δt} times the record (δ = 7/T) and Y = sᵒ H(s) U the model's
answer to the recorded force at s = δ + iω. That is exact for a record that starts from rest; no
window and no average of a spectral estimate enters. Where a record mixes quantities each counts as
a recording of its own.

A model with nonlinear elements answers to a time history by simulation from rest, and its own
spectra are taken as those of the record. Its frequency responses are those of its linear elements.

The band is `recordings.measured.band_of`: the recording's own ``band`` key, else all its lines
above 0 Hz, or of a time history what its excitation reached. A DOF that the model holds answers 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.frf import Complex, frf_error
from cvxupdate.correlate.simulated import simulated
from cvxupdate.errors import ConvergenceError, ModelError, RecordingError
from cvxupdate.fe.internal import is_nonlinear
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis import responses
from cvxupdate.recordings.measured import MOTION, Measured, measured_responses
from cvxupdate.recordings.types import Channel, FrequencyResponse, Recording, TimeHistory

Index = NDArray[np.int64]
FRF, TIME = "frf_error", "response_error"
USES = {"fit": "fit", "hold-out": "hold_out"}
"""From a recording's ``use`` to its key in a result."""


@dataclass(frozen=True)
class Stated:
    """The error of one recording: its ``use``, the ``metric`` it belongs to, its ``value``, its
    name."""

    use: str
    metric: str
    value: float
    recording: str = ""


def places(model: Model, channels: Sequence[Channel]) -> Index:
    """Places among the free DOFs, −1 where a support holds.

    Raises
    ------
    RecordingError
        For a node that the model does not have.
    """
    nodes = set(model.node_ids.tolist())
    for c in channels:
        if c.node not in nodes:
            raise RecordingError(
                f"channel {c.label} sits at node {c.node}, which the model does not have. "
                "Correct the channel."
            )
    return np.array([model.place.get(c.label, -1) for c in channels], dtype=np.int64)


def modelled(model: Model, measured: Measured, p: Real | None = None) -> Complex:
    """The model's answer at ``p`` to what drove the measured one, of the shape of ``measured.Y``.

    Raises
    ------
    ModelError
        The model is a mechanism, or a line meets a natural frequency of an undamped model.
    """
    H = responses(
        model,
        measured.s,
        places(model, measured.responses),
        places(model, measured.references),
        measured.quantity,
        p,
    )
    return np.asarray(H @ measured.U, dtype=np.complex128)


def stated_errors(
    model: Model, recordings: Sequence[Recording], p: Real | None = None
) -> tuple[Stated, ...]:
    """The error of every recording of responses; infinite where the model's response is."""
    out = []
    for recording in recordings:
        if not isinstance(recording, FrequencyResponse | TimeHistory):
            continue
        found = measured_responses(recording)
        try:
            own = answers(model, recording, found, p)
        except (ModelError, ConvergenceError):
            values = [float("inf")] * len(found)
        else:
            values = [frf_error(y, m.Y) for y, m in zip(own, found, strict=True)]
        origin, metric = recording.origin, metric_of(recording)
        out += [Stated(origin.use, metric, v, origin.name) for v in values]
    return tuple(out)


def answers(
    model: Model,
    recording: FrequencyResponse | TimeHistory,
    found: Sequence[Measured],
    p: Real | None = None,
) -> list[Complex]:
    """The model's answer to each of the responses ``found`` in a recording: `modelled`, but of a
    time history by simulation where the model has nonlinear elements."""
    if not found or not isinstance(recording, TimeHistory) or not is_nonlinear(model):
        return [modelled(model, measured, p) for measured in found]
    return [m.Y for m in measured_responses(simulated_history(model, recording, p))]


def simulated_history(model: Model, history: TimeHistory, p: Real | None = None) -> TimeHistory:
    """`simulated`, with the channels' places."""
    placed = [c for c in history.channels if c.dof]
    drives = places(model, [c for c in placed if c.quantity == "force"])
    senses = places(model, [c for c in placed if c.quantity in MOTION])
    return simulated(model, history, drives, senses, p)


def metric_of(recording: FrequencyResponse | TimeHistory) -> str:
    """The name of its metric."""
    return FRF if isinstance(recording, FrequencyResponse) else TIME


def pooled(errors: Sequence[Stated]) -> dict[str, dict[str, float]]:
    """{"fit": {metric: error}, "hold_out": {…}}: the r.m.s. over the recordings of each use."""
    out: dict[str, dict[str, float]] = {"fit": {}, "hold_out": {}}
    for use, key in USES.items():
        for metric in (FRF, TIME):
            values = [e.value for e in errors if e.use == use and e.metric == metric]
            if values:
                out[key][metric] = float(np.sqrt(np.mean(np.square(values))))
    return out


def together(errors: Sequence[Stated], use: str) -> float:
    """The r.m.s. over all recordings of one use, whatever their kind; NaN without any."""
    values = [e.value for e in errors if e.use == use]
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")


def response_errors(
    model: Model, recordings: Sequence[Recording], p: Real | None = None
) -> dict[str, dict[str, float]]:
    """``frf_error`` and ``response_error`` of the model at ``p`` (None: as it came), the figures
    that `run`, `correlate` and `diagnose` state: {"fit": {metric: error}, "hold_out": {…}}."""
    return pooled(stated_errors(model, recordings, p))
