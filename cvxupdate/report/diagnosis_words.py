"""A diagnosis in words: verdicts, places, figures with their units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import number, with_deviation

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.physics.effect import Effect

VERDICTS = {
    "missing_physics": ("fair", "The model leaves out a piece of physics"),
    "parameter_error": ("fair", "The model has the right physics and a wrong number"),
    "consistent": ("good", "Model and recordings agree"),
    "undetermined": ("bad", "Model and recordings disagree, and the reason is not determined"),
}
"""Verdict → (tone, what it means)."""

UNITS = {
    "m": "kg",
    "k": "N/m",
    "c": "N·s/m",
    "N": "N",
    "alpha": "1/s",
    "delay": "s",
    "omega": "rad/s",
    "k3": "N/m³",
    "gap": "m",
    "force": "N",
    "c2": "N·s²/m²",
}
MOST_NAMED = 12
"""Elements named in a place at most."""


def physics_words(word: str) -> str:
    """``added_mass`` as "added mass"."""
    return word.replace("_", " ")


def label_words(label: str) -> str:
    """``n3.x`` as "at node 3 (x)"."""
    node, _, dof = label.partition(".")
    return f"at node {node[1:]} ({dof})"


def place_words(location: Mapping[str, Any]) -> str:
    """A location of the contract in words."""
    nodes, elements, groups = (list(location.get(k) or ()) for k in ("nodes", "elements", "groups"))
    dof = location.get("dof")
    parts = []
    if groups:
        parts.append(
            ("group " if len(groups) == 1 else "groups ") + ", ".join(str(g) for g in groups)
        )
    elif elements:
        parts.append(
            ("element " if len(elements) == 1 else "elements ")
            + ", ".join(str(e) for e in elements[:MOST_NAMED])
            + (f" and {len(elements) - MOST_NAMED} more" if len(elements) > MOST_NAMED else "")
        )
    if nodes:
        parts.append(
            f"node {nodes[0]}"
            if len(nodes) == 1
            else "between nodes " + " and ".join(str(n) for n in nodes)
        )
    return (" at ".join(parts) or "the whole structure") + (f", {dof}" if dof else "")


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
    """(name, value ± standard deviation with unit) of a finding's parameters."""
    about = "ry" if physics == "joint_flexibility" and dof is None else dof
    return [
        (name, f"{with_deviation(value, deviations.get(name))} {unit_of(name, about)}".strip())
        for name, value in parameters.items()
    ]


def fit_rows(found: Diagnosis) -> list[tuple[str, str, str]]:
    """(recordings, before, after): the normalised error of the response, or of the frequencies."""
    names = {"fit": "fitted", "hold_out": "held out"}
    return [
        (names.get(key, key), number(v.get("before"), 3), number(v.get("after"), 3))
        for key, v in found.fit.items()
        if v.get("before") is not None
    ]


def equivalents(effects: Sequence[Effect]) -> list[str]:
    """What the recordings cannot tell from a finding, one line each."""
    return [e.title for e in effects]
