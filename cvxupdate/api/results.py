"""What the commands give back to a program: data, models, tables, figures, files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cvxupdate import study
from cvxupdate.api.model import Model
from cvxupdate.api.result import Result, Rows, moved
from cvxupdate.api.shown import (
    card,
    finding_row,
    fit_rows,
    fit_words,
    parameter_row,
    sizes,
)
from cvxupdate.errors import InputError
from cvxupdate.report.files import write_files
from cvxupdate.spec import Spec

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Compared, FrfComparison
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.update.result import Updated

FIT_HEAD = ("", "before", "after")


class CorrelateResult(Result):
    """A model beside its recordings, nothing changed. Fields: ``modes``, ``shapes``, ``frfs``,
    ``sensors``, ``fit``, ``notes``, ``warnings`` (see `cvxupdate.correlate.result.Compared`)."""

    data: Compared

    def to_dataframe(self, which: str = "modes") -> Any:
        """``"modes"``: the pairs; ``"mac"``: MAC of every pair of shapes; ``"frfs"``: error and
        FRAC of every frequency response."""
        return self._frame({"modes": self._pairs, "mac": self._mac, "frfs": self._frfs}, which)

    def _pairs(self) -> Rows:
        return [asdict(m) for m in self.data.modes]

    def _mac(self) -> Rows:
        return [
            {
                "recording": s.recording,
                "model": float(s.model_frequency[i]),
                "measured": float(s.measured_frequency[j]),
                "mac": float(s.correlation.mac[i, j]),
            }
            for s in self.data.shapes
            for i in range(s.correlation.mac.shape[0])
            for j in range(s.correlation.mac.shape[1])
        ]

    def _frfs(self) -> Rows:
        return [
            {
                "recording": f.recording,
                "use": f.use,
                "response": response,
                "reference": reference,
                "error": float(f.correlation.error[i, j]),
                "frac": float(f.correlation.frac[i, j]),
            }
            for f in self.data.frfs
            for i, response in enumerate(f.responses)
            for j, reference in enumerate(f.references)
        ]

    def plot_mac(self, recording: int = 0) -> Any:
        """MAC of model and measured shapes of one recording, as a matplotlib figure."""
        from cvxupdate.report.plots import mac_figure

        found = _one(self.data.shapes, recording, "shapes")
        return mac_figure(found.correlation.mac, found.model_frequency, found.measured_frequency)

    def plot_frequencies(self) -> Any:
        """Model over measured frequencies, as a matplotlib figure."""
        from cvxupdate.report.plots import frequency_figure

        pairs = self.data.modes
        if not pairs:
            raise InputError("no modes were compared, so there is nothing to draw.")
        return frequency_figure([m.measured for m in pairs], {"model": [m.model for m in pairs]})

    def plot_frf(self, recording: int = 0, response: str = "", reference: str = "") -> Any:
        """Measured and model responses, as a matplotlib figure: all (six at most), or those of one
        ``response`` or ``reference`` ("n4.z")."""
        from cvxupdate.report.plots import overlay_figure

        found = _one(self.data.frfs, recording, "frequency responses")
        return overlay_figure(found, {"model": found.model}, response, reference)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write result.json and report.html, as `cvxupdate correlate` does."""
        from cvxupdate.report import correlate_files

        write_files(Path(folder), correlate_files(self.data)[0])
        return Path(folder)

    def __repr__(self) -> str:
        pairs, curves = len(self.data.modes), len(self.data.frfs)
        return f"CorrelateResult({pairs} pairs of modes, {curves} recordings of responses)"

    def _repr_html_(self) -> str:
        rows = [(name, after) for name, _, after in fit_rows(self.data.fit)]
        return card("Model and recordings", self.data.notes, ("", "model as it is"), rows)


class UpdateResult(Result):
    """An updated model. Fields: ``status``, ``reason``, ``parameters``, ``fit``, ``modes``,
    ``history``, ``certificate``, ``caveats``, ``warnings`` … (see
    `cvxupdate.update.result.Updated`, whose ``model`` is ``facts`` here)."""

    data: Updated

    @property
    def facts(self) -> dict[str, Any]:
        """What `result.json` says of the model."""
        return self.data.model

    @cached_property
    def model(self) -> Model | None:
        """The updated model; None where the step was infeasible."""
        return self._model(self.data.written)

    @cached_property
    def before(self) -> CorrelateResult:
        """The model as it came, beside the recordings."""
        return CorrelateResult(study.correlate(self.spec), self.spec, self._keep)

    @cached_property
    def after(self) -> CorrelateResult:
        """The updated model beside the recordings."""
        return _after(self._rebuilt(self.data.written), self._keep)

    def to_dataframe(self, which: str = "parameters") -> Any:
        """``"parameters"``, ``"modes"`` or ``"history"`` of the iteration."""
        tables = {
            "parameters": lambda: [asdict(q) for q in self.data.parameters],
            "modes": lambda: [asdict(m) for m in self.data.modes],
            "history": lambda: [dict(h) for h in self.data.history],
        }
        return self._frame(tables, which)

    def plot_parameters(self) -> Any:
        """Changes of the parameters with two standard deviations, as a matplotlib figure."""
        from cvxupdate.report.plots import parameter_figure

        return parameter_figure([(q.name, q.p, q.p_std) for q in self.data.parameters])

    def plot_frequencies(self) -> Any:
        """Model over measured frequencies before and after, as a matplotlib figure."""
        from cvxupdate.report.plots import frequency_figure

        m = self.data.modes
        if not m:
            raise InputError("no modes were fitted, so there is nothing to draw. Try plot_frf.")
        both = {"before": [x.before for x in m], "after": [x.after for x in m]}
        return frequency_figure([x.measured for x in m], both)

    def plot_frf(self, recording: int = 0, response: str = "", reference: str = "") -> Any:
        """Measured responses with the model's before and after, as a matplotlib figure."""
        return _both(self.before, self.after, recording, response, reference)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write result.json, report.html and updated/problem.toml, as `cvxupdate run` does."""
        from cvxupdate.report import run_files

        place = Path(folder)
        written = moved(self.data.written, place)
        files, _ = run_files(replace(self.data, written=written), place)
        write_files(place, files, ("updated/problem.toml",))
        return place

    def __repr__(self) -> str:
        n = len(self.data.parameters)
        return (
            f"UpdateResult({self.data.status}, {n} parameters, {self.data.iterations} iterations"
            f"{fit_words(self.data.fit)})"
        )

    def _repr_html_(self) -> str:
        rows = [*fit_rows(self.data.fit), *map(parameter_row, self.data.parameters)]
        says = (self.data.reason, *self.data.caveats)
        return card(f"Update: {self.data.status}", says, FIT_HEAD, rows)


class DiagnoseResult(Result):
    """What the recordings say that a model leaves out. Fields: ``verdict``, ``says``,
    ``findings``, ``evidence``, ``candidates``, ``fit``, ``metrics`` … (see
    `cvxupdate.diagnose.output.diagnosis.Diagnosis`)."""

    data: Diagnosis

    @cached_property
    def model(self) -> Model | None:
        """The model with what was found; None where nothing was, or it cannot be written."""
        return self._model(self.data.updated)

    @cached_property
    def before(self) -> CorrelateResult:
        """The model as it came, beside the recordings."""
        return CorrelateResult(study.correlate(self.spec), self.spec, self._keep)

    @cached_property
    def after(self) -> CorrelateResult:
        """The model with what was found beside the recordings."""
        return _after(self._rebuilt(self.data.updated), self._keep)

    def to_dataframe(self, which: str = "findings") -> Any:
        """``"findings"``, or the ``"candidates"`` that were tried."""
        tables = {
            "findings": lambda: [finding_row(f) for f in self.data.findings],
            "candidates": lambda: [dict(c) for c in self.data.candidates],
        }
        return self._frame(tables, which)

    def plot_frf(self, recording: int = 0, response: str = "", reference: str = "") -> Any:
        """Measured responses with the model's before and after, as a matplotlib figure."""
        return _both(self.before, self.after, recording, response, reference)

    def plot_frequencies(self) -> Any:
        """Model over measured frequencies before and after, as a matplotlib figure."""
        from cvxupdate.report.plots import frequency_figure

        was = {(m.recording, m.number): m for m in self.before.data.modes}
        now = {(m.recording, m.number): m for m in self.after.data.modes}
        both = [k for k in was if k in now]
        if not both:
            raise InputError("no modes were compared, so there is nothing to draw. Try plot_frf.")
        curves = {
            "before": [was[k].model for k in both],
            "after": [now[k].model for k in both],
        }
        return frequency_figure([was[k].measured for k in both], curves)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write diagnosis.json, report.html and the updated problems, as `cvxupdate diagnose`
        does."""
        from cvxupdate.report.diagnosis import diagnosis_files

        place = Path(folder)
        updated, refined = (moved(w, place) for w in (self.data.updated, self.data.refined))
        found = replace(self.data, updated=updated, refined=refined)
        files, _ = diagnosis_files(found, self.spec, place)
        write_files(place, files, ("updated/problem.toml", "updated/refined.toml"))
        return place

    def __repr__(self) -> str:
        found = "; ".join(f"{f.title} ({f.confidence:.0%})" for f in self.data.findings[:3])
        return f"DiagnoseResult({self.data.verdict}{': ' + found if found else ''})"

    def _repr_html_(self) -> str:
        rows = [(f.title, sizes(f), f"{f.confidence:.0%}") for f in self.data.findings]
        return card(self.data.says, (), ("found", "size", "confidence"), rows)


def _one(items: Sequence[Any], number: int, what: str) -> Any:
    if not isinstance(number, int) or not 0 <= number < len(items):
        raise InputError(
            f"{what}: there is no recording {number} with {what}; there are {len(items)}."
        )
    return items[number]


def _after(spec: Spec | None, keep: Any) -> CorrelateResult:
    if spec is None:
        raise InputError("there is no updated model to compare with the recordings.")
    return CorrelateResult(study.correlate(spec), spec, keep)


def _both(
    before: CorrelateResult, after: CorrelateResult, recording: int, response: str, reference: str
) -> Any:
    from cvxupdate.report.plots import overlay_figure

    was: FrfComparison = _one(before.data.frfs, recording, "frequency responses")
    now: FrfComparison = _one(after.data.frfs, recording, "frequency responses")
    return overlay_figure(was, {"before": was.model, "after": now.model}, response, reference)
