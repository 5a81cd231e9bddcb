"""From a problem file's [[recordings]] to recordings: read, labelled, in SI, checked against the
model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.beginning import settled
from cvxupdate.recordings.corrections import corrected
from cvxupdate.recordings.fits import check_fit
from cvxupdate.recordings.imposed import driven_by_motion
from cvxupdate.recordings.opened import LEAVE_OUT, Opened, contents_of, key_of, said_of
from cvxupdate.recordings.read.contents import Contents, Progress
from cvxupdate.recordings.read.mode_covariance import by_channel, chosen, covariance_of, told
from cvxupdate.recordings.read.time_pieces import TimeBlocks
from cvxupdate.recordings.read.to_frf import frequency_response
from cvxupdate.recordings.read.to_modes import (
    ModeValues,
    mode_table,
    modes_of_contents,
    places_of,
)
from cvxupdate.recordings.read.to_time import gather, time_blocks
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
from cvxupdate.spec.elements import from_files
from cvxupdate.spec.recordings import (
    ChannelRow,
    FrfRecording,
    ModeRow,
    ModesRecording,
    TimeRecording,
)
from cvxupdate.spec.recordings import Recording as Declared

SLOWEST, FASTEST = 1e-9, 1e12
"""Samples a second of anything that vibrates."""
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


def _origin(declared: Declared, number: int, contents: Contents | None = None) -> Origin:
    file = declared.file.name if declared.file is not None else ""
    name = declared.name or file or f"recording {number + 1}"
    source = str(declared.file) if declared.file is not None else (declared.source or name)
    damage = () if contents is None else said_of(contents)
    return Origin(name, source, declared.use, declared.level, damage, declared.state)


Known = Sequence[tuple[Declared, Recording]]
"""Recordings that were loaded before, each with its declaration."""


def blocks_of(
    declared: TimeRecording,
    number: int = 0,
    opened: Opened | None = None,
    progress: Progress | None = None,
) -> TimeBlocks:
    """A declared time history as blocks that stay on disk: as they lie where the format allows,
    else in a temporary file once they are large."""
    contents = contents_of(declared, {} if opened is None else opened, progress)
    return time_blocks(
        contents,
        [_wanted(row) for row in declared.channels or ()],
        _origin(declared, number, contents),
        rate=declared.rate,
        time_column=declared.time_column,
        names=Names(declared.variables),
        start=declared.start or 0,
        stop=declared.stop,
    )


def _frf(
    declared: FrfRecording, number: int, opened: Opened, progress: Progress | None
) -> FrequencyResponse:
    references = [Channel(row.node, row.dof, row.quantity) for row in declared.references or ()]
    if declared.references is not None and not references:
        references = [_SPECTRUM]
    contents = contents_of(declared, opened, progress)
    frf = frequency_response(
        contents,
        _origin(declared, number, contents),
        quantity=declared.response,
        wanted=[_wanted(row) for row in declared.channels or ()],
        references=references,
        frequency_column=declared.frequency_column,
        names=Names(declared.variables),
        averages=declared.averages,
        leave_out=declared.damaged == LEAVE_OUT,
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
    names, contents = Names(declared.variables), None
    if declared.rows:
        modes, channels = [_mode(row) for row in declared.rows], tuple[Channel, ...]()
    else:
        contents = contents_of(declared, opened)
        origin = _origin(declared, number, contents)
        modes, channels = modes_of_contents(contents, names, wanted)
    C = covariance_of(declared.covariance, contents, names, modes, origin.source)
    low, high = declared.band or (0.0, np.inf)
    order = sorted(range(len(modes)), key=lambda m: modes[m].frequency)
    order = [m for m in order if low <= modes[m].frequency <= high]
    if modes and not order:
        raise RecordingError(
            f"{origin.source}: no mode lies between {low:g} and {high:g} Hz; the table has "
            f"{', '.join(f'{m.frequency:.5g}' for m in modes[:20])} Hz. Correct band."
        )
    C = None if C is None else chosen(C, modes, order)
    kept = [modes[m] for m in order]
    channels = channels if not wanted else ()
    table = mode_table(
        kept if C is None else told(kept, C),
        origin,
        wanted,
        frequency_std=declared.frequency_std,
        channels=channels,
        frequency_std_relative=declared.frequency_std_relative,
    )
    if C is None:
        return table
    places, _ = places_of(origin.source, wanted, channels)
    return replace(table, covariance=by_channel(C, kept, places))


def load_recording(
    declared: Declared,
    number: int = 0,
    opened: Opened | None = None,
    progress: Progress | None = None,
) -> Recording:
    """One declared recording, read and in SI. Raises `RecordingError` naming file and channel."""
    opened = {} if opened is None else opened
    if isinstance(declared, TimeRecording):
        return gather(blocks_of(declared, number, opened, progress), progress)
    if isinstance(declared, FrfRecording):
        return _frf(declared, number, opened, progress)
    return _modes(declared, number, opened)


def load_recordings(
    spec: Spec, progress: Progress | None = None, known: Known = ()
) -> tuple[Recording, ...]:
    """Every recording of a problem file: labelled channels, SI values, FRFs with their variance.

    ``band`` cuts FRFs here; time histories carry it (`measured.band_of`). A recording that is
    among the ``known`` ones, further corrections apart, is not read again. Raises `RecordingError`
    with the first file and channel that cannot be read or does not fit the model.
    """
    given = any(from_files(block.type) for block in spec.model.elements)
    nodes = None if given else frozenset(node.id for node in spec.model.nodes)
    keys = [key_of(declared) for declared in spec.recordings]
    recordings = []
    opened: Opened = {}
    for number, declared in enumerate(spec.recordings):
        recording = _again(declared, known)
        if recording is None:
            raw = load_recording(declared, number, opened, progress)
            driven = driven_by_motion(raw, declared, spec.model.bases)
            recording = corrected(driven, declared.corrections)
        for key in set(opened) - set(keys[number + 1 :]):
            del opened[key]  # files are large
        check_fit(recording, nodes, tuple(spec.model.dofs))
        if isinstance(recording, TimeHistory):
            if not SLOWEST <= recording.rate <= FASTEST:
                raise RecordingError(
                    f"{recording.origin.name}: {recording.rate:.3g} samples a second are none of a "
                    "vibration. Give rate in Hz."
                )
            recording = settled(replace(recording, band=declared.band), _begins(declared))
        recordings.append(recording)
    return tuple(recordings)


def _begins(declared: Declared) -> str | None:
    return declared.begins if isinstance(declared, TimeRecording) else None


def _again(declared: Declared, known: Known) -> Recording | None:
    """The known recording of the same declaration, with those corrections applied that it does not
    have yet; None where there is none."""
    bare = declared.model_copy(update={"corrections": ()})
    for other, recording in known:
        done = len(other.corrections)
        if (
            other.model_copy(update={"corrections": ()}) == bare
            and declared.corrections[:done] == other.corrections
        ):
            return corrected(recording, declared.corrections[done:])
    return None
