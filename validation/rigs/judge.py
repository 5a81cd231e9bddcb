"""A diagnosis beside its truth: what each finding says of what is concealed, of the rig, of the
specimen; whether it is wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]
Grade = Callable[[Row, Row, Mapping[str, Sequence[int]]], str | None]
RIGHT, PART = "right", "part"
GOOD = (RIGHT, PART)
STATED = 0.5  # a wrong finding with at least this confidence is what must not be said
CLAIMS = ("missing_physics", "parameter_error")
SCATTER = 0.015  # a group's factor that agrees this well with its material is true
MOST = 0.08  # usual scatter goes no further


def judged(said: Row, truth: Row, grade: Grade | None = None) -> dict[str, Any]:
    """Each finding with its ``status`` (concealed, rig, besides, scatter, wrong), ``grade`` (right,
    part) and whether its size is right; each concealed effect with how it was named.

    A finding is graded by the best that it can be: the word of a truth, or other words for it, at
    its place (right) or beside it (part). The same effect named again in other words is not wrong.
    ``grade`` is how a laboratory compares a finding with a truth (`graded`).
    """
    compare = grade or graded
    claimed = list(said.get("findings", ())) if said.get("verdict") in CLAIMS else []
    findings = [_finding(f, truth, compare) for f in claimed]
    effects = []
    for i, effect in enumerate(truth.get("findings", ())):
        mine = [f for f in findings if f["status"] == "concealed" and f["effect"] == i]
        best = max(mine, key=lambda f: (f["grade"] == RIGHT, f["confidence"]), default=None)
        effects.append(
            {
                "physics": effect["physics"],
                "visible": effect["visible"],
                "margin": effect["margin"],
                "named": None if best is None else best["grade"],
                "confidence": None if best is None else best["confidence"],
                "size": next((f["size"] for f in mine if f["size"] is not None), None),
            }
        )
    wrong = [f for f in findings if f["status"] == "wrong"]
    return {
        "family": truth["family"],
        "recording": truth["recording"],
        "verdict": said.get("verdict", ""),
        "right_verdict": said.get("verdict") in truth["accept"],
        "says": said.get("says", ""),
        "findings": findings,
        "effects": effects,
        "wrong": any(f["confidence"] >= STATED for f in wrong),
        "wrong_at_all": bool(wrong),
        "truth": "; ".join(_told(e) for e in truth.get("findings", ())) or "nothing",
        "rig": "; ".join(_told(e) for e in truth.get("rig", ())),
    }


def _finding(f: Row, truth: Row, compare: Grade) -> dict[str, Any]:
    groups = truth.get("groups", {})
    status, index, grade = "wrong", None, None
    for kind, name in (("findings", "concealed"), ("rig", "rig"), ("besides", "besides")):
        grades = [compare(f, t, groups) for t in truth.get(kind, ())]
        best = next((g for g in GOOD if g in grades), None)
        if best is not None and (grade is None or (best == RIGHT and grade == PART)):
            status, index, grade = name, grades.index(best), best
    if grade is None and (material(f, truth) or channel(f, truth)):
        status = "scatter"
    exact = (
        truth["findings"][index]
        if status == "concealed" and index is not None
        else {"physics": None, "parameters": ()}
    )
    return {
        "physics": f["physics"],
        "location": f["location"],
        "parameters": f["parameters"],
        "deviation": f.get("standard_deviation", {}),
        "confidence": f["confidence"],
        "status": status,
        "effect": index,
        "grade": grade,
        "size": sized(f, exact) if f["physics"] == exact["physics"] else None,
        "among": any(
            compare({**f, **q}, t, groups)
            for q in f.get("equivalent", ())
            for t in (*truth.get("findings", ()), *truth.get("rig", ()))
        ),
        "says": f["says"],
    }


def graded(f: Row, truth: Row, groups: Mapping[str, Sequence[int]]) -> str | None:
    """How well a finding names a truth: right, part, or not at all."""
    grades = []
    if f["physics"] == truth["physics"]:
        grades.append(placed(f["location"], truth["location"], truth.get("near", {}), groups))
    for other in truth.get("also", ()):
        if f["physics"] == other["physics"]:
            where = placed(f["location"], other["location"], truth.get("near", {}), groups)
            grades.append(PART if where == RIGHT and other["grade"] == PART else where)
    return next((g for g in GOOD if g in grades), None)


def placed(
    found: Row, true: Row, near: Mapping[str, Sequence[int]], groups: Mapping[str, Sequence[int]]
) -> str | None:
    """Exact or overlapping: right; beside it: part. Of elements named at least half must be true
    ones to be right; the other end of a true element is beside it. A group stands for its
    elements."""
    nodes, elements = set(found.get("nodes") or ()), set(found.get("elements") or ())
    names = set(found.get("groups") or ())
    if not elements:
        elements = {e for g in names for e in groups.get(g, ())}
    true_nodes, true_elements = set(true["nodes"]), set(true["elements"])
    if true.get("dof") and found.get("dof") and true["dof"] != found["dof"]:
        return None
    if not true_nodes and not true_elements:
        return RIGHT
    if names & set(true["groups"]) and true_elements <= elements:
        return RIGHT
    if nodes & true_nodes:
        return RIGHT
    if elements & true_elements:
        other_end = bool(nodes and true_nodes)
        some = len(elements & true_elements) < 0.5 * len(elements)
        return PART if other_end or some else RIGHT
    beside = nodes & set(near.get("nodes", ())), elements & set(near.get("elements", ()))
    if (true_nodes and beside[0]) or (beside[1] and len(beside[1]) >= 0.5 * len(elements)):
        return PART
    return None


def sized(f: Row, effect: Row) -> bool | None:
    """Whether all sizes are right; None where the truth has none."""
    rows = list(effect["parameters"])
    if not rows:
        return None
    return all(
        p["name"] in f["parameters"] and abs(f["parameters"][p["name"]] - p["value"]) <= p["within"]
        for p in rows
    )


def material(f: Row, truth: Row) -> bool:
    """Whether a factor on groups is what their material in fact has: true, and no effect."""
    words = {"stiffness_change": ("stiffness", "mass"), "mass_change": ("mass", "stiffness")}
    if f["physics"] not in words or "factor" not in f["parameters"]:
        return False
    factor, mine = f["parameters"]["factor"], set(f["location"].get("elements") or ())
    named = set(f["location"].get("groups") or ())
    groups = truth.get("groups", {})
    hit = [s for s in truth.get("scatter", ()) if s["group"] in named]
    hit = hit or [s for s in truth.get("scatter", ()) if mine & set(groups[s["group"]])]
    if not hit or abs(factor - 1.0) > MOST:
        return False
    own, other = words[f["physics"]]
    expected = [v for s in hit for v in (s[own], s[own] / s[other])]
    return any(abs(factor - v) <= SCATTER for v in expected)


def channel(f: Row, truth: Row) -> bool:
    """Whether a sensor's gain is what it in fact is."""
    gain = f["parameters"].get("gain")
    if f["physics"] != "sensor_fault" or gain is None:
        return False
    return any(
        s["node"] in f["location"]["nodes"] and abs(gain - s["gain"]) <= SCATTER
        for s in truth.get("sensors", ())
    )


def _told(effect: Row) -> str:
    where = effect["location"]
    place = ", ".join(
        f"{k} {' '.join(map(str, where[k][:6]))}{'…' if len(where[k]) > 6 else ''}"
        for k in ("nodes", "elements", "groups")
        if where[k]
    )
    sizes = ", ".join(f"{p['name']} {p['value']:.4g}" for p in effect["parameters"])
    return f"{effect['physics']} at {place} {where.get('dof', '')} ({sizes})".replace("  ", " ")
