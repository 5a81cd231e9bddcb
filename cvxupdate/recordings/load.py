"""From a problem file's [[recordings]] to recordings: read, labelled, in SI, checked against the
model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.corrections import corrected
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import Contents, Options, Told
from cvxupdate.recordings.read.to_frf import frequency_response
from cvxupdate.recordings.read.to_modes import ModeValues, mode_table, modes_of_contents
from cvxupdate.recordings.read.to_time import TimeBlocks, gather, time_blocks
from cvxupdate.recordings.read.wanted import Names, Wanted
from cvxupdate.recordings.types import (
    Channel,
    FrequencyResponse,
    ModeTable,
    Origin,
    Recording,
    TimeHistory,
)
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import MatrixBlock
from cvxupdate.spec.recordings import (
    ChannelRow,
    FrfRecording,
    ModeRow,
    ModesRecording,
    TimeRecording,
)
from cvxupdate.spec.recordings import Recording as Declared

_SPECTRUM = Channel(0, "", "unknown")
"""The reference of a spectrum, for which no force was recorded: its "FRF" is the spectrum
itself."""


def _wanted(row: ChannelRow) -> Wanted:
    return Wanted(
        row.column,
        row.quantity,
        row.node if row.node is not None else 0,
        row.dof or "",
        row.unit or "",
        row.sensitivity,
        row.sign,
        row.index,
        row.form,
        row.pair,
        row.phase_unit,
        row.coherence,
        row.reference,
    )


def _origin(declared: Declared, number: int) -> Origin:
    file = declared.file.name if declared.file is not None else ""
    name = declared.name or file or f"recording {number + 1}"
    source = str(declared.file) if declared.file is not None else (declared.source or name)
    return Origin(name, source, declared.use, declared.level)


Opened = dict[tuple[str, Options, str | None], Contents]
"""The file that was read last: several recordings of one file read it once."""


def _contents(declared: Declared, opened: Opened, told: Told | None = None) -> Contents:
    if declared.file is None:
        raise RecordingError("a recording names no file.")
    options = Options(
        declared.delimiter,
        declared.decimal,
        declared.encoding,
        declared.skip_rows,
        declared.header_lines,
        told=told,
    )
    key = (str(declared.file), options, declared.format)
    if key not in opened:
        opened.clear()  # one at a time: files are large
        opened[key] = read_file(declared.file, options, declared.format)
    return opened[key]


def blocks_of(
    declared: TimeRecording, number: int = 0, opened: Opened | None = None, told: Told | None = None
) -> TimeBlocks:
    """A declared time history as blocks that stay on disk: as they lie where the format allows,
    else in a temporary file once they are large."""
    return time_blocks(
        _contents(declared, {} if opened is None else opened, told),
        [_wanted(row) for row in declared.channels or ()],
        _origin(declared, number),
        rate=declared.rate,
        time_column=declared.time_column,
        names=Names(declared.variables),
        start=declared.start or 0,
        stop=declared.stop,
    )


def _frf(
    declared: FrfRecording, number: int, opened: Opened, told: Told | None
) -> FrequencyResponse:
    references = [Channel(row.node, row.dof, row.quantity) for row in declared.references or ()]
    if declared.references is not None and not references:
        references = [_SPECTRUM]
    frf = frequency_response(
        _contents(declared, opened, told),
        _origin(declared, number),
        quantity=declared.response,
        wanted=[_wanted(row) for row in declared.channels or ()],
        references=references,
        frequency_column=declared.frequency_column,
        names=Names(declared.variables),
        averages=declared.averages,
    )
    return frf if declared.band is None else _cut(frf, *declared.band)


def _cut(frf: FrequencyResponse, low: float, high: float) -> FrequencyResponse:
    keep = (frf.frequency >= low) & (frf.frequency <= high)
    if np.count_nonzero(keep) < 2:
        raise RecordingError(
            f"{frf.origin.source}: no line lies between {low:g} and {high:g} Hz; the file "
            f"goes from {frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz. Correct band."
        )
    return replace(
        frf,
        frequency=frf.frequency[keep],
        H=frf.H[keep],
        variance=None if frf.variance is None else frf.variance[keep],
        coherence=None if frf.coherence is None else frf.coherence[keep],
    )


def _mode(row: ModeRow) -> ModeValues:
    shape = (
        None
        if row.shape is None
        else [complex(*entry) if isinstance(entry, tuple) else entry for entry in row.shape]
    )
    return ModeValues(
        row.frequency,
        row.frequency_std,
        row.damping,
        row.damping_std,
        shape,
        row.shape_std,
        row.mode or 0,
    )


def _modes(declared: ModesRecording, number: int, opened: Opened) -> ModeTable:
    origin = _origin(declared, number)
    wanted = [_wanted(row) for row in declared.channels or ()]
    if declared.rows:
        modes, channels = [_mode(row) for row in declared.rows], tuple[Channel, ...]()
    else:
        modes, channels = modes_of_contents(
            _contents(declared, opened), Names(declared.variables), wanted
        )
    return mode_table(
        modes,
        origin,
        wanted,
        frequency_std=declared.frequency_std,
        channels=channels if not wanted else (),
        frequency_std_relative=declared.frequency_std_relative,
    )


def load_recording(
    declared: Declared, number: int = 0, opened: Opened | None = None, told: Told | None = None
) -> Recording:
    """One declared recording, read and in SI. Raises `RecordingError` naming file and channel."""
    opened = {} if opened is None else opened
    if isinstance(declared, TimeRecording):
        return gather(blocks_of(declared, number, opened, told), told)
    if isinstance(declared, FrfRecording):
        return _frf(declared, number, opened, told)
    return _modes(declared, number, opened)


def _channels(recording: Recording) -> tuple[Channel, ...]:
    if isinstance(recording, FrequencyResponse):
        return (*recording.responses, *recording.references)
    return recording.channels


def check_fit(recording: Recording, nodes: frozenset[int] | None, dofs: tuple[str, ...]) -> None:
    """Every channel sits at a node and an active DOF of the model, and every value is a number.

    ``nodes`` is None where the text does not know them all (matrices of another program bring their
    own).

    Raises `RecordingError` naming the file, the channel and what the model has. Channels of
    quantity voltage or unknown need no place.
    """
    where = recording.origin.source
    for channel in _channels(recording):
        if not channel.dof and channel.quantity in ("voltage", "unknown"):
            continue
        if nodes is not None and channel.node not in nodes:
            raise RecordingError(
                f"{where}: channel {channel.label} ({channel.quantity}): the model has no "
                f"node {channel.node}. Correct the channel, or add the node to the model."
            )
        if channel.dof not in dofs:
            raise RecordingError(
                f"{where}: channel {channel.label} ({channel.quantity}): the model's active "
                f"DOFs are {', '.join(dofs)}. Add {channel.dof!r} to model.dofs, or leave the "
                "channel out."
            )
    if isinstance(recording, ModeTable):
        return
    values = recording.H if isinstance(recording, FrequencyResponse) else recording.data
    responses = (
        recording.responses if isinstance(recording, FrequencyResponse) else recording.channels
    )
    for column, channel in enumerate(responses):
        bad = int(np.count_nonzero(~np.isfinite(values[:, column])))
        if bad:
            raise RecordingError(
                f"{where}: channel {channel.label} ({channel.quantity}) has {bad} values that "
                "are not numbers. Cut the record before or after them (start, stop, band), "
                "or leave the channel out; `cvxupdate inspect` shows where they are."
            )


def load_recordings(spec: Spec, told: Told | None = None) -> tuple[Recording, ...]:
    """Every recording of a problem file: labelled channels, SI values, FRFs with their variance.

    ``band`` cuts FRFs here; time histories carry it (`measured.band_of`). Raises `RecordingError`
    with the first file and channel that cannot be read or does not fit the model.
    """
    given = any(isinstance(block, MatrixBlock) for block in spec.model.elements)
    nodes = None if given else frozenset(node.id for node in spec.model.nodes)
    recordings = []
    opened: Opened = {}
    for number, declared in enumerate(spec.recordings):
        recording = corrected(load_recording(declared, number, opened, told), declared.corrections)
        check_fit(recording, nodes, tuple(spec.model.dofs))
        if isinstance(recording, TimeHistory):
            recording = replace(recording, band=declared.band)
        recordings.append(recording)
    return tuple(recordings)
