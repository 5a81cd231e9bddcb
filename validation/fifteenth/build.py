"""From a case to the matrices of the real thing, in one state or another."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from validation.fifteenth.frame import Frame
from validation.fifteenth.plate import Sheet
from validation.fifteenth.shapes import DOFS, Case, Chain, Effect, Structure
from validation.fifteenth.system import Array, Rows, System


class Carts(System):
    """A chain of carts, numbered from 1; every spring is a rod of six pieces with a mass."""

    def __init__(
        self, structure: Structure, effects: list[Effect], scatter: dict[str, tuple[float, float]]
    ) -> None:
        super().__init__()
        chain = structure.chain
        assert isinstance(chain, Chain)
        fe, fr = scatter["springs"]
        self.new(len(chain.carts) + 1)
        self.fixed.add(0)
        for i, k in enumerate(chain.springs):
            for e in effects:
                if e.kind == "spring" and e.at == i + 1:
                    k *= e.numbers["stiffness"]
            ids = np.concatenate([[i], self.new(5), [i + 1]])
            m = chain.spring_mass / 6
            for a, b in itertools.pairwise(ids):
                pair = np.array([a, b])
                self.add("K", pair, 6 * k * fe * np.array([[1, -1], [-1, 1.0]]))
                self.add("M", pair, m / 6 * np.array([[2, 1], [1, 2.0]]))
        for i, m in enumerate(chain.carts):
            self.add("M", np.array([i + 1]), np.array([[m * fr]]))

    def rows(self, at: Any) -> Rows:
        """Motion of a cart: x alone."""
        b = np.zeros((6, 1))
        b[0, 0] = 1.0
        return np.array([int(at)]), b


def length_of(structure: Structure, member: str) -> float:
    """Length of a member."""
    m = next(m for m in structure.members if m.name == member)
    return float(np.linalg.norm(np.array(structure.points[m.a]) - np.array(structure.points[m.b])))


def place(structure: Structure, a: Any, b: Any) -> Any:
    """A station of the analyst's mesh as a place: (member, index), plate (i, j), or cart."""
    if structure.chain:
        return a
    if structure.plate:
        p = structure.plate
        return (p.a * a / p.nx, p.b * b / p.ny)
    m = next(m for m in structure.members if m.name == a)
    return (a, b / m.n)


def shifted(structure: Structure, at: Any, rng: np.random.Generator, sd: float = 0.003) -> Any:
    """The same place a few millimetres off."""
    if structure.chain:
        return at
    if structure.plate:
        return (at[0] + sd * rng.standard_normal(), at[1] + sd * rng.standard_normal())
    return (
        at[0],
        float(np.clip(at[1] + sd * rng.standard_normal() / length_of(structure, at[0]), 0, 1)),
    )


def direction(structure: Structure, dof: str, rng: np.random.Generator, sd: float = 0.02) -> Array:
    """A direction a degree or two off, among what the structure can do."""
    d = np.zeros(6)
    d[DOFS.index(dof)] = 1.0
    for i, name in enumerate(DOFS[:3]):
        if name != dof and name in structure.dofs and not structure.plate:
            d[i] += sd * rng.standard_normal()
    return d / np.linalg.norm(d)


def material_scatter(case: Case, rng: np.random.Generator) -> dict[str, tuple[float, float]]:
    """Factors on E and rho of each group: a batch in common, a little of its own."""
    s = case.structure
    names = (
        ["plate"] if s.plate else ["springs"] if s.chain else sorted({m.group for m in s.members})
    )
    batch = 1 + 0.012 * rng.standard_normal(2)
    return {
        n: (
            float(batch[0] + 0.006 * rng.standard_normal()),
            float(batch[1] + 0.004 * rng.standard_normal()),
        )
        for n in names
    }


def add_effects(system: System, effects: list[Effect]) -> None:
    """What is hung on, propped up or taken off."""
    for e in effects:
        n = e.numbers
        if e.kind == "lump":
            system.lump(e.at, n["m"], n.get("offset", (0, 0, 0)), n.get("size", 0.05))
        elif e.kind in ("prop", "dashpot", "resonator", "cord"):
            d = np.zeros(6)
            d[DOFS.index(n["dof"])] = 1.0
            if e.kind == "resonator":
                system.resonator(e.at, d, n["m"], n["k"], n.get("c", 0.0))
            else:
                system.along(
                    "C" if e.kind == "dashpot" else "K",
                    e.at,
                    d,
                    n["c" if e.kind == "dashpot" else "k"],
                )
        elif e.kind == "shaker":
            d = np.zeros(6)
            d[DOFS.index(n["dof"])] = 1.0
            system.along("M", e.at, d, n["m"])
            system.along("K", e.at, d, n["k"])


def build(
    case: Case, effects: list[Effect], scatter: dict[str, tuple[float, float]], sensors: list[Any]
) -> System:
    """The structure with these effects and the accelerometers at their places."""
    s = case.structure
    cls = Sheet if s.plate else Carts if s.chain else Frame
    system = cls(s, effects, scatter)
    add_effects(system, effects)
    for at in {str(a): a for a in sensors}.values():
        if case.sensor_mass:
            if s.chain:
                system.along("M", at, np.eye(6)[0], case.sensor_mass)
            else:
                system.lump(at, case.sensor_mass, (0, 0, 0.012), 0.018)
    system.assemble()
    return system
