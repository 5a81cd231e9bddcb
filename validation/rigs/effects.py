"""What is concealed: the change on the bench, and what truth.toml says of it.

``also`` lists other words that describe the same thing: each with its place and whether naming it
is right or only part of the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.rigs.bench import Op
from validation.rigs.drawing import TRANSLATIONS, Drawing, Generator
from validation.rigs.families import between, figures

TOLERANCE = 0.15  # of a size: issue 14
LOOSE = 0.05  # of a member's own end stiffness: below it a joint is a hinge, whatever its size


@dataclass(frozen=True)
class Truth:
    """Something true of the bench that the drawing lacks. ``parameters``: name, value, and the
    absolute error that is still right."""

    physics: str
    location: dict[str, Any]
    parameters: tuple[tuple[str, float, float], ...]
    ops: tuple[Op, ...]
    near: dict[str, list[int]]
    also: tuple[dict[str, Any], ...] = ()
    verdicts: tuple[str, ...] = ("missing_physics",)
    alpha: float = 0.0  # decay rate that an exponential window adds, 1/s
    gain: float = 1.0  # what the force channel reads of the force


def place(
    nodes: Sequence[int] = (),
    elements: Sequence[int] = (),
    groups: Sequence[str] = (),
    dof: str | None = None,
) -> dict[str, Any]:
    """A location in the contract's form."""
    out: dict[str, Any] = {"nodes": list(nodes), "elements": list(elements), "groups": list(groups)}
    return out if dof is None else {**out, "dof": dof}


def also(physics: str, location: dict[str, Any], grade: str = "right") -> dict[str, Any]:
    """Other words for a truth."""
    return {"physics": physics, "location": location, "grade": grade}


def near(d: Drawing, nodes: Sequence[int], elements: Sequence[int] = ()) -> dict[str, list[int]]:
    """Places beside these."""
    around = d.touching(d.nodes_of(elements)) if elements else d.touching(nodes)
    return {"nodes": d.beside(nodes), "elements": sorted({*around, *elements})}


def turns(d: Drawing) -> list[str]:
    """Rotations that a clamp or joint can give in."""
    return [k for k in d.dofs if k not in TRANSLATIONS]


def lump(rng: Generator, d: Drawing) -> Truth:
    """A mass of 2 to 50 % of the structure's; on a chain of 10 to 200 % of its own place's."""
    node = _node(rng, d)
    own = next((x for x in d.lumps if x.node == node), None)
    m = d.mass() * between(rng, 0.02, 0.5) if own is None else own.m * between(rng, 0.1, 2.0)
    m = figures(m)
    words = [also("mass_change", place((), d.touching([node])), "part")]
    if own is not None:
        words = [also("mass_change", place((), [own.id], [own.group]))]
    return Truth(
        "added_mass",
        place([node]),
        (("m", m, TOLERANCE * m),),
        ({"do": "mass", "node": node, "m": m},),
        near(d, [node]),
        (*words, also("attached_resonator", place([node]), "part")),
        ("missing_physics",) if own is None else ("missing_physics", "parameter_error"),
    )


def _node(rng: Generator, d: Drawing) -> int:
    nodes = sorted({n for n, _ in d.places()})
    return nodes[int(rng.integers(len(nodes)))]


def bending(d: Drawing, element: int) -> tuple[float, float]:
    """(EI, length of its member) of an element."""
    line = next(e for e in d.lines if e.id == element)
    alike = sum(e.group == line.group for e in d.lines)
    ends = [e for e in d.lines if e.group == line.group]
    lengths = sum(d.length(e) for e in ends)
    section = d.sections[line.section]
    members = max(1, round(alike / max(4, min(alike, 10)))) if d.joints else 1
    inertia = section.Iy if "z" in d.dofs and "y" not in d.dofs else section.Iz
    return d.E * inertia, lengths / members


def foot(rng: Generator, d: Drawing) -> Truth:
    """One clamp that turns: k over decades of EI/L."""
    feet = [n for n, k in d.held if k in turns(d)]
    node = feet[int(rng.integers(len(feet)))]
    dof = turns(d)[int(rng.integers(len(turns(d))))]
    if d.family == "space frame":
        dof = ("rx", "ry")[int(rng.integers(2))]  # about its own axis a leg is not clamped by much
    EI, length = bending(d, d.touching([node])[0])
    k = figures(EI / length * between(rng, 0.02, 15.0))
    return Truth(
        "grounding_spring",
        place([node], dof=dof),
        (("k", k, max(TOLERANCE * k, LOOSE * EI / length)),),
        ({"do": "ground", "node": node, "dof": dof, "k": k},),
        near(d, [node]),
        base_words(d, [node], dof),
    )


def base_words(d: Drawing, nodes: Sequence[int], dof: str | None) -> tuple[dict[str, Any], ...]:
    """Other words for supports that give: in the bar's end, or as fixtures; a softer first element
    is near the truth only."""
    ends = d.touching(nodes)
    return (
        also("joint_flexibility", place(nodes, ends, dof=dof)),
        also("flexible_support", place(nodes)),
        also("stiffness_change", place((), ends), "part"),
    )


def support(rng: Generator, d: Drawing) -> Truth:
    """A soft support of a chain that is another one than drawn: softer, or stiffer."""
    own = [s for s in d.springs if len(s.nodes) == 1]
    s = own[int(rng.integers(len(own)))]
    factor = between(rng, 0.05, 0.8) if rng.random() < 0.7 else between(rng, 1.3, 8.0)
    t = _factor(d, [s.id], figures(factor), "k")
    words = [also("flexible_support", place(s.nodes)), also("joint_flexibility", place(s.nodes))]
    if factor > 1.0:
        words.append(also("grounding_spring", place(s.nodes, dof=s.dof)))
    return Truth(t.physics, t.location, t.parameters, t.ops, t.near, (*t.also, *words), t.verdicts)


def joint(rng: Generator, d: Drawing) -> Truth:
    """One end of a member that is not rigidly joined: k over decades of EI/L."""
    if not d.joints:  # a splice in a straight bar
        inner = [e for e in d.lines if not {*e.nodes} & {1, len(d.nodes)}]
        line = inner[int(rng.integers(len(inner)))]
        node, element = line.nodes[0], line.id
        ends = d.touching([node])
    else:
        node, element = d.joints[int(rng.integers(len(d.joints)))]
        ends = [element]
    EI, length = bending(d, element)
    k = figures(EI / length * between(rng, 0.02, 20.0))
    dof = turns(d)[0] if len(turns(d)) == 1 else None
    return Truth(
        "joint_flexibility",
        place([node], ends, dof=dof),
        (("k", k, max(TOLERANCE * k, LOOSE * EI / length)),),
        ({"do": "release", "node": node, "element": element, "k": k},),
        near(d, [node]),
        (also("stiffness_change", place((), ends), "part"),),
    )


def softer(rng: Generator, d: Drawing, low: float = 0.2, high: float = 0.85) -> Truth:
    """One or two elements (of a plate a patch) that are softer."""
    if d.family == "chain":
        inner = [s.id for s in d.springs if len(s.nodes) == 2]
        return _factor(d, [inner[int(rng.integers(len(inner)))]], figures(between(rng, low, high)))
    factor = figures(between(rng, low, high))
    if d.plate is not None:
        p = d.plate
        i, j = int(rng.integers(0, p.nx - 1)), int(rng.integers(0, p.ny - 1))
        patch = [p.element(i + a, j + b) for b in range(2) for a in range(2)]
        return _factor(d, patch, factor)
    line = d.lines[int(rng.integers(len(d.lines)))]
    run = [line.id]
    after = next((e for e in d.lines if e.id == line.id + 1 and e.group == line.group), None)
    if after is not None and rng.random() < 0.5 and set(line.nodes) & set(after.nodes):
        run.append(after.id)
    return _factor(d, run, factor)


def damage(rng: Generator, d: Drawing) -> Truth:
    """A loss of stiffness as of a crack or corrosion: 15 to 50 % of an element or two."""
    return softer(rng, d, 0.5, 0.85)


def _factor(d: Drawing, ids: list[int], factor: float, name: str = "factor") -> Truth:
    nodes = d.nodes_of(ids)
    feet = sorted(set(nodes) & set(d.feet))
    words = [
        also("joint_flexibility", place(nodes, ids), "part"),
        also("thickness_change", place((), ids), "part"),
    ]
    if feet:
        words.append(also("grounding_spring", place(feet), "part"))
        words.append(also("flexible_support", place(feet), "part"))
    parameters = (("factor", factor, TOLERANCE * factor),)
    change = {"do": "factor", "elements": ids, "fk": factor, "fm": 1.0}
    whole = [g for g, e in d.groups().items() if sorted(e) == sorted(ids)]
    return Truth(
        "stiffness_change",
        place((), ids, whole),
        parameters,
        (change,),
        near(d, [], ids),
        tuple(words),
        ("missing_physics", "parameter_error"),
    )


def group(rng: Generator, d: Drawing) -> Truth:
    """A wrong number: stiffness or mass of a whole group. In a table of one group only their ratio
    shows, so that either word is right."""
    groups = {g: e for g, e in d.groups().items() if len(e) > 1 or d.family == "chain"}
    if d.family == "chain":
        groups = {s.group: [s.id] for s in d.springs}
    name = sorted(groups)[int(rng.integers(len(groups)))]
    ids = groups[name]
    factor = between(rng, 0.6, 0.92) if rng.random() < 0.5 else between(rng, 1.08, 1.5)
    factor = figures(factor)
    mass = d.family != "chain" and rng.random() < 0.3
    change = {
        "do": "factor",
        "elements": ids,
        "fk": 1.0 if mass else factor,
        "fm": factor if mass else 1.0,
    }
    other = "stiffness_change" if mass else "mass_change"
    only = len(d.groups()) == 1
    return Truth(
        "mass_change" if mass else "stiffness_change",
        place((), ids, [name]),
        (("factor", factor, TOLERANCE * factor),),
        (change,),
        {"nodes": [], "elements": []},
        (
            also(other, place((), ids, [name]), "right" if only else "part"),
            also("thickness_change", place((), ids, [name]), "right" if only else "part"),
        ),
        ("parameter_error", "missing_physics"),
    )


def damper(rng: Generator, d: Drawing, first: float) -> Truth:
    """A dashpot to ground that gives the first mode several times its damping."""
    node, dof = _place(rng, d)
    c = figures(2.0 * 2.0 * np.pi * first * d.mass() / 4.0 * between(rng, 0.02, 0.3))
    return Truth(
        "viscous_damper",
        place([node], dof=dof),
        (("c", c, TOLERANCE * c),),
        ({"do": "dashpot", "node": node, "dof": dof, "c": c},),
        near(d, [node]),
    )


def _place(rng: Generator, d: Drawing) -> tuple[int, str]:
    places = d.places()
    return places[int(rng.integers(len(places)))]


def resonator(rng: Generator, d: Drawing, first: float) -> Truth:
    """Something on a spring: 1 to 10 % of the mass, alone at 0.6 to 6 times the first frequency."""
    node, dof = _place(rng, d)
    m = figures(d.mass() * between(rng, 0.01, 0.1))
    w = 2.0 * np.pi * first * between(rng, 0.6, 6.0)
    k, c = figures(m * w**2), figures(2.0 * rng.uniform(0.01, 0.05) * m * w)
    return Truth(
        "attached_resonator",
        place([node], dof=dof),
        (("m", m, TOLERANCE * m), ("k", k, TOLERANCE * k)),
        ({"do": "hidden", "node": node, "dof": dof, "m": m, "k": k, "c": c},),
        near(d, [node]),
        (also("added_mass", place([node]), "part"),),
    )


Maker = Callable[[Generator, Drawing], Truth]
TABLES: dict[str, tuple[Maker, tuple[str, ...]]] = {
    "lump": (lump, ("cantilever", "free beam", "portal", "frame", "space frame", "plate", "chain")),
    "foot": (foot, ("cantilever", "portal", "portal", "frame", "space frame")),
    "support": (support, ("chain", "chain")),
    "joint": (joint, ("free beam", "portal", "portal", "frame", "space frame")),
    "softer": (softer, ("cantilever", "free beam", "portal", "frame", "plate", "chain")),
    "group": (group, ("cantilever", "free beam", "portal", "frame", "plate", "chain")),
}
