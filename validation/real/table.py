"""Open every real recording through the problem files of this folder and compare what is found with
the data sets' READMEs.

Run: CVXUPDATE_DATA=/path/to/data python -m validation.real.table   (prints a Markdown table)
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cvxupdate.recordings.lines import decaying_sines, dominant_lines, frf_peaks, sine_fit
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import load_problem

PROBLEMS = Path(__file__).resolve().parents[2] / "problems" / "real"


@dataclass(frozen=True)
class Row:
    """A line of the table; ``stated`` are the README's frequencies (Hz), () where it states
    none."""

    data: str
    recording: str
    size: str
    found: tuple[float, ...]
    stated: tuple[float, ...]

    @property
    def deviation(self) -> float:
        """Largest relative deviation from the README, in percent; NaN where nothing is stated or
        the counts differ."""
        if not self.stated:
            return float("nan")
        if len(self.found) != len(self.stated):
            return float("inf")
        return float(
            max(abs(f / s - 1.0) for f, s in zip(self.found, self.stated, strict=True)) * 100.0
        )


def data_root() -> Path | None:
    """The folder that CVXUPDATE_DATA names, None when it is not set or not there."""
    value = os.environ.get("CVXUPDATE_DATA")
    return Path(value) if value and Path(value).is_dir() else None


def size_of(recording: Recording) -> str:
    """Channels and rate, lines or modes, in words."""
    if isinstance(recording, TimeHistory):
        return (
            f"{recording.data.shape[1]} ch, {recording.rate:.6g} Hz, {len(recording.data)} samples"
        )
    if isinstance(recording, FrequencyResponse):
        lines = (
            f"{len(recording.frequency)} lines {recording.frequency[0]:.4g} to "
            f"{recording.frequency[-1]:.4g} Hz"
        )
        return f"{recording.H.shape[1]} x {recording.H.shape[2]} FRF, {lines}"
    return f"{len(recording.frequency)} modes, {len(recording.channels)} DOFs"


def small_decay(
    record: TimeHistory, modes: int = 2, start: float = 0.5
) -> list[tuple[float, float]]:
    """Frequency and damping in the free decay from half a second behind the blow on: small
    amplitudes, where the frequency has settled.

    The rig softens: the same decay begins up to 3 % lower (massa4), which is what the peak of the
    FRF shows.
    """
    from scipy.signal import decimate

    x = decimate(record.data[:, 0] - record.data[:, 0].mean(), 16, ftype="fir", zero_phase=True)
    rate = record.rate / 16
    return [
        (f, z)
        for f, z in decaying_sines(x[int(start * rate) :], rate, modes)
        if 8.0 < f < 24.5 and z < 0.05
    ]


def load(name: str, file: str = "problem.toml") -> tuple[Recording, ...]:
    """The recordings of a problem file of this folder."""
    return load_recordings(load_problem(PROBLEMS / name / file))


def found_in(recording: Recording, count: int, low: float, high: float) -> tuple[float, ...]:
    """The first frequencies of an FRF, or the frequencies of a table of modes."""
    if isinstance(recording, ModeTable):
        return tuple(float(f) for f in recording.frequency[:count])
    if isinstance(recording, FrequencyResponse):
        return tuple(
            line.frequency
            for line in frf_peaks(recording.frequency, recording.H, count, low=low, high=high)
        )
    return tuple(
        sorted(
            line.frequency for line in dominant_lines(recording.data[:, 0], recording.rate, count)
        )
    )


def beam_rows() -> Iterator[Row]:
    """The five medians over 70 layouts for both states, and the ten published texts against the
    arrays."""
    stated = ((21.87, 138.7, 381.0, 738.7, 1154.0), (21.85, 139.1, 385.2, 754.3, 1169.0))
    recordings = load("beam-six-masses-frf", "problem_all_layouts.toml")
    for state, name in enumerate(("healthy", "2.96 % mass loss")):
        picked = np.array(
            [found_in(r, 5, 10.0, 1500.0) for r in recordings[70 * state : 70 * state + 70]]
        )
        yield Row(
            "beam-six-masses-frf",
            f"{name}: medians over {len(picked)} layouts",
            size_of(recordings[70 * state]),
            tuple(np.median(picked, axis=0).tolist()),
            stated[state],
        )
    for place, text in enumerate(recordings[140:]):
        array = recordings[place if place < 5 else 65 + place]
        yield Row(
            "beam-six-masses-frf",
            text.origin.name,
            size_of(text),
            found_in(text, 5, 10.0, 1500.0),
            found_in(array, 5, 10.0, 1500.0),
        )


def rests(record: TimeHistory) -> list[tuple[float, slice]]:
    """Times at which the roller stands still: (mean position in V, samples), at least 0.4 s long,
    0.1 s after it stopped."""
    position = record.data[:, 2]
    block = int(0.02 * record.rate)
    means = position[: len(position) // block * block].reshape(-1, block).mean(axis=1)
    still = np.abs(means[5:] - means[:-5]) < 0.01
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    edges = edges[2:] if still[0] else edges  # before the first move nothing excites the beam
    return [
        (float(position[(a + 5) * block : b * block].mean()), slice((a + 7) * block, b * block))
        for a, b in edges.reshape(-1, 2)
        if (b - a) * block > 0.4 * record.rate
    ]


def first_line(x: np.ndarray, rate: float, low: float, high: float) -> float:
    """The strongest line of a short record between two frequencies, on a grid sixteen times finer
    than its own."""
    window = np.hanning(len(x))
    power = np.abs(np.fft.rfft((x - x.mean()) * window, 16 * len(x)))
    frequency = np.fft.rfftfreq(16 * len(x), 1.0 / rate)
    inside = (frequency > low) & (frequency < high)
    return float(frequency[inside][np.argmax(power[inside])])


def dropbear_rows() -> Iterator[Row]:
    """First frequency at each rest of the roller on its way out, and on its way back."""
    stated = (
        (1.226, 26.1),
        (1.648, 28.2),
        (2.083, 30.8),
        (2.505, 33.9),
        (2.936, 37.5),
        (3.370, 42.0),
    )
    for record in load("dropbear-moving-support"):
        if not isinstance(record, TimeHistory):
            continue
        found: dict[float, list[float]] = {}
        for volts, part in rests(record):
            nearest = min(stated, key=lambda pair: abs(pair[0] - volts))
            if abs(nearest[0] - volts) < 0.05:
                found.setdefault(nearest[1], []).append(
                    first_line(record.data[part, 1], record.rate, 15.0, 60.0)
                )
        yield Row(
            "dropbear-moving-support",
            record.origin.name,
            size_of(record),
            tuple(float(np.median(found[f])) for _, f in stated if f in found),
            tuple(f for _, f in stated),
        )
    for file in ("problem_rest_1.toml", "problem_rest_6.toml"):
        (table,) = load("dropbear-moving-support", file)
        yield Row(
            "dropbear-moving-support", file, size_of(table), found_in(table, 1, 0.0, np.inf), ()
        )


def unb_rows() -> Iterator[Row]:
    """Hammer: the first resonance of each impact; shaker: the frequency that the file's name (or
    the README) gives."""
    stated = {"massa1": (11.23,), "massa3": (19.92, 19.86), "massa4": (22.81, 22.79, 22.84)}
    for mass, file in (
        ("massa1", "problem_massa1.toml"),
        ("massa3", "problem.toml"),
        ("massa4", "problem_massa4.toml"),
    ):
        place = 0
        for record in load("unb-cantilever-tip-mass", file):
            name = f"{mass}: {record.origin.name}"
            if isinstance(record, FrequencyResponse):
                # massa4: the README's figures are those of small amplitudes, the FRF's peak (large
                # ones) lies 2 to 3 % lower
                known = () if mass == "massa4" else (stated[mass][place - len(stated[mass])],)
                yield Row(
                    "unb-cantilever-tip-mass",
                    name,
                    size_of(record),
                    found_in(record, 1, 8.0, 25.0),
                    known,
                )
                place += 1
            elif isinstance(record, TimeHistory) and record.origin.name.startswith("hammer"):
                decay = small_decay(record)
                strongest = min(decay, key=lambda mode: mode[1], default=(float("nan"), 0.0))
                yield Row(
                    "unb-cantilever-tip-mass",
                    name,
                    size_of(record),
                    (strongest[0],),
                    (stated[mass][place],),
                )
                place += 1
            elif isinstance(record, TimeHistory):
                nominal = float(record.origin.name.split(",")[1].split("Hz")[0])
                nominal = 14.0 if (mass, nominal) == ("massa3", 12.0) else nominal
                force, _, _ = sine_fit(
                    record.data[:, 1:2],
                    record.rate,
                    first_line(record.data[:, 1], record.rate, 0.5, 60.0),
                )
                yield Row("unb-cantilever-tip-mass", name, size_of(record), (force,), (nominal,))
    for file in ("problem_spectra.toml", "problem_motor.toml"):
        for record in load("unb-cantilever-tip-mass", file):
            yield Row(
                "unb-cantilever-tip-mass",
                record.origin.name,
                size_of(record),
                found_in(record, 1, 8.0, 100.0),
                (),
            )


def silverbox_rows() -> Iterator[Row]:
    """The resonance in the arrow's three parts against level, from averaged H1."""
    from scipy.signal import csd, welch

    stated = {0: (68.2,), 1: (68.5,), 4: (71.5,)}
    for place, record in enumerate(
        (*load("silverbox"), *load("silverbox", "problem_schroeder.toml"))
    ):
        if not isinstance(record, TimeHistory):
            continue
        u, y = (record.data - record.data.mean(axis=0)).T
        frequency, cross = csd(u, y, record.rate, nperseg=2048)
        H = cross / welch(u, record.rate, nperseg=2048)[1]
        band = (frequency > 20.0) & (frequency < 120.0)
        found = tuple(
            line.frequency
            for line in frf_peaks(frequency[band], smooth(H[band]), 1, prominence_db=3.0)
        )
        yield Row(
            "silverbox",
            f"{record.origin.name}, level {record.origin.level}",
            size_of(record),
            found,
            stated.get(place, ()),
        )


def smooth(H: np.ndarray) -> np.ndarray:
    """|H| averaged over nine lines: a broad resonance under noise has one peak then."""
    return np.convolve(np.abs(H), np.hanning(11)[1:-1] / np.hanning(11).sum(), mode="same").astype(
        complex
    )


def simple_rows() -> Iterator[Row]:
    """Frames, footbridge, storeys and the friction damper."""
    for record in load("cristallo-3storey-frame"):
        yield Row(
            "cristallo-3storey-frame",
            record.origin.name,
            size_of(record),
            found_in(record, 3, 3.0, 40.0),
            (6.50, 17.47, 26.50),
        )
    for file, parts in (
        ("problem_footbridge.toml", ((4.06, 4.55, 6.82, 8.65, 11.50),)),
        ("problem_four_storey.toml", ((0.883, 2.748), (4.300, 5.529))),  # fitted, held out
        ("problem_eighteen_storey.toml", ((0.865, 2.687, 4.849),)),
        ("problem_concrete_frame.toml", ((),)),
    ):
        for record, stated in zip(load("smu-modal-data", file), parts, strict=True):
            yield Row(
                "smu-modal-data", file, size_of(record), found_in(record, 5, 0.0, np.inf), stated
            )
    for file, hertz in (("problem.toml", 1.0), ("problem_half_hertz.toml", 0.5)):
        for record in load("friction-damper-backlash", file):
            if isinstance(record, TimeHistory):
                found = first_line(record.data[:, 0], record.rate, 0.2, 5.0)
                yield Row(
                    "friction-damper-backlash",
                    record.origin.name,
                    size_of(record),
                    (found,),
                    (hertz,),
                )


def rows() -> list[Row]:
    """Every row of the table."""
    parts = (beam_rows, simple_rows, dropbear_rows, silverbox_rows, unb_rows)
    return [row for part in parts for row in part()]


def unread(root: Path) -> list[tuple[str, str]]:
    """Files of the data sets that no [[recordings]] or matrix block names, and what they are; each
    is opened by `read_file`."""
    named = set()
    for file in PROBLEMS.rglob("problem*.toml"):
        spec = load_problem(file)
        named |= {r.file.resolve() for r in spec.recordings if r.file is not None}
        named |= {
            row.file.resolve()
            for block in spec.model.elements
            if block.type == "matrix"
            for row in block.rows
            if row.file is not None
        }
    others = [
        p
        for p in sorted(root.rglob("*"))
        if p.is_file() and p.suffix not in (".md", "") and p.resolve() not in named
    ]
    return [
        (
            str(p.relative_to(root)),
            f"{read_file(p).format}: {', '.join(list(read_file(p).arrays)[:4])}",
        )
        for p in others
    ]


def text(values: Sequence[float]) -> str:
    """Frequencies in four digits."""
    return ", ".join(f"{value:.4g}" for value in values)


def main() -> int:
    """Print the table; the exit status says whether every stated frequency was met within 1 %."""
    root = data_root()
    if root is None:
        print(
            "CVXUPDATE_DATA does not name a folder: put the data sets there (README.md says "
            "where they are published).",
            file=sys.stderr,
        )
        return 2
    table = rows()
    print(
        "| data set | recording | channels, rate | first frequencies found (Hz) | README "
        "(Hz) | largest deviation |\n|---|---|---|---|---|---|"
    )
    for row in table:
        deviation = "" if not row.stated else f"{row.deviation:.2f} %"
        print(
            f"| {row.data} | {row.recording} | {row.size} | {text(row.found)} | "
            f"{text(row.stated)} | {deviation} |"
        )
    for name, what in unread(root):
        print(f"| {name.split('/')[0]} | {name.split('/', 1)[1]} | not a recording; {what} | | | |")
    bad = [row for row in table if row.stated and not row.deviation <= 1.0]
    print(
        f"\n{len(table)} recordings, {sum(bool(row.stated) for row in table)} with stated "
        f"frequencies, {len(bad)} off by more than 1 %."
    )
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
