"""``flexible_support``: a support, suspension or fixture with a stiffness and a mass of its own: it
resonates (Ewins 2000, 3.3: the fixture is part of the structure).

Tell-tale: a mode that the model does not have, in which the structure moves as on soft feet, and
neighbours pushed apart. Without mass it is a support that gives way (``grounding_spring``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements import Term
from cvxupdate.fe.elements.base import Values
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.compliance import RIGID, SOFTEST
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import Complex, LowRank
from cvxupdate.physics.draft import Draft, kind_of, node_of, not_negative
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited, new_ids
from cvxupdate.physics.place import ROTATIONS, TRANSLATIONS, Place, where
from cvxupdate.physics.quantity import physical, stiffness
from cvxupdate.physics.released import Held, Released
from cvxupdate.physics.units import number, quantity

LIMITS = (0.0, SOFTEST)
HUNDREDTH = 0.01  # of the structure's mass: the unit of a fixture's
ARM = 0.1  # of its extent: radius of gyration of that unit
FELT = 2.0  # deviations from nothing that a mass of its own must be
DAMPING = 0.02  # of the trial fixtures
STEPS = 16  # trial frequencies in the band
SINGLE, MOST = 4, 100  # supports of a direction up to which each is tried by itself; in one fixture


@dataclass(frozen=True)
class Fixture:
    """Mass and spring to ground on one DOF, the spring given by its compliance: k = 1/(a₀ + a)."""

    dof: str
    name: str = "fixture"
    nodes: int = 1
    properties: tuple[str, ...] = ("a", "m")

    @property
    def dofs(self) -> tuple[str, ...]:
        """The DOF kind it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the block is made with its terms."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """k in N/m, m in kg."""
        return {"k": 1.0 / (properties["a0"] + properties["a"]), "m": properties["m"]}


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A node of its own on a spring, with a lump: what stood on the ground is tied to it."""
    row, number = int(block.dofs[e, 0]), int(block.ids[e])
    node, kind, label = node_of(model, row), kind_of(model, row), model.labels[row]
    carried = [node, *(int(t.partition(".")[0][1:]) for t, to in model.ties if to == label)]
    fresh, group = draft.fresh_node(node), draft.fresh_group("fixture", node)
    draft.hold(fresh, [k for k in draft.model["dofs"] if k != kind])
    for n in carried:
        draft.release(n, kind)
        draft.model.setdefault("ties", []).append({"nodes": [fresh, n], "dofs": [kind]})
    k = now["stiffness"] / (now["a0"] + now["a"])
    spring = draft.fresh_element()
    about = f"I{kind[1] * 2}" if kind in ROTATIONS else "m"
    values = (("spring", spring, "k", k), ("mass", number, about, now["m"] * now["mass"]))
    for element, own, key, value in values:
        at = {"dof": kind} if key == "k" else {"m": 0.0}
        put = {"id": own, "nodes": [fresh], **at, key: not_negative(own, key, value)}
        draft.put(element, {**put, "group": group})
    draft.known[number, "a"], draft.known[number, "m"] = (spring, "k"), (number, about)


@final
class FlexibleSupport(EffectType):
    """A support that resonates."""

    name = "flexible_support"
    noun = "a support with a mass of its own"
    mount = True
    writers = (("fixture", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Along and about every axis that is held: under all its nodes together (where they
        move), and where they are few under each, on a grid of frequencies. The tangent is that of
        a support that gives way: the mass does nothing while it is rigid."""
        mass = HUNDREDTH * max(context.model.total_mass(), 1e-12)
        extent = float(np.max(np.ptp(context.model.xyz, axis=0), initial=0.0))
        grid = np.geomspace(max(context.bottom, 1e-3), context.top, STEPS)
        out = []
        for held in _fixtures(context):
            free = Released.of(context, held, between=False)
            if not free.held:
                continue
            used, side = free.across
            across, own = side.sum(axis=1), float(free.within.sum())
            if own <= 0.0 or not len(used):
                continue
            unit = 1.0 / own
            bend = DerivativeBlock(
                used[None], (-unit * np.outer(across, across))[None], None, None, None
            )
            place = Place(nodes=tuple(n for n, _ in free.held), dof=held[0][1])
            figures, heavy = (stiffness("k", "N/m", unit / RIGID), physical("m", "kg", 1)), mass
            if place.turns:
                heavy = mass * (ARM * max(extent, 1e-9)) ** 2
                figures = (stiffness("kr", "N·m/rad", unit / RIGID), physical("J", "kg·m²", 1))
            for f in grid.tolist():
                change = ModelChange(
                    partial(_grown, free, unit, heavy),
                    ((bend,), ()),
                    series=True,
                    along=_along(used, across, own, unit, f),
                    start=partial(_tuned, unit, heavy, f),
                )
                spot = f"at {where(place)}"
                out.append(Effect(self, place, change, figures, 1, LIMITS, spot))
        return out

    def plainly(self, values: Mapping[str, float], deviations: Mapping[str, float]) -> bool:
        """Whether it may have no mass: then it is a support that gives way."""
        return any(values[n] <= FELT * deviations[n] for n in ("m", "J") if n in values)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Stiffness, mass, and the frequency that they would have alone."""
        turns = effect.place.turns
        k, m = (values[name] for name in (("kr", "J") if turns else ("k", "m")))
        f = math.sqrt(k / m) / (2.0 * math.pi) if k > 0.0 and m > 0.0 else math.nan
        alone = f" (alone they would swing at {number(f)} Hz)" if math.isfinite(f) else ""
        several = len(effect.place.nodes) > 1
        what = f"The support{'s' if several else ''} {effect.spot}"
        return (
            f"{what} give{'' if several else 's'} way{' together' if several else ''} with "
            f"{'an inertia' if turns else 'a mass'} of {'their' if several else 'its'} own: "
            f"{quantity(m, 'kg·m²' if turns else 'kg')} on "
            f"{quantity(k, 'N·m/rad' if turns else 'N/m')}{alone}, while the model holds "
            f"{'them' if several else 'it'} rigidly."
        )


def _fixtures(context: SearchContext) -> Iterator[tuple[Held, ...]]:
    """Supports that one fixture carries: all of a direction, and each where they are few; not where
    a direction is held at all nodes, for that is how a plane structure is said."""
    every = set(context.model.node_ids.tolist())
    for kind in (*TRANSLATIONS, *ROTATIONS):
        held = tuple(dict.fromkeys(h for h in context.supports if h[1] == kind))
        if not held or len(held) > MOST or {n for n, _ in held} == every:
            continue
        if len(held) == 1 or kind in TRANSLATIONS:  # what turns as one body moves its feet as well
            yield held
        if 1 < len(held) <= SINGLE:
            yield from ((h,) for h in held)


def _along(used: Index, across: Real, own: float, unit: float, frequency: float) -> LowRank:
    """Compliance ω² / (s² + 2ζωs + ω²) of its static one."""
    omega = 2.0 * np.pi * frequency

    def f(s: Complex) -> Complex:
        return np.asarray(omega**2 / (s**2 + 2.0 * DAMPING * omega * s + omega**2))

    return LowRank(used, across[:, None], np.array([-unit]), f, np.array([-own]))


def _tuned(unit: float, heavy: float, frequency: float, size: float) -> Real:
    """Compliance and mass, in their units, of a fixture tuned to a frequency (Hz)."""
    mass = 1.0 / (unit * (size + 1.0 / RIGID) * (2.0 * np.pi * frequency) ** 2)
    return np.array([size, mass / heavy])


def _grown(free: Released, unit: float, heavy: float) -> Model:
    model, kind = free.together(), free.held[0][1]
    values = {**COMMON, "a": 0.0, "a0": unit / RIGID, "m": 0.0}
    one = np.ones((1, 1, 1))
    ids = new_ids(model, 1)
    block = Block(
        Fixture(kind),
        ids,
        ("",),
        np.array([[free.before]]),
        np.array([[KINDS.index(kind)]]),
        (Term("K", "k", one), Term("M", "m", one)),
        np.zeros(1, dtype=np.int64),
        {k: np.full(1, v) for k, v in values.items()},
    )
    named: Sequence[tuple[str, float]] = (("a", unit), ("m", heavy))
    wanted = [limited(f"fixture.{n}", n, ids.tolist(), LIMITS, scale) for n, scale in named]
    return append_parameters(replace(model, blocks=(*model.blocks, block)), wanted)
