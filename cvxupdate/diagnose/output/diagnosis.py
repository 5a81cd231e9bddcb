"""The diagnosis in the contract's form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.acceptance import Weighed
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.output.rival_words import rival_titles
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.shown import Beside, Shown
from cvxupdate.diagnose.types import Errors
from cvxupdate.spec.write import Written

MOST = 40  # candidates listed that were only screened


@dataclass(frozen=True)
class Diagnosis:
    """The verdict with all that stands behind it; field names as in ``diagnosis.json``."""

    problem: str
    title: str
    path: str
    verdict: str
    says: str
    findings: tuple[Finding, ...]
    candidates: tuple[dict[str, Any], ...]
    fit: dict[str, dict[str, float | None]]
    metrics: dict[str, Any]
    evidence: tuple[str, ...]
    time: float
    details: dict[str, Any]
    updated: Written | None = None  # the diagnosed model as a problem file
    shown: Shown | None = None  # what the page draws
    refined: Written | None = None  # the updated model on a finer mesh, where that matters
    warnings: tuple[Doubt, ...] = ()  # what is probably a mistake in the problem
    beside: Beside | None = None  # the model before and after, beside the recordings
    by_modes: bool = False  # consistent by the modes in responses, which themselves differ

    def to_json(self) -> dict[str, Any]:
        """The whole of ``diagnosis.json``."""
        return {
            "problem": self.problem,
            "title": self.title,
            "verdict": self.verdict,
            "says": self.says,
            "findings": [f.to_json() for f in self.findings],
            "candidates": list(self.candidates),
            "fit": self.fit,
            "metrics": self.metrics,
            "evidence": list(self.evidence),
            "warnings": [asdict(w) for w in self.warnings],
            "time": self.time,
            **self.details,
            **({} if self.beside is None else self.beside.to_json()),
        }


def finite(x: float) -> float | None:
    """A number as `diagnosis.json` has it: None where it is not known."""
    return float(x) if isfinite(x) else None


def fit_table(judgement: Judgement) -> dict[str, dict[str, float | None]]:
    """The contract's errors before and after; and, by the measure that judgement goes by, with
    nuisance parameters alone and of noise alone."""
    evidence = judgement.case.evidence
    before, after = evidence.stated(judgement.last.fit)
    columns: dict[str, Errors] = {
        "before": before,
        "nuisance": judgement.case.base.errors,
        "after": after,
        "noise": evidence.noise,
    }
    return {
        key: {name: finite(getattr(errors, key)) for name, errors in columns.items()}
        for key in ("fit", "hold_out")
    }


def details_of(judgement: Judgement, found: Found, sought: Sequence[str]) -> dict[str, Any]:
    """Misfits, what the confidence in each effect rests on and is shared with, which effects were
    ``sought`` and tried; by how many hypotheses, of which none can be claimed, all is explained."""
    last = judgement.last
    out: dict[str, Any] = {
        "method": f"output error of {judgement.case.evidence.told_by}, trust-region convex steps",
        "misfit": {"nuisance": judgement.case.base.fit.misfit, "after": last.fit.misfit},
        "sought": list(sought),
        "tried": tried(found),
    }
    if judgement.findings:
        out["rivals"] = rival_titles(judgement)
    elif judgement.tied and judgement.case.evidence.clear(judgement.tied[0].fit):
        out["explained_by"] = len(judgement.tied)
    if judgement.graded is not None:
        out["graded"] = judgement.graded.to_json()
    if last.hypothesis.effects:
        out["standing"] = [
            {"name": e.name, **s.to_json()}
            for e, s in zip(last.hypothesis.effects, judgement.standings, strict=True)
        ]
    return out


def tried(found: Found) -> dict[str, float | None]:
    """The fraction of the mismatch that each type of effect explains at its best place, by itself:
    to first order, or refitted; None where only finite sizes tell, and none was worth a refit."""
    out: dict[str, float | None] = {s.effect.physics: None for s in found.scores}
    known = [(s.effect.physics, s.fraction) for s in found.scores if s.trusted]
    for h, left in found.entries:
        known += [(e.physics, 1.0 - left) for e in h.effects if len(h.effects) == 1]
    for name, fraction in known:
        if fraction > (out.get(name) or 0.0):
            out[name] = float(fraction)
    return out


def candidates_table(judgement: Judgement, found: Found) -> tuple[dict[str, Any], ...]:
    """Refitted ones with their errors (several effects after single ones, each naming those
    beside it), then what was only screened."""
    out: list[dict[str, Any]] = []
    for number, w in enumerate((*judgement.singles, *judgement.several)):
        out += _rows(w, found, number)
    listed = {e.key for w in judgement.singles for e in w.hypothesis.effects}
    out += [
        {
            "physics": s.effect.physics,
            "title": s.effect.title,
            "location": s.effect.place.to_json(),
            "score": None,
            "hold_out_score": None,
            "explained_fraction": s.fraction,
            "stability": found.stable.get(s.effect.key),
        }
        for s in found.scores[:MOST]
        if s.effect.key not in listed
    ]
    return tuple(out)


def _rows(w: Weighed, found: Found, number: int) -> list[dict[str, Any]]:
    h: Hypothesis = w.hypothesis
    out = []
    for k, (effect, figures) in enumerate(zip(h.effects, h.figures, strict=True)):
        others: Sequence[str] = [e.name for i, e in enumerate(h.effects) if i != k]
        row = {
            "physics": effect.physics,
            "title": effect.title,
            "location": effect.place.to_json(),
            "score": finite(w.errors.fit),
            "hold_out_score": finite(w.errors.hold_out),
            "misfit": finite(w.fit.misfit),
            "parameters": figures.values,
            "stability": found.stable.get(effect.key),
        }
        beside = {"beside": ", ".join(others), "set": number} if others else {}
        out.append({**row, **beside})
    return out
