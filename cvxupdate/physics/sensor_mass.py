"""``sensor_mass``: every accelerometer of the recordings has the same mass, which the model lacks
(mass loading; Ewins 2000, 3.5).

Tell-tale: all modes fall, each by the motion that it has at all the points of measurement together.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.physics.added_mass import lumps, translations
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.directions import LowRank
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.physics.place import Place, at, channel_place
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

TOGETHER = 0.02  # of the structure's mass: all of them, at one unit
LIMITS = (0.0, 12.5)  # a quarter of its mass: no test is made with more
APART = ", one for each direction that is measured"


@final
class SensorMass(EffectType):
    """The mass of each accelerometer."""

    name = "sensor_mass"
    noun = "the mass of the accelerometers"
    rig = True

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One, of the whole structure, where there are accelerometers that can move it; and one for
        an accelerometer in each direction, where several are measured at a node."""
        labels = dict.fromkeys(context.accelerometers)
        found = Counter(n for label in labels for n in channel_place(label).nodes)
        each = [self._of(context, found)] if max(found.values(), default=0) > 1 else []
        return [e for e in (self._of(context, dict.fromkeys(found, 1)), *each) if e is not None]

    def _of(self, context: SearchContext, found: Mapping[int, int]) -> Effect | None:
        """With so many at each node."""
        alike: dict[tuple[int, ...], list[list[int]]] = {}  # by the directions in which they move
        nodes: list[int] = []
        for node, rows in translations(context.model).items():
            if node in found:
                nodes.append(node)
                kinds = tuple(int(context.model.dof_kind[r]) for r in rows)
                alike.setdefault(kinds, []).extend([rows] * found[node])
        count = sum(map(len, alike.values()))
        if not count:
            return None
        unit = TOGETHER * max(context.model.total_mass(), 1e-12) / count
        tangent = tuple(
            DerivativeBlock(
                np.array(rows), None, np.tile(unit * np.eye(len(k)), (len(rows), 1, 1)), None, None
            )
            for k, rows in alike.items()
        )
        grow = partial(_grown, context.model, list(alike.values()), unit)
        along = _along([r for rows in alike.values() for own in rows for r in own], unit)
        several = max(found.values()) > 1
        kind = EachDirection if several else ModelChange
        change = kind(grow, (tangent,), additive=True, along=along, nodes=tuple(nodes))
        spot = f"{at(Place())}{APART}" if several else ""
        return Effect(self, Place(), change, (physical("m", "kg"),), 1, LIMITS, spot)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """That of one."""
        apart = f"{APART}," if APART in effect.spot else ""
        return (
            f"Every accelerometer{apart} loads the structure with {quantity(values['m'], 'kg')} "
            "that the model leaves out."
        )


@dataclass(frozen=True, eq=False)
class EachDirection(ModelChange):
    """With an accelerometer for each direction that is measured at a node."""

    @property
    def detail(self) -> tuple[str, ...]:
        """What tells it from one for all of them."""
        return (APART,)


def _along(rows: Sequence[int], unit: float) -> LowRank:
    """Of all of them at any size."""
    used, times = np.unique(np.array(rows, dtype=np.int64), return_counts=True)
    n = len(used)
    return LowRank(used, np.eye(n), unit * times.astype(np.float64), np.square, np.zeros(n))


def _grown(model: Model, alike: Sequence[Sequence[Sequence[int]]], unit: float) -> Model:
    ids: list[int] = []
    for rows in alike:
        block = lumps(model, rows, "accelerometer")
        ids += block.ids.tolist()
        model = replace(model, blocks=(*model.blocks, block))
    return append_parameters(model, [limited("sensor_mass", "m", ids, LIMITS, unit)])
