"""A diagnosis in words: verdicts, figures with their units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from cvxupdate.report.numbers import number, prefix_of, with_deviation

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis

VERDICTS = {
    "missing_physics": ("fair", "The model leaves out a piece of physics"),
    "parameter_error": ("fair", "The model has the right physics and a wrong number"),
    "consistent": ("good", "Model and recordings agree"),
    "undetermined": ("bad", "Model and recordings disagree, and the reason is not determined"),
}
"""Verdict → (tone, what it means)."""
AT_FAULT = "The measurement is at fault, not the model"
ALSO_AT_FAULT = "The model leaves out a piece of physics, and the measurement has a fault"
MEASUREMENT = "sensor_fault"

UNITS = {
    "m": "kg",
    "k": "N/m",
    "c": "N·s/m",
    "N": "N",
    "alpha": "1/s",
    "delay": "s",
    "omega": "rad/s",
    "k3": "N/m³",
    "even": "N/m²",
    "gap": "m",
    "force": "N",
    "c2": "N·s²/m²",
    "kr": "N·m/rad",
    "J": "kg·m²",
}


def verdict_words(found: Diagnosis) -> tuple[str, str]:
    """(tone, what the verdict means): a fault of the measurement is no physics of the model."""
    tone, meaning = VERDICTS[found.verdict]
    faults = [f.physics == MEASUREMENT for f in found.findings]
    if found.verdict != "missing_physics" or not any(faults):
        return tone, meaning
    return tone, AT_FAULT if all(faults) else ALSO_AT_FAULT


def capital(text: str) -> str:
    """With a capital first."""
    return text[:1].upper() + text[1:]


def label_words(label: str) -> str:
    """``n3.x`` as "at node 3 (x)"."""
    node, _, dof = label.partition(".")
    return f"at node {node[1:]} ({dof})"


def unit_of(parameter: str, dof: str | None) -> str:
    """The unit of a finding's parameter; a stiffness or a damper about an axis counts per
    radian."""
    turns = dof in ("rx", "ry", "rz")
    return (
        {"k": "N·m/rad", "c": "N·m·s/rad"}.get(parameter, UNITS.get(parameter, ""))
        if turns
        else UNITS.get(parameter, "")
    )


def values_words(
    parameters: Mapping[str, float], deviations: Mapping[str, float], physics: str, dof: str | None
) -> list[tuple[str, str]]:
    """(name, value ± standard deviation with unit) of a finding's parameters, with the prefix that
    its sentence has."""
    about = "ry" if physics == "joint_flexibility" and dof is None else dof
    out = []
    for name, value in parameters.items():
        factor, unit = prefix_of(unit_of(name, about).replace("·", "*"), value)
        deviation = deviations.get(name)
        scaled = None if deviation is None else deviation / factor
        out.append((name, f"{with_deviation(value / factor, scaled)} {unit}".strip()))
    return out


def fit_rows(found: Diagnosis) -> list[tuple[str, str, str]]:
    """(recordings, before, after): the normalised error of the response, or of the frequencies."""
    names = {"fit": "fitted", "hold_out": "held out"}
    return [
        (names.get(key, key), number(v.get("before"), 3), number(v.get("after"), 3))
        for key, v in found.fit.items()
        if v.get("before") is not None
    ]
