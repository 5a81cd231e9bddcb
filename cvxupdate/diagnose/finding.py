"""Findings in the contract's form, and the sentences that go with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from cvxupdate.diagnose.curves import Shown
from cvxupdate.physics import told
from cvxupdate.physics.place import Place


@dataclass(frozen=True)
class Finding:
    """One piece of physics, where, how large, how sure, and what the recordings cannot tell from
    it; ``title`` is "an added mass at node 5 (x)"."""

    physics: str
    place: Place
    parameters: Mapping[str, float]
    deviations: Mapping[str, float]
    confidence: float
    equivalent: tuple[tuple[str, Place], ...]
    says: str
    title: str

    @property
    def alternatives(self) -> tuple[str, ...]:
        """Titles of what the recordings cannot tell from it."""
        return tuple(told(name, place).title for name, place in self.equivalent)

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of ``findings``."""
        return {
            "physics": self.physics,
            "location": self.place.to_json(),
            "parameters": dict(self.parameters),
            "standard_deviation": dict(self.deviations),
            "confidence": self.confidence,
            "equivalent": [{"physics": w, "location": p.to_json()} for w, p in self.equivalent],
            "says": self.says,
        }


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
    updated: str | None = (
        None  # the diagnosed model as a problem file (`cvxupdate.diagnose.export`)
    )
    shown: Shown | None = None  # what the page draws (`cvxupdate.diagnose.curves`)
    refined: str | None = (
        # the updated model on a finer mesh, where that makes a difference
        # (`cvxupdate.diagnose.refine`)
        None
    )

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
            "time": self.time,
            **self.details,
        }


def finite(x: float) -> float | None:
    """A number as `diagnosis.json` has it: None where it is not known."""
    return float(x) if isfinite(x) else None
