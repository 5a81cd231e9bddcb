"""What `identify` and `plan` give back to a program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.api.modes import Modes
from cvxupdate.api.result import Result, Rows
from cvxupdate.api.shared import counted
from cvxupdate.api.shown import card, figure
from cvxupdate.errors import InputError
from cvxupdate.report.files import write_files

if TYPE_CHECKING:
    from cvxupdate.commands.identified import Identified, ModeSetResult
    from cvxupdate.commands.planned import Planned

SHOWN = 5  # frequencies or places in a prompt's line


class IdentifyResult(Result):
    """Modes of recordings. Fields: ``sets`` (one for each recording), ``notes``, ``skipped`` (see
    `cvxupdate.commands.identified.Identified`)."""

    data: Identified

    def __init__(self, data: Identified, keep: Any = None) -> None:
        self.data, self._keep = data, keep

    def modes(self, recording: int = 0) -> Modes:
        """The modes of one recording, with their deviations, as `update` and `diagnose` take
        them."""
        s = self._set(recording)
        rows = [k for k, label in enumerate(s.labels) if s.dofs[k] and "(" not in label]
        std = np.sqrt(np.mean(np.asarray(s.shape_std)[:, rows or [0]] ** 2, axis=1))
        whole = rows and np.all(np.isfinite(std)) and np.all(std > 0.0)
        return Modes(
            s.frequency,
            s.shapes[:, rows].T if rows else None,
            [s.labels[k] for k in rows] if rows else None,
            damping=_known([m.damping for m in s.modes], zero=True),
            frequency_std=_known([m.frequency_std for m in s.modes]),
            damping_std=_known([m.damping_std for m in s.modes]),
            shape_std=np.tile(std, (len(rows), 1)) if whole else None,
            name=s.recording,
        )

    def to_dataframe(self, which: str = "modes") -> Any:
        """``"modes"`` of all recordings, or the ``"poles"`` of their stabilisation diagrams."""
        return self._frame({"modes": self._modes, "poles": self._poles}, which)

    def _modes(self) -> Rows:
        return [
            {"recording": s.recording, "mode": k, **vars(m)}
            for s in self.data.sets
            for k, m in enumerate(s.modes, start=1)
        ]

    def _poles(self) -> Rows:
        return [
            {
                "recording": s.recording,
                "order": int(d.order[k]),
                "frequency": float(d.frequency[k]),
                "damping": float(d.damping[k]),
                "stable": bool(d.stable[k]),
            }
            for s in self.data.sets
            if (d := s.diagram) is not None
            for k in range(len(d.order))
        ]

    def plot_stabilisation(self, recording: int = 0) -> Any:
        """Poles of every model order over frequency, and the modes that were kept, as a matplotlib
        figure."""
        from cvxupdate.report.measuring_plots import stabilisation_figure

        s = self._set(recording)
        if s.diagram is None:
            raise InputError(f"{s.recording}: {s.method} makes no stabilisation diagram.")
        return stabilisation_figure(s)

    def plot_frf(self, recording: int = 0) -> Any:
        """Measured responses with those synthesised from the modes, as a matplotlib figure."""
        from cvxupdate.report.measuring_plots import synthesis_figure

        s = self._set(recording)
        if s.fit is None:
            raise InputError(f"{s.recording}: {s.method} synthesises no frequency responses.")
        return synthesis_figure(s.fit)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write the tables of modes, recordings.toml, result.json and report.html, as `cvxupdate
        identify` does."""
        from cvxupdate.report.identify_files import identify_files

        write_files(Path(folder), identify_files(self.data)[0])
        return Path(folder)

    def _set(self, recording: int) -> ModeSetResult:
        if not isinstance(recording, int) or not 0 <= recording < len(self.data.sets):
            raise InputError(
                f"there is no recording {recording}; {len(self.data.sets)} of them gave modes."
            )
        return self.data.sets[recording]

    def __repr__(self) -> str:
        told = "; ".join(f"{s.recording}: {_listed(s.frequency)}" for s in self.data.sets[:3])
        return f"IdentifyResult({told})"

    def _repr_html_(self) -> str:
        rows = [
            (f"{m.frequency:.5g} ± {figure(m.frequency_std)}", figure(100.0 * m.damping))
            for s in self.data.sets
            for m in s.modes
        ]
        says = (*self.data.notes, *self.data.skipped)
        return card("Modes", says, ("frequency (Hz)", "damping (%)"), rows)


class PlanResult(Result):
    """What to measure. Fields: ``sensors`` (by every rule; the first is proposed), ``exciters``,
    ``lines``, ``frequencies``, ``parameters``, ``notes`` (see
    `cvxupdate.commands.planned.Planned`)."""

    data: Planned

    def __init__(self, data: Planned, keep: Any = None) -> None:
        self.data, self._keep = data, keep

    def to_dataframe(self, which: str = "places") -> Any:
        """``"places"`` to mount and to drive, the ``"sensors"`` by every rule, the ``"lines"`` by
        every rule, or the deviations of the ``"parameters"`` with the lines of every rule."""
        tables = {
            "places": self._places,
            "sensors": lambda: [dict(vars(s)) for s in self.data.sensors],
            "lines": self._lines,
            "parameters": self._parameters,
        }
        return self._frame(tables, which)

    def _places(self) -> Rows:
        chosen = ("sensor", self.data.sensors[0].labels), ("exciter", self.data.exciters.labels)
        return [
            {"kind": kind, "order": k, "place": label}
            for kind, labels in chosen
            for k, label in enumerate(labels, start=1)
        ]

    def _lines(self) -> Rows:
        return [
            {"rule": x.rule, "frequency": f, "bears": x.bears}
            for x in self.data.lines
            for f in x.lines
        ]

    def _parameters(self) -> Rows:
        return [
            {"parameter": name, **{x.rule: x.deviations[k] for x in self.data.lines}}
            for k, name in enumerate(self.data.parameters)
        ]

    def plot_places(self) -> Any:
        """Sensors and exciters on the structure, as a matplotlib figure; needs coordinates."""
        from cvxupdate.report.measuring_plots import places_figure

        if self.data.geometry is None:
            raise InputError("the model has no coordinates to draw. Give nodes.")
        return places_figure(
            self.data.geometry, self.data.sensors[0].labels, self.data.exciters.labels
        )

    def plot_indicator(self) -> Any:
        """The mode indicator of the responses to come, as a matplotlib figure."""
        from cvxupdate.report.measuring_plots import indicator_figure

        return indicator_figure(self.data)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write plan.csv, result.json and report.html, as `cvxupdate plan` does."""
        from cvxupdate.report.plan_page import plan_files

        write_files(Path(folder), plan_files(self.data)[0])
        return Path(folder)

    def __repr__(self) -> str:
        first, driven = self.data.sensors[0].labels, self.data.exciters.labels
        return (
            f"PlanResult({counted(len(first), 'sensor')}: {_named(first)}; "
            f"{counted(len(driven), 'exciter')}: {_named(driven)})"
        )

    def _repr_html_(self) -> str:
        rows = [(row["kind"], str(row["order"]), row["place"]) for row in self._places()]
        return card("What to measure", self.data.notes, ("", "order", "place"), rows)


def _known(values: Sequence[float], zero: bool = False) -> Any:
    """The values, None where one is unknown (or not above zero, which is no deviation)."""
    given = np.asarray(values, dtype=float)
    good = np.isfinite(given) & ((given >= 0.0) if zero else (given > 0.0))
    return given if np.all(good) else None


def _listed(frequencies: Any) -> str:
    shown = ", ".join(f"{f:.4g}" for f in frequencies[:SHOWN])
    more = ", …" if len(frequencies) > SHOWN else ""
    return f"{counted(len(frequencies), 'mode')}: {shown}{more} Hz"


def _named(labels: Sequence[str]) -> str:
    return ", ".join(labels[:SHOWN]) + (", …" if len(labels) > SHOWN else "")
