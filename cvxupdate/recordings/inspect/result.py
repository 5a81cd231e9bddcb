"""What an inspection finds, and how it is printed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.lines import Line
from cvxupdate.recordings.quality.finding import Finding

_ROWS = {"frf": "lines", "time": "samples"}


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

    def text(self) -> str:
        """One line for a terminal."""
        faults = [
            f"{n} {what}"
            for n, what in (
                (self.missing, "missing"),
                (self.clipped, "clipped"),
                (self.dropped, "in drop-outs"),
            )
            if n
        ]
        lines = ", ".join(f"{line.frequency:.4g}" for line in self.lines[:5])
        return (
            f"  {self.name}{' [' + self.unit + ']' if self.unit else ''}"
            f"{' at ' + self.place if self.place else ''}: "
            f"{self.quantity}, "
            + (
                f"r.m.s. {self.rms:.4g}, mean {self.mean:.3g}, "
                f"{self.least:.4g} to {self.largest:.4g}"
                if self.rms == self.rms
                else "without a single number"
            )
            + (f"; lines at {lines} Hz" if lines else "")
            + (f"; {', '.join(faults)}" if faults else "")
        )


@dataclass(frozen=True)
class Inspection:
    """A file as found: ``kind`` "time", "frf", "modes" or "arrays"; ``rate`` Hz (NaN unknown);
    ``length`` samples or lines; ``block`` a [[recordings]] table ready to be completed (node
    numbers are for the user to fill in)."""

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
        """The inspection as printed on a terminal."""
        head = f"{self.file}: {self.format}, {self.kind}, {self.length} "
        head += _ROWS.get(self.kind, "rows")
        if self.kind == "time" and np.isfinite(self.rate):
            head += f", {self.rate:.7g} Hz, {self.length / self.rate:.4g} s"
        return "\n".join(
            [
                head,
                *(c.text() for c in self.channels),
                *(f"  note: {note}" for note in self.notes),
                *(f"  {finding.check}: {finding.says}" for finding in self.findings),
                "",
                self.block,
            ]
        )
