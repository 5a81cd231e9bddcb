"""Inspection of a universal file: FRFs if there are any, else time histories, else shapes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.inspect.block import channel_row, rate_line, recordings_block
from cvxupdate.recordings.inspect.channels import Column, channel_views
from cvxupdate.recordings.inspect.result import ChannelView, Inspection
from cvxupdate.recordings.lines import frf_peaks
from cvxupdate.recordings.quality import check
from cvxupdate.recordings.quality.finding import Finding
from cvxupdate.recordings.read.contents import Contents, Function, Progress
from cvxupdate.recordings.read.to_frf import frequency_response
from cvxupdate.recordings.types import MOTIONS, FrequencyResponse, Origin

_NAN = float("nan")


def inspect_functions(path: Path, contents: Contents, progress: Progress | None) -> Inspection:
    """FRFs (function type 4) if there are any, else time histories (0, 1), else shapes."""
    frfs = [f for f in contents.functions if f.kind == 4]
    histories = [f for f in contents.functions if f.kind in (0, 1)]
    if frfs:
        return _frfs(path, contents, frfs, progress)
    if histories:
        return _histories(path, contents, histories, progress)
    shapes = contents.shapes
    return Inspection(
        str(path),
        contents.format,
        "modes" if shapes else "arrays",
        _NAN,
        len(shapes),
        (),
        (),
        contents.notes,
        recordings_block(path, "modes", ['response = "displacement"']) if shapes else "",
    )


def _views(
    functions: Sequence[Function],
    places: Sequence[str],
    rate: float,
    progress: Progress | None,
) -> tuple[ChannelView, ...]:
    """The functions as channels: together where they are equally long, else one by one."""
    columns = [
        Column(f"set {k}", f.unit, f.quantity, f.values, place)
        for k, (f, place) in enumerate(zip(functions, places, strict=True))
    ]
    if len({len(c.values) for c in columns}) == 1:
        return channel_views(columns, rate, progress)
    return tuple(channel_views([c], rate, progress)[0] for c in columns)


def _response(f: Function) -> str:
    return f"n{f.response.node}.{'-' if f.response.sign < 0 else ''}{f.response.dof}"


def _frfs(
    path: Path, contents: Contents, functions: Sequence[Function], progress: Progress | None
) -> Inspection:
    places = [f"{_response(f)} / n{f.reference.node}.{f.reference.dof}" for f in functions]
    quantity = functions[0].quantity if functions[0].quantity in MOTIONS else "acceleration"
    findings, notes = frf_findings(contents, quantity)
    return Inspection(
        str(path),
        contents.format,
        "frf",
        _NAN,
        len(functions[0].values),
        _views(functions, places, _NAN, progress),
        findings,
        (*contents.notes, *notes),
        recordings_block(path, "frf", [f'response = "{quantity}"']),
    )


def _histories(
    path: Path, contents: Contents, functions: Sequence[Function], progress: Progress | None
) -> Inspection:
    first = functions[0]
    rate = 1.0 / first.step if first.abscissa is None and first.step > 0.0 else _NAN
    views = _views(functions, [_response(f) for f in functions], rate, progress)
    rows = [
        channel_row(k, v, f.response.node, f.response.dof)
        for k, (v, f) in enumerate(zip(views, functions, strict=True))
    ]
    return Inspection(
        str(path),
        contents.format,
        "time",
        rate,
        len(first.values),
        views,
        (),
        contents.notes,
        recordings_block(path, "time", [rate_line(rate), "channels = [", *rows, "]"]),
    )


def frf_findings(contents: Contents, quantity: str) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """What the quality checks find in FRFs that can be assembled, with their peaks as a note."""
    try:
        frf = frequency_response(contents, Origin(contents.file, contents.file), quantity=quantity)
    except RecordingError as error:
        return (), (str(error),)
    return check(frf), (_peaks(frf),)


def _peaks(frf: FrequencyResponse) -> str:
    peaks = frf_peaks(frf.frequency, frf.H, 10)
    return (
        "peaks at " + ", ".join(f"{peak.frequency:.5g}" for peak in peaks) + " Hz"
        if peaks
        else "no peaks"
    )
