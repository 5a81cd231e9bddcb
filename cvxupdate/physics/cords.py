"""``grounding_spring`` at several nodes with one k: the cords on which a structure hangs.

Tell-tale: rigid-body modes that are not at 0 Hz, and low modes that are too high by what the cords
add where they are tied.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import parallel
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.grounding_spring import LIMITS, springs_at, write
from cvxupdate.physics.growth import at_once, dof_rows, with_block
from cvxupdate.physics.place import TRANSLATIONS, Place, where
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

MOST = 32  # sets of places for each direction
NEAR = 1e-3  # of the structure's extent: within which a node is the mirror image of another
UNIT = 0.02  # of the stiffness of the structure at a place


@final
class Cords(EffectType):
    """Springs of one stiffness to ground, at places that are mirror images."""

    name = "grounding_spring"
    noun = "cords of one stiffness"
    unlimited = True
    mount = True
    writers = (("spring", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """In every direction in which the file holds the structure nowhere: pairs and fours of
        nodes that are mirror images in its middle planes, those farthest from the middle first."""
        out = []
        every = set(context.model.node_ids.tolist())
        for kind in TRANSLATIONS:
            held = {n for n, k in context.held if k == kind}
            rows = {n: row for row, n, _ in dof_rows(context.model, (kind,))}
            if rows and (not held or held == every):
                sets = _mirrored(context.model, np.array(list(rows)))
                found = (self._one(context, kind, [rows[n] for n in nodes]) for nodes in sets)
                out += [e for e in found if e is not None]
        return out

    def _one(self, context: SearchContext, kind: str, rows: list[int]) -> Effect | None:
        local = [context.local(r) for r in rows]
        stiff, heavy = (float(np.mean([x[k] for x in local])) for k in (0, 1))
        unit = UNIT * stiff if stiff > 0.0 else heavy * (2.0 * np.pi * context.bottom) ** 2
        if unit <= 0.0:
            return None
        model, n = context.model, len(rows)
        nodes = tuple(int(model.node_ids[model.dof_node[r]]) for r in rows)
        change = ModelChange(
            partial(_grown, model, rows, kind, unit),
            at_once(rows, "K", unit * np.eye(n)),
            along=parallel(np.array(rows), np.eye(n), np.full(n, unit)),
        )
        place = Place(nodes=nodes, dof=kind)
        spot = f"at {where(place)}"
        return Effect(self, place, change, (physical("k", "N/m"),), 1, LIMITS, spot)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The stiffness of one."""
        return (
            f"The structure hangs on {len(effect.place.nodes)} cords {effect.spot} that the model "
            f"does not have: each is a spring of {quantity(values['k'], 'N/m')}."
        )


def _mirrored(model: Model, nodes: Index) -> list[tuple[int, ...]]:
    """Pairs and fours of node numbers, at most `MOST` of them."""
    index = {int(n): i for i, n in enumerate(model.node_ids.tolist())}
    xyz = model.xyz[[index[int(n)] for n in nodes]]
    low, high = xyz.min(axis=0), xyz.max(axis=0)
    half = (high - low) / 2.0
    extent = float(half.max())
    axes = [i for i in range(3) if half[i] > NEAR * extent]
    found: dict[tuple[int, ...], float] = {}
    for signs in _reflections(axes):
        for orbit in _orbits(xyz - (low + high) / 2.0, signs, NEAR * extent):
            far = float(np.max(np.abs(xyz[orbit[0]] - (low + high) / 2.0)[axes] / half[axes]))
            found.setdefault(tuple(sorted(int(nodes[i]) for i in orbit)), far)
    return sorted(found, key=lambda key: (-round(found[key], 6), key))[:MOST]


def _reflections(axes: list[int]) -> Iterator[Real]:
    """Groups of reflections (2 or 4, 3), the identity first: in one middle plane, in two."""
    for a in axes:
        one = np.ones((2, 3))
        one[1, a] = -1.0
        yield one
    for i, a in enumerate(axes):
        for b in axes[i + 1 :]:
            both = np.ones((4, 3))
            both[1, a] = both[2, b] = both[3, a] = both[3, b] = -1.0
            yield both


def _orbits(xyz: Real, signs: Real, near: float) -> Iterator[list[int]]:
    """Places of nodes that the reflections make of one another; whole ones only."""
    for point in xyz:
        images = point * signs
        gaps = np.linalg.norm(xyz[None] - images[:, None], axis=2)
        orbit = np.argmin(gaps, axis=1)
        if np.all(gaps[np.arange(len(signs)), orbit] <= near) and len(set(orbit)) == len(signs):
            yield orbit.tolist()


def _grown(model: Model, rows: list[int], kind: str, unit: float) -> Model:
    block = springs_at(model, rows, kind)
    return with_block(model, block, f"cords@{kind}", "k", LIMITS, unit)
