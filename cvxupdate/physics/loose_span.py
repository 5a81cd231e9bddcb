"""``grounding_spring`` at a part of a row of supports: over a span of an edge of sheets bolts are
loose, a weld is torn, and what is held there is so in no direction, or softly in every one.

One number says how much: a compliance of each direction in units of that of the edge in it. Where
the span ends is read between nodes (`cvxupdate.fe.analysis.rims`): what gives falls off to nothing
at the supports beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.analysis.rims import ends_of, spread
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.compliance import EDGE, SOFTEST, write, write_edge
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.physics.place import ROTATIONS, TRANSLATIONS, Place, where
from cvxupdate.physics.quantity import Quantity, stiffness
from cvxupdate.physics.released import (
    Held,
    Released,
    along_of,
    sheet_sides,
    straight_runs,
    tangent_of,
)
from cvxupdate.physics.sprung import Sprung, joined, softened, sprung_of
from cvxupdate.physics.units import number, quantity

LIMITS = (0.0, SOFTEST)
LEAST, MOST = 3, 40  # supports in a row
LENGTHS = (1, 2, 4, 8, 16, 32)  # of spans, in supports
STIFF = 1e6  # times as stiff as its edge, to begin with: directions differ by two orders
DIRECTIONS = 9  # along which one gives way: the softest


@dataclass(frozen=True)
class Row:
    """Supports in a row: ``nodes`` along an edge, each held in ``kinds``; ``free``: all that are
    rigid set free, ``sprung`` those on springs that the reference state has; ``units`` of
    compliance by kind, and the one that ``others`` are taken in."""

    context: SearchContext
    nodes: tuple[int, ...]
    kinds: tuple[str, ...]
    free: Released
    sprung: tuple[Sprung, ...]
    units: Mapping[str, float]

    @classmethod
    def of(
        cls, context: SearchContext, nodes: tuple[int, ...], kinds: tuple[str, ...]
    ) -> Row | None:
        """None where one of them holds nothing."""
        on = {(s.node, s.kind): s for s in sprung_of(context)}
        every = [(n, k) for n in nodes for k in kinds]
        sprung = tuple(on[h] for h in every if h in on)
        free = Released.of(context, [h for h in every if h not in on])
        own = np.diag(free.within)
        if len(free.held) + len(sprung) < len(every) or own.min(initial=1.0) <= 0.0:
            return None
        units: dict[str, float] = {}
        for alike in (TRANSLATIONS, ROTATIONS):
            there = [float(own[i]) for i, (_, k) in enumerate(free.held) if k in alike]
            there += [s.beside(context) for s in sprung if s.kind in alike]
            units |= {k: 1.0 / float(np.mean(there)) for k in kinds if k in alike}
        return cls(context, nodes, kinds, free, sprung, units)

    @property
    def unit(self) -> float:
        """That of the first direction, which all are taken in."""
        return self.units[self.kinds[0]]

    def springs(self, nodes: tuple[int, ...]) -> tuple[Sprung, ...]:
        """The springs of some of its nodes."""
        return tuple(s for s in self.sprung if s.node in nodes)

    def held(self, nodes: tuple[int, ...]) -> tuple[Held, ...]:
        """The supports of some of its nodes."""
        return tuple(h for h in self.free.held if h[0] in nodes)

    def softer(self, nodes: tuple[int, ...]) -> Model:
        """On springs there, rigid today."""
        model, sprung = self.context.model, self.springs(nodes)
        before = len(model.blocks)
        held = self.held(nodes)
        if held:
            free = Released.of(self.context, held).scaled(self._factors(nodes))
            model = free.sprung(self.unit, STIFF)
        model = softened(model, sprung, [self.unit / self.units[s.kind] for s in sprung])
        added = model.blocks[before:]
        ids = [i for b in added for i in b.ids.tolist()]
        name = f"loose_span@n{nodes[0]}-n{nodes[-1]}"
        return append_parameters(model, [limited(name, "a", ids, LIMITS, self.unit)])

    def along(self, nodes: tuple[int, ...]) -> LowRank:
        """The same at any size, along the motions of the nodes: what an edge does besides them adds
        little (of a span of two supports 0.3 % of the frequencies where it moves them by 4 %), and
        as many directions again."""
        parts = [s.along(self.units[s.kind]) for s in self.springs(nodes)]
        return joined([*([self._along(nodes)] if self.free.held else []), *parts])

    def _along(self, nodes: tuple[int, ...]) -> LowRank:
        held, labels = self.held(nodes), self.free.model.labels[self.free.before :]
        own = [i for i, (n, _) in enumerate(self.free.held) if n in nodes]
        inner = range(len(self.free.held), len(labels))
        met = [i for i in inner if not {*ends_of(labels[i])}.isdisjoint(nodes)]
        springs = np.eye(len(own))[:, :, None] * np.eye(len(own))[:, None]
        told = spread(self.free.model, [labels[i] for i in [*own, *met]], held)
        if self.free.spread and told is not None:
            springs = told[0][:, : len(own), : len(own)]
        whole = np.einsum("h,hrs->rs", self._factors(nodes), springs)
        used, across = self.free.across
        within = self.free.within[np.ix_(own, own)]
        most = DIRECTIONS if self.free.spread else len(own)
        return along_of(used, across[:, own], within, whole, self.unit, most)

    def _factors(self, nodes: tuple[int, ...]) -> Real:
        """Of the springs of each support."""
        return np.array([self.unit / self.units[k] for _, k in self.held(nodes)])

    def figures(self) -> tuple[Quantity, ...]:
        """k along, kr about directions."""
        out = []
        for name, unit, alike in (("k", "N/m", TRANSLATIONS), ("kr", "N·m/rad", ROTATIONS)):
            own = next((k for k in self.kinds if k in alike), None)
            if own is not None:
                times = self.unit / self.units[own]
                before = [s.k for s in self.sprung if s.kind in alike]
                stiff = times / float(np.mean(before)) if before else self.unit / STIFF
                out.append((name, unit, stiff, times))
        names = ["k"] if len(out) == 1 else [name for name, *_ in out]
        return tuple(
            stiffness(name, unit, stiff, times=times)
            for name, (_, unit, stiff, times) in zip(names, out, strict=True)
        )

    def reach(self, nodes: tuple[int, ...]) -> str:
        """Where the span ends, and how long it is."""
        first, last = self.nodes.index(nodes[0]), self.nodes.index(nodes[-1])
        a, b = (self.nodes[i] for i in (max(first - 1, 0), min(last + 1, len(self.nodes) - 1)))
        place = self.context.model.node_ids.tolist()
        xyz = self.context.model.xyz
        length = float(np.linalg.norm(xyz[place.index(b)] - xyz[place.index(a)]))
        return f"between nodes {a} and {b}, {number(length)} m of the edge"


@final
class LooseSpan(EffectType):
    """A part of an edge that is loose."""

    name = "grounding_spring"
    noun = "a loose span"
    writers = (("compliance", write), (EDGE, write_edge))

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Spans of each straight row of supports along an edge of sheets, of one support on."""
        out = []
        for nodes, kinds in rows(context):
            row = Row.of(context, nodes, kinds)
            for span in spans(nodes) if row else ():
                if row is None or (len(span) == 1 and len(kinds) == 1):
                    continue  # that is a support which gives way
                along = row.along(span)
                change = ModelChange(
                    partial(row.softer, span),
                    ((tangent_of(along),),),
                    tuple(s.id for s in row.springs(span)),
                    series=True,
                    along=along,
                )
                place = Place(nodes=span, dof=kinds[0] if len(kinds) == 1 else None)
                spot = f"at {where(place)} ({row.reach(span)})"
                out.append(Effect(self, place, change, row.figures(), 1, LIMITS, spot))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """What the supports of the span hold with."""
        several = len(effect.place.nodes) > 1
        turns = effect.place.turns
        parts = [
            quantity(values[name], unit)
            for name, unit in (("k", "N·m/rad" if turns else "N/m"), ("kr", "N·m/rad"))
            if name in values
        ]
        sprung = effect.change is not None and effect.change.members
        firmly = "more firmly" if sprung else "rigidly"
        every = "" if effect.place.dof else " in every direction"
        return (
            f"The support{'s' if several else ''} {effect.spot} "
            f"{'are' if several else 'is'} loose{every}: {'they hold' if several else 'it holds'} "
            f"with {' and '.join(parts)}{' each' if several else ''}, while the model holds "
            f"{'them' if several else 'it'} {firmly}."
        )


def rows(context: SearchContext) -> Iterator[tuple[tuple[int, ...], tuple[str, ...]]]:
    """The nodes of each straight row of supports along sheets, in their order, and the directions
    in which all of them are held; not those in which all nodes are, for that is how a plane
    structure is said. A corner is held by the other side still."""
    of: dict[int, set[str]] = {}
    sprung = [(s.node, s.kind) for s in sprung_of(context)]
    for node, kind in (*context.supports, *sprung):
        of.setdefault(node, set()).add(kind)
    every = context.model.node_ids.tolist()
    plane = {k for k in KINDS if all(k in of.get(n, ()) for n in every)}
    runs = straight_runs(sheet_sides(context.model, of))
    at = {n: i for i, n in enumerate(every)}
    for run in runs:
        inner = run - set().union(*(other & run for other in runs if other is not run))
        if not LEAST <= len(inner) <= MOST:
            continue
        kinds = set.intersection(*(of[n] for n in inner)) - plane
        xyz = context.model.xyz[[at[n] for n in inner]]
        far = xyz[int(np.argmax(np.linalg.norm(xyz - xyz[0], axis=1)))]
        order = np.argsort((xyz - far) @ (xyz.mean(axis=0) - far))
        if kinds:
            nodes = [list(inner)[i] for i in order.tolist()]
            nodes = nodes if nodes[0] < nodes[-1] else nodes[::-1]
            yield tuple(nodes), tuple(k for k in KINDS if k in kinds)


def spans(nodes: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Parts of a row, each half of its length from the next."""
    for length in LENGTHS:
        if length >= len(nodes):
            return
        firsts = range(0, len(nodes) - length + 1, max(1, length // 2))
        for first in sorted({*firsts, len(nodes) - length}):
            yield nodes[first : first + length]
