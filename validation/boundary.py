"""The laboratory's structure under another boundary, as `cvxupdate plan` proposes it: a known mass,
a known spring to ground, a support taken away, hung free; in the drawing and on the bench alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from cvxupdate.diagnose.apart import Measurement
from validation.generated.cases import Case
from validation.generated.laboratory import Design, Element

KINDS = ("mass", "spring", "support", "free")
KNOWN = "known"  # group of what was put on


def under(case: Case, change: Measurement) -> Case | None:
    """The case under a change of the boundary; None where the laboratory cannot make it: a plate is
    clamped along whole edges."""
    held = case.design.held
    if change.kind == "mass" and change.node is not None:
        return _with(case, "mass", change.node, change.mass)
    if change.kind == "spring" and change.node is not None:
        return _with(case, "spring", change.node, change.stiffness, change.dof)
    if case.design.family == "plate":
        return None
    if change.kind == "support":
        held = tuple(h for h in held if h != (change.node, change.dof))
        return None if len(held) == len(case.design.held) else _held(case, held)
    return _held(case, ()) if change.kind == "free" else None


def _held(case: Case, held: tuple[tuple[int, str], ...]) -> Case:
    return replace(case, design=replace(case.design, held=held))


def _with(case: Case, kind: str, node: int, value: float, dof: str = "x") -> Case:
    design: Design = case.design
    number = 1 + max(e.id for e in design.elements)
    more = Element(number, kind, (node,), KNOWN, value, dof)
    drawn = replace(design, elements=(*design.elements, more))
    return replace(case, design=drawn, scatter={**case.scatter, number: (1.0, 1.0)})


def left_of(
    before: Sequence[Mapping[str, Any]], after: Sequence[Mapping[str, Any]]
) -> list[list[tuple[str, str]]]:
    """Of the findings of a first diagnosis that have equivalents, what a second one of the same
    structure under another boundary lists, too: (physics, place) each. Where that names none of
    them, it says nothing, and all are left."""
    again = {_name(q) for f in after for q in (f, *f["equivalent"])}
    out = []
    for f in before:
        if f["equivalent"]:
            listed = list(dict.fromkeys(_name(q) for q in (f, *f["equivalent"])))
            out.append([n for n in listed if n in again] or listed)
    return out


def _name(q: Mapping[str, Any]) -> tuple[str, str]:
    return q["physics"], q["place"]
