"""Plane frames as chains of beams that CalculiX expands into bricks (B32R): decks. Parts are
shorter than the section is high, for an expanded beam is stiff over one part at a support or
corner, where its section may not change its shape: a cantilever 100 heights long in parts of 1.5
heights is 0.18 % of a frequency stiff, and that falls with their length. SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from validation.generated.cases import Case
from validation.generated.laboratory import Design, Effect, Element
from validation.plates.bodies import AXES, ZONE, Body, Point, asked, read, run

PART = 0.4  # length of a part in heights of the section
LOCAL = ("added_mass", "grounding_spring", "attached_resonator")


@dataclass
class _Deck:
    """An input deck under construction; the drawing's nodes keep their numbers."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    elements: int = 0

    def node(self, at: Sequence[float]) -> int:
        """Number of a further node."""
        number = max(self.nodes) + 1
        self.nodes[number] = (float(at[0]), float(at[1]), float(at[2]))
        return number

    def element(self, kind: str, name: str, nodes: Sequence[int]) -> None:
        """One more element, of a set of its own."""
        self.elements += 1
        text = ",".join(map(str, nodes))
        self.lines += [f"*ELEMENT,TYPE={kind},ELSET={name}", f"{self.elements},{text}"]


def body_of(case: Case, folder: Path) -> Body:
    """The modes in its plane of a frame with what is concealed in it; ``folder`` for the deck and
    its answer."""
    drives = tuple(dict.fromkeys(case.drives))
    text, at = written(case.design, case.scatter, case.effects, drives)
    run(text, folder)
    return read(folder / "body.dat", at, "xz", drives)


def written(
    design: Design,
    scatter: Mapping[int, tuple[float, float]],
    effects: Sequence[Effect],
    drives: Sequence[Point] = (),
) -> tuple[list[str], dict[int, int]]:
    """(the deck, the body's node of each of the drawing's)."""
    deck = _Deck({n: tuple(x) for n, x in design.nodes.items()})
    for e in design.elements:
        _member(deck, design, e, scatter[e.id], effects)
    soft = {(x["node"], x["dof"]) for x in effects if x["physics"] == "grounding_spring"}
    bounds = [
        f"{n},{k},{k}"
        for n in dict.fromkeys(n for n, _ in design.held)
        for k in range(1, 7)
        if k > 3 or (n, AXES[k - 1]) not in soft
    ]
    for number, x in enumerate(effects):
        if x["physics"] in LOCAL:
            bounds += _local(deck, x, f"X{number}")
    lossy = [x for x in effects if x["physics"] == "structural_damping"]
    sets = [f"*ELSET,ELSET={ZONE}", *(f"E{n}," for x in lossy for n in x["elements"])]
    at = {n: n for n in design.nodes}
    nodes = [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in deck.nodes.items()]
    text = ["*NODE,NSET=ALL", *nodes, *deck.lines, *(sets if lossy else [])]
    return [*text, "*BOUNDARY", *bounds, *asked(at, bool(lossy), drives)], at


def _member(
    deck: _Deck,
    design: Design,
    e: Element,
    factors: tuple[float, float],
    effects: Sequence[Effect],
) -> None:
    E, rho = design.E * factors[0], design.rho * factors[1]
    width, height = design.section
    for x in effects:
        if e.id in x.get("elements", ()):
            E *= x["factor"] if x["physics"] == "stiffness_change" else 1.0
            rho *= x["factor"] if x["physics"] == "mass_change" else 1.0
            height *= x["factor"] if x["physics"] == "thickness_change" else 1.0
    a, b = (np.array(design.nodes[n]) for n in e.nodes)
    parts = max(2, round(float(np.linalg.norm(b - a)) / (PART * design.section[1])))
    inner = [deck.node(a + (b - a) * k / (2.0 * parts)) for k in range(1, 2 * parts)]
    row = [e.nodes[0], *inner, e.nodes[1]]
    for k in range(parts):
        deck.element("B32R", f"E{e.id}", row[2 * k : 2 * k + 3])
    deck.lines += [f"*MATERIAL,NAME=M{e.id}", "*ELASTIC", f"{E:.10g},{design.nu}"]
    deck.lines += ["*DENSITY", f"{rho:.10g}"]
    deck.lines += [f"*BEAM SECTION,ELSET=E{e.id},MATERIAL=M{e.id},SECTION=RECT"]
    deck.lines += [f"{width:.10g},{height:.10g}", "0,1,0"]


def _local(deck: _Deck, x: Effect, name: str) -> list[str]:
    """A lump, a spring or a hidden mass; the boundary lines that it brings."""
    node = x["node"]
    if x["physics"] == "added_mass":
        deck.element("MASS", name, [node])
        deck.lines += [f"*MASS,ELSET={name}", f"{x['m']:.9e}"]
        return []
    direction = AXES.index(x["dof"]) + 1
    if x["physics"] == "grounding_spring":
        deck.element("SPRING1", name, [node])
        deck.lines += [f"*SPRING,ELSET={name}", f"{direction}", f"{x['k']:.9e}"]
        return []
    own = deck.node((0.0, 0.0, -1.0))
    deck.element("SPRING2", name, [node, own])
    deck.lines += [f"*SPRING,ELSET={name}", f"{direction},{direction}", f"{x['k']:.9e}"]
    deck.element("MASS", f"M{name}", [own])
    deck.lines += [f"*MASS,ELSET=M{name}", f"{x['m']:.10g}"]
    return [f"{own},{k},{k}" for k in (1, 2, 3) if k != direction]
