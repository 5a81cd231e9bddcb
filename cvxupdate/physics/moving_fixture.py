"""``flexible_support`` of a clamp: what it stands on moves and turns, with a mass and an inertia of
its own (Ewins 2000, 3.3).

Where feet are clamped, a fixture gives way along and about every axis at once, and no direction by
itself explains much: so all are one effect, with one stiffness and mass for the translations and
one for the rotations, the same at every foot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Term
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.compliance import RIGID
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import Complex, LowRank, opened
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.flexible_support import DAMPING, HUNDREDTH, LIMITS, STEPS, Fixture, write
from cvxupdate.physics.growth import append_parameters, limited, new_ids
from cvxupdate.physics.place import ROTATIONS, TRANSLATIONS, Place, listed, where
from cvxupdate.physics.quantity import physical, stiffness
from cvxupdate.physics.released import Held, Released
from cvxupdate.physics.units import quantity

ARMS = (0.1, 0.3)  # of the structure's extent: radii of gyration of trial fixtures
SLENDER = (0.1, 0.01)  # of the inertia with which both resonances are alike
UNHEARD = 1e5  # Hz: a mass or inertia that would resonate beyond, no vibration test hears
MOST = 24  # supports that are set free at a time


@dataclass(frozen=True)
class Stand:
    """Supports set free, and the units of compliance of those along and about an axis."""

    free: Released
    units: tuple[float, float]

    @classmethod
    def of(cls, free: Released, arm: float) -> Stand | None:
        """In the unit of the softest direction; None where a support set free is held by nothing,
        or nothing is held along or about an axis. ``arm``: what turns into what moves, m."""
        own = np.diag(free.within)
        turns = np.array([kind in ROTATIONS for _, kind in free.held])
        if not len(own) or own.min() <= 0.0 or turns.all() or not turns.any():
            return None
        unit = 1.0 / float(own[~turns].min())
        return cls(free, (unit, unit / arm**2))

    @property
    def turns(self) -> list[bool]:
        """Which of the supports are about an axis."""
        return [kind in ROTATIONS for _, kind in self.free.held]

    def along(self, frequency: float) -> LowRank:
        """All at once at any size, their resonances alike."""
        omega = 2.0 * np.pi * frequency

        def f(s: Complex) -> Complex:
            return np.asarray(omega**2 / (s**2 + 2.0 * DAMPING * omega * s + omega**2))

        used, side = self.free.across
        each = np.sqrt([self.units[turn] / self.units[0] for turn in self.turns])
        within = each[:, None] * self.free.within * each
        return opened(used, side * each, within, self.units[0], f)

    def bends(self, turning: bool) -> DerivativeBlock:
        """What one unit of compliance of the translations or rotations does, exact at infinite
        stiffness."""
        used, side = self.free.across
        k = side[:, [turn == turning for turn in self.turns]]
        unit = self.units[turning]
        return DerivativeBlock(used[None], (-unit * (k @ k.T))[None], None, None, None)

    def grown(self, heavy: tuple[float, float]) -> Model:
        """The model on its fixtures, rigid today."""
        model, own = self.free.model, np.diag(self.free.within)
        ids: tuple[list[int], list[int]] = ([], [])
        rows = zip(self.free.rows.tolist(), self.free.held, own.tolist(), strict=True)
        for row, (_, kind), stiff in rows:
            block = _block(model, kind, row, 1.0 / (RIGID * stiff))
            ids[kind in ROTATIONS].extend(block.ids.tolist())
            model = replace(model, blocks=(*model.blocks, block))
        wanted = [
            limited(f"fixture.{n}{'r' if turning else ''}", n, ids[turning], LIMITS, scale)
            for turning in (False, True)
            for n, scale in (("a", self.units[turning]), ("m", heavy[turning]))
        ]
        return append_parameters(model, wanted)


@final
class MovingFixture(EffectType):
    """A clamp whose fixture moves and turns."""

    name = "flexible_support"
    noun = "a fixture with a mass of its own"
    mount = True
    writers = (("fixture", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Under all clamped nodes, each on a fixture of its own, all alike; on a grid of
        frequencies."""
        mass = HUNDREDTH * max(context.model.total_mass(), 1e-12)
        extent = float(np.max(np.ptp(context.model.xyz, axis=0), initial=0.0))
        grid = np.geomspace(max(context.bottom, 1e-3), context.top, STEPS)
        held = _clamped(context)
        if not held or extent <= 0.0:
            return []
        free, out = Released.of(context, held, between=False), []
        for arm in (part * extent for part in ARMS):
            stand = Stand.of(free, arm)
            if stand is not None:
                heavy = (mass, mass * arm**2)
                out += [self._on(stand, heavy, f) for f in grid.tolist()]
        return out

    def _on(self, stand: Stand, heavy: tuple[float, float], frequency: float) -> Effect:
        nodes = tuple(dict.fromkeys(n for n, _ in stand.free.held))
        figures = (
            stiffness("k", "N/m", stand.units[0] / RIGID),
            physical("m", "kg", 1),
            stiffness("kr", "N·m/rad", stand.units[1] / RIGID, 2),
            physical("J", "kg·m²", 3),
        )
        change = ModelChange(
            partial(stand.grown, heavy),
            ((stand.bends(False),), (), (stand.bends(True),), ()),
            series=True,
            along=stand.along(frequency),
            start=partial(_tuned, stand.units, heavy, frequency),
            others=_slender,
        )
        place = Place(nodes=nodes)
        return Effect(self, place, change, figures, 1, LIMITS, f"under {where(place)}")

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Both stiffnesses, mass and inertia, and the frequencies that they would have alone."""
        nodes = effect.place.nodes
        several = len(nodes) > 1
        each = "each on" if several else "on"
        k, m, kr, J = (values[n] for n in ("k", "m", "kr", "J"))
        springs, alone = list[str](), list[str]()
        for stiff, heavy, units in ((k, m, ("N/m", "kg")), (kr, J, ("N·m/rad", "kg·m²"))):
            own = math.sqrt(stiff / heavy) / (2.0 * math.pi) if heavy > 0.0 else math.inf
            held = quantity(stiff, units[0])
            if own < UNHEARD:
                held = f"{quantity(heavy, units[1])} on {held}"
                alone.append(f"{own:.3g}")
            springs.append(held)
        swings = f" (alone at {listed(alone)} Hz)" if alone else ""
        return (
            f"The clamp{'s' if several else ''} at {where(effect.place)} "
            f"stand{'' if several else 's'} {each} a fixture that moves and turns: "
            f"{', '.join(springs)}{swings}, while the model holds "
            f"{'them' if several else 'it'} rigidly."
        )


def _clamped(context: SearchContext) -> tuple[Held, ...]:
    """The supports of all nodes that are held along and about some axis; none where they are many.
    A direction held at all nodes is how a plane structure is said."""
    every = set(context.model.node_ids.tolist())
    of: dict[int, list[str]] = {}
    for kind in (*TRANSLATIONS, *ROTATIONS):
        nodes = dict.fromkeys(n for n, k in context.supports if k == kind)
        for node in nodes if set(nodes) != every else ():
            of.setdefault(node, []).append(kind)
    held = tuple(
        (node, kind)
        for node, own in of.items()
        if {*own} & {*TRANSLATIONS} and {*own} & {*ROTATIONS}
        for kind in own
    )
    return held if len(held) <= MOST else ()


def _tuned(
    units: tuple[float, float], heavy: tuple[float, float], frequency: float, size: float
) -> Real:
    """Compliances and masses, in their units, of a fixture tuned to a frequency (Hz)."""
    own = [
        1.0 / (unit * (size + 1.0 / RIGID) * (2.0 * np.pi * frequency) ** 2) / scale
        for unit, scale in zip(units, heavy, strict=True)
    ]
    return np.array([size, own[0], size, own[1]])


def _block(model: Model, kind: str, row: int, rigid: float) -> Block:
    one = np.ones((1, 1, 1))
    values = {**COMMON, "a": 0.0, "a0": rigid, "m": 0.0}
    return Block(
        Fixture(kind),
        new_ids(model, 1),
        ("",),
        np.array([[row]]),
        np.array([[KINDS.index(kind)]]),
        (Term("K", "k", one), Term("M", "m", one)),
        np.zeros(1, dtype=np.int64),
        {k: np.full(1, v) for k, v in values.items()},
    )


def _slender(start: Real) -> list[Real]:
    """The same with less inertia: rocking resonates higher than moving does, by how much is not
    known."""
    return [start * np.array([1.0, 1.0, 1.0, part]) for part in SLENDER]
