"""Findings in the contract's form, and the sentences that go with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cvxupdate.physics.base import Place

UNITS = {"m": "kg", "k": "N/m", "c": "N·s/m", "N": "N", "eta": "", "alpha": "1/s", "factor": "", "gain": "", "delay": "s", "kappa": "", "omega": "rad/s",
         "Dx": "", "Dy": "", "D1": "", "Dxy": "", "k3": "N/m³", "gap": "m", "force": "N", "c2": "N·s²/m²"}


@dataclass(frozen=True)
class Finding:
    """One piece of physics, where, how large, how sure, and what the recordings cannot tell from it."""

    physics: str
    place: Place
    parameters: Mapping[str, float]
    deviations: Mapping[str, float]
    confidence: float
    equivalent: tuple[tuple[str, Place], ...]
    says: str

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of ``findings``."""
        return {"physics": self.physics, "location": self.place.to_json(), "parameters": dict(self.parameters),
                "standard_deviation": dict(self.deviations), "confidence": self.confidence,
                "equivalent": [{"physics": w, "location": p.to_json()} for w, p in self.equivalent], "says": self.says}


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
    updated: str | None = None  # the diagnosed model as a problem file (`cvxupdate.diagnose.export`)

    def to_json(self) -> dict[str, Any]:
        """The whole of ``diagnosis.json``."""
        return {"problem": self.problem, "title": self.title, "verdict": self.verdict, "says": self.says, "findings": [f.to_json() for f in self.findings],
                "candidates": list(self.candidates), "fit": self.fit, "metrics": self.metrics, "evidence": list(self.evidence), "time": self.time,
                **self.details}


def where(place: Place) -> str:
    """A place in words."""
    if place.groups:
        return ("group " if len(place.groups) == 1 else "groups ") + " and ".join(f"'{g}'" for g in place.groups)
    if place.elements and place.nodes:
        return f"where element {place.elements[0]} meets node {place.nodes[0]}"
    if place.elements:
        ids = ", ".join(str(e) for e in place.elements[:12])
        return f"element {ids}" if len(place.elements) == 1 else f"elements {ids}"
    if place.nodes:
        along = f" ({place.dof})" if place.dof else ""
        return f"node {place.nodes[0]}{along}" if len(place.nodes) == 1 else f"between nodes {place.nodes[0]} and {place.nodes[1]}{along}"
    return "the whole structure"


def sentence(physics: str, place: Place, v: Mapping[str, float]) -> str:
    """One sentence that a technician understands."""
    at = where(place)

    def g(name: str) -> str:
        return f"{v[name]:.3g}"

    if physics in ("stiffness_change", "mass_change", "thickness_change"):
        thing = {"stiffness_change": "stiff", "mass_change": "heavy", "thickness_change": "thick"}[physics]
        change = 100.0 * (v["factor"] - 1.0)
        words = {"stiff": ("stiffer", "softer"), "heavy": ("heavier", "lighter"), "thick": ("thicker", "thinner")}
        more = words[thing][0 if change > 0 else 1]
        return f"In {at} the real structure is {abs(change):.3g} % {more} than modelled."
    if physics == "added_mass":
        if v["m"] < 0:
            return f"At {at} the real structure is {abs(v['m']):.3g} kg lighter than the model."
        return f"The real structure carries {g('m')} kg more than the model at {at}."
    if physics == "grounding_spring":
        turns = place.dof in ("rx", "ry", "rz")
        unit = "N·m/rad" if turns else "N/m"
        return f"At {at} the structure is held by a spring of {g('k')} {unit} that the model does not have (or holds rigidly)."
    if physics == "joint_flexibility":
        return f"The joint {at} gives way: it turns on a spring of {g('k')} N·m/rad, while the model joins it rigidly."
    if physics == "shear_deformation":
        return f"The bars of {at} are too stocky for the model: they also deform in shear."
    if physics == "axial_preload":
        return f"In {at} there is {'a tension' if v['N'] > 0 else 'a compression'} of {abs(v['N']):.3g} N that the model leaves out."
    if physics == "attached_resonator":
        f = (v["k"] / v["m"]) ** 0.5 / 6.283185307179586 if v["m"] > 0 and v["k"] > 0 else float("nan")
        return f"Something of {g('m')} kg swings on its own at {at}, tuned to {f:.4g} Hz (spring {g('k')} N/m), that the model does not know."
    if physics == "viscous_damper":
        return f"At {at} a damper of {g('c')} N·s/m takes energy out that the model does not have."
    if physics == "structural_damping":
        return f"The material of {at} loses energy (loss factor {g('eta')}) beyond the rest of the structure."
    if physics == "mass_proportional_damping":
        return f"Every mode decays faster by the same rate ({v['alpha'] / 2:.3g} 1/s): air, suspension, or an exponential window in the measurement."
    if physics == "orthotropy":
        return f"The plate of {at} is not equally stiff in all directions: factors Dx {g('Dx')}, Dy {g('Dy')}, Dxy {g('Dxy')}."
    if physics == "sensor_fault":
        return (f"The measurement, not the structure: the channel at {at} reads {g('gain')} times what it should." if "gain" in v
                else f"The measurement, not the structure: the channel at {at} lags by {g('delay')} s.")
    return f"{physics} at {at}."
