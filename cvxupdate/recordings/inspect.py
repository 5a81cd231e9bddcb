"""What is in a file, before anyone has declared anything: for `cvxupdate inspect FILE`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.lines import Line, dominant_lines, frf_peaks
from cvxupdate.recordings.quality import check, samples
from cvxupdate.recordings.quality.finding import Finding
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import AnyArray, Contents, Options, Told
from cvxupdate.recordings.read.to_frf import frequency_response
from cvxupdate.recordings.read.to_time import rate_of_times, rises
from cvxupdate.recordings.survey import LONG, Survey, survey
from cvxupdate.recordings.types import FrequencyResponse, Origin, Real

_TIMES = ("time", "t", "x_value", "sec", "seconds", "time [s]", "t [s]")
_QUANTITIES = (
    ("force", "force"),
    ("load", "force"),
    ("hammer", "force"),
    ("acc", "acceleration"),
    ("vel", "velocity"),
    ("disp", "displacement"),
    ("strain", "strain"),
    ("volt", "voltage"),
)
_BY_UNIT = {
    "g": "acceleration",
    "m/s^2": "acceleration",
    "m/s²": "acceleration",
    "m/s2": "acceleration",
    "N": "force",
    "Newtons": "force",
    "lbf": "force",
    "kip": "force",
    "m": "displacement",
    "mm": "displacement",
    "in": "displacement",
    "m/s": "velocity",
    "V": "voltage",
}


@dataclass(frozen=True)
class ChannelView:
    """One channel as found: name, unit and guessed quantity; level in the file's numbers; faults;
    lines (Hz), strongest first."""

    name: str
    unit: str
    quantity: str
    mean: float
    rms: float
    least: float
    largest: float
    missing: int
    clipped: int
    dropped: int
    lines: tuple[Line, ...]
    place: str = ""


@dataclass(frozen=True)
class Inspection:
    """A file as found: ``kind`` "time", "frf", "modes" or "arrays"; ``rate`` Hz (NaN unknown);
    ``length`` samples or lines; ``block`` a [[recordings]] table ready to be completed (node
    numbers are for the user to say)."""

    file: str
    format: str
    kind: str
    rate: float
    length: int
    channels: tuple[ChannelView, ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    block: str

    def text(self) -> str:
        """The inspection in plain words, for a terminal."""
        out = [
            f"{self.file}: {self.format}, {self.kind}, {self.length} "
            f"{'lines' if self.kind == 'frf' else 'samples' if self.kind == 'time' else 'rows'}"
            + (
                f", {self.rate:.7g} Hz, {self.length / self.rate:.4g} s"
                if self.kind == "time" and np.isfinite(self.rate)
                else ""
            )
        ]
        for c in self.channels:
            faults = [
                f"{n} {word}"
                for n, word in (
                    (c.missing, "missing"),
                    (c.clipped, "clipped"),
                    (c.dropped, "in drop-outs"),
                )
                if n
            ]
            lines = ", ".join(f"{line.frequency:.4g}" for line in c.lines[:5])
            out.append(
                "  "
                f"{c.name}{' [' + c.unit + ']' if c.unit else ''}"
                f"{' at ' + c.place if c.place else ''}: "
                f"{c.quantity}, r.m.s. {c.rms:.4g}, mean {c.mean:.3g}, "
                f"{c.least:.4g} to {c.largest:.4g}"
                + (f"; lines at {lines} Hz" if lines else "")
                + (f"; {', '.join(faults)}" if faults else "")
            )
        out += [f"  note: {note}" for note in self.notes] + [
            f"  {finding.check}: {finding.says}" for finding in self.findings
        ]
        return "\n".join([*out, "", self.block])


def _guess(name: str, unit: str, kind: str = "") -> str:
    for word, quantity in _QUANTITIES:
        if word in name.lower():
            return quantity
    return _BY_UNIT.get(unit, kind or "unknown")


@dataclass(frozen=True)
class _Column:
    """A channel to look at: what is known of it, and its values, which may lie on disk."""

    name: str
    unit: str
    quantity: str
    values: AnyArray
    place: str = ""


def _views(
    columns: Sequence[_Column], rate: float, told: Told | None = None
) -> tuple[ChannelView, ...]:
    """Level, faults and lines of equally long channels; a complex one by its modulus. Long ones are
    looked at in blocks."""
    if columns and len(columns[0].values) > LONG:
        seen = survey([c.values for c in columns], rate, told, "looking at the channels")
    else:
        seen = tuple(_survey(c.values, rate) for c in columns)
    return tuple(
        ChannelView(
            c.name,
            c.unit,
            c.quantity,
            s.mean,
            s.rms,
            s.least,
            s.largest,
            s.missing,
            s.clipped,
            s.dropped,
            s.lines,
            c.place,
        )
        for c, s in zip(columns, seen, strict=True)
    )


def _survey(x: AnyArray, rate: float) -> Survey:
    """A channel that is short enough to be looked at as a whole."""
    values: Real = np.asarray(np.abs(x) if x.dtype.kind == "c" else x, dtype=float)
    bad = samples.missing(values)
    values = values[np.isfinite(values)]
    if values.size == 0:
        return Survey(*(float("nan"),) * 4, bad, 0, 0, ())
    clip, drop = (
        (samples.clipping(values), samples.dropouts(values))
        if values.size >= 16 and np.ptp(values) > 0.0
        else (None, None)
    )
    lines = dominant_lines(values, rate) if np.isfinite(rate) else ()
    return Survey(
        float(np.mean(values)),
        float(np.std(values)),
        float(values.min()),
        float(values.max()),
        bad,
        int(clip.value) if clip is not None and clip.fault else 0,
        int(drop.value) if drop is not None and drop.fault else 0,
        lines,
    )


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _block(path: Path, kind: str, lines: list[str]) -> str:
    return (
        "\n".join(
            [
                "[[recordings]]",
                f'kind = "{kind}"',
                'use = "fit"',
                f"file = {_quoted(path.name)}",
                *lines,
            ]
        )
        + "\n"
    )


def _rate(rate: float) -> str:
    return (
        f"rate = {float(f'{rate:.10g}')!r}"
        if np.isfinite(rate)
        else "rate = 1.0            # Hz: the file does not say it"
    )


def _channel(column: int | str, view: ChannelView, node: int | None = None, dof: str = "") -> str:
    quantity = view.quantity
    unit = f", unit = {_quoted(view.unit)}" if view.unit else ""
    if quantity in ("voltage", "unknown"):
        return (
            f"  {{ column = {column if isinstance(column, int) else _quoted(column)}, quantity = "
            f'"{quantity}"{unit} }},'
        )
    place = f'node = {node if node is not None else 1}, dof = "{dof or "z"}"'
    return (
        f"  {{ column = {column if isinstance(column, int) else _quoted(column)}, quantity = "
        f'"{quantity}", {place}{unit} }},'
    )


def _functions(path: Path, contents: Contents, told: Told | None) -> Inspection:
    """A universal file: FRFs if there are any, else time histories, else shapes."""
    kinds = {f.kind for f in contents.functions}
    wanted = 4 if 4 in kinds else 1
    chosen = [f for f in contents.functions if f.kind == wanted or (wanted == 1 and f.kind == 0)]
    if not chosen:
        shapes = contents.shapes
        block = _block(path, "modes", ['response = "displacement"'])
        kind = "modes" if shapes else "arrays"
        return Inspection(
            str(path),
            contents.format,
            kind,
            float("nan"),
            len(shapes),
            (),
            (),
            contents.notes,
            block if shapes else "",
        )
    step = chosen[0].step
    rate = 1.0 / step if wanted == 1 and chosen[0].abscissa is None and step > 0.0 else float("nan")
    columns = []
    for k, f in enumerate(chosen):
        place = f"n{f.response.node}.{'-' if f.response.sign < 0 else ''}{f.response.dof}"
        columns.append(
            _Column(
                f"set {k}",
                f.unit,
                f.quantity,
                f.values,
                f"{place} / n{f.reference.node}.{f.reference.dof}" if wanted == 4 else place,
            )
        )
    views = (
        _views(columns, rate, told)
        if len({len(c.values) for c in columns}) == 1
        else tuple(_views([c], rate, told)[0] for c in columns)
    )
    findings: tuple[Finding, ...] = ()
    if wanted == 4:
        quantity = (
            chosen[0].quantity
            if chosen[0].quantity in ("displacement", "velocity", "acceleration")
            else "acceleration"
        )
        block = _block(path, "frf", [f'response = "{quantity}"'])
        findings, notes = _frf_findings(contents, quantity)
        return Inspection(
            str(path),
            contents.format,
            "frf",
            float("nan"),
            len(chosen[0].values),
            views,
            findings,
            (*contents.notes, *notes),
            block,
        )
    rows = [
        _channel(k, v, f.response.node, f.response.dof)
        for k, (v, f) in enumerate(zip(views, chosen, strict=True))
    ]
    block = _block(path, "time", [_rate(rate), "channels = [", *rows, "]"])
    return Inspection(
        str(path),
        contents.format,
        "time",
        rate,
        len(chosen[0].values),
        views,
        findings,
        contents.notes,
        block,
    )


def _frf_findings(contents: Contents, quantity: str) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """What the checks say of FRFs that can be put together, with their peaks as a note."""
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


def _first(contents: Contents) -> AnyArray | None:
    """The table of a file, or its longest vectors as columns (MATLAB's V1, V2)."""
    data = contents.arrays.get("data")
    return data if data is not None and data.ndim == 2 and data.dtype.kind in "biufc" else None


def _table(path: Path, contents: Contents, data: AnyArray, told: Told | None) -> Inspection:
    """A table: time histories, unless its first column is a frequency axis."""
    if contents.format != "text" and data.shape[1] > 16 * data.shape[0]:
        data = data.T
    count = data.shape[1]
    names = contents.columns or tuple(f"column {k}" for k in range(count))
    units = contents.units or ("",) * count
    uniform = count > 0 and len(data) > 2 and rises(data[:, 0])
    frequency = uniform and (
        names[0].lower().startswith("freq") or units[0] == "Hz" or data.dtype.kind == "c"
    )
    if frequency:
        views = _views(
            [
                _Column(names[k], units[k], _guess(names[k], units[k], "acceleration"), data[:, k])
                for k in range(1, count)
            ],
            float("nan"),
            told,
        )
        decibel = "db" in f"{units[1:2]} {names[1:2]}".lower()
        form = (
            ""
            if data.dtype.kind == "c" or count < 3
            else f', form = "{"db" if decibel else "magnitude"}-phase", pair = 2'
        )
        rows = [
            f'  {{ column = {k}, quantity = "acceleration", node = 1, dof = "z"{form} }},'
            for k in range(1, count if data.dtype.kind == "c" else 2)
        ]
        block = _block(
            path,
            "frf",
            [
                'response = "acceleration"',
                "frequency_column = 0",
                'references = [{ node = 1, dof = "z" }]',
                "channels = [",
                *rows,
                "]",
            ],
        )
        return Inspection(
            str(path),
            contents.format,
            "frf",
            float("nan"),
            len(data),
            views,
            (),
            contents.notes,
            block,
        )
    times = -1
    rate, notes = contents.rate if contents.rate is not None else float("nan"), list(contents.notes)
    for k in range(count):
        if (
            (uniform and k == 0)
            or names[k].lower().strip() in _TIMES
            or (units[k] in ("s", "sec", "Sec") and count > 1)
        ):
            try:
                rate, times = rate_of_times(data[:, k], str(path)), k
                break
            except RecordingError as error:
                notes.append(str(error))
    views = _views(
        [
            _Column(names[k], units[k], _guess(names[k], units[k]), data[:, k])
            for k in range(count)
            if k != times
        ],
        rate,
        told,
    )
    keys = [k for k in range(count) if k != times]
    head = [f"time_column = {times}"] if times >= 0 else [_rate(rate)]
    rows = [_channel(k, v) for k, v in zip(keys, views, strict=True)]
    return Inspection(
        str(path),
        contents.format,
        "time",
        rate,
        len(data),
        views,
        (),
        tuple(notes),
        _block(path, "time", [*head, "channels = [", *rows, "]"]),
    )


def inspect_file(
    path: Path | str,
    options: Options | None = None,
    format: str | None = None,
    told: Told | None = None,
) -> Inspection:
    """What a file holds, and a [[recordings]] block for it. Raises `RecordingError` when it cannot
    be read at all.

    Quantities are guessed from names and units, places only where the file states them: the block
    is a start, not an answer. Long time histories are looked at in blocks; ``told`` hears how far
    that is.
    """
    path = Path(path)
    contents = read_file(path, replace(options or Options(), told=told), format)
    if contents.functions or contents.shapes:
        return _functions(path, contents, told)
    if "H" in contents.arrays and "frequency" in contents.arrays:
        findings, notes = _frf_findings(contents, "acceleration")
        H = contents.arrays["H"]
        flat = H.reshape(len(H), -1) if H.ndim else H.reshape(1, 1)
        views = _views(
            [
                _Column(f"H {k}", "", "acceleration", flat[:, k])
                for k in range(min(flat.shape[1], 64))
            ],
            float("nan"),
            told,
        )
        return Inspection(
            str(path),
            contents.format,
            "frf",
            float("nan"),
            len(H),
            views,
            findings,
            (*contents.notes, *notes),
            _block(path, "frf", ['response = "acceleration"']),
        )
    data = _first(contents)
    if data is not None and data.shape[0] > 1:
        return _table(path, contents, data, told)
    rate = contents.rate if contents.rate is not None else float("nan")
    vectors = {
        name: np.squeeze(a)
        for name, a in contents.arrays.items()
        if a.dtype.kind in "biuf" and np.squeeze(a).ndim == 1 and a.size >= 64
    }
    length = max((len(v) for v in vectors.values()), default=0)
    views = _views(
        [_Column(name, "", _guess(name, ""), v) for name, v in vectors.items() if len(v) == length],
        rate,
        told,
    )
    if not views:
        shapes = tuple(
            f"{name}: {' x '.join(map(str, a.shape)) or 'one number'}, {a.dtype}"
            for name, a in contents.arrays.items()
        )
        return Inspection(
            str(path), contents.format, "arrays", rate, 0, (), (), (*contents.notes, *shapes), ""
        )
    head = [_rate(rate)]
    rows = [_channel(view.name, view) for view in views]
    return Inspection(
        str(path),
        contents.format,
        "time",
        rate,
        length,
        views,
        (),
        contents.notes,
        _block(path, "time", [*head, "channels = [", *rows, "]"]),
    )
