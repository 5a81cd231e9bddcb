"""``grounding_spring`` at a class of supports: all that hold a direction give way, one k."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import final

from cvxupdate.fe.model import Model
from cvxupdate.physics.compliance import RIGID, SOFTEST, write
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import with_block
from cvxupdate.physics.place import Place, where
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.released import Held, Released
from cvxupdate.physics.units import quantity, stiffness_unit

LIMITS = (0.0, SOFTEST)
MOST = 100  # supports of a class
ALONG = " along the edge"


@final
class EqualSupports(EffectType):
    """Supports that give way alike."""

    name = "grounding_spring"
    noun = "the flexibility"
    rig = True
    writers = (("compliance", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One for every direction that is held at several nodes."""
        out = []
        for held in classes(context):
            free = Released.of(context, held)
            if len(free.held) < 2 or free.within.diagonal().min() <= 0.0:
                continue
            unit = free.unit
            change = ModelChange(
                partial(_softened, free, unit),
                ((free.tangent(unit),),),
                series=True,
                along=free.along(unit),
            )
            place = Place(nodes=tuple(n for n, _ in free.held), dof=held[0][1])
            figures = (stiffness("k", stiffness_unit(place), unit / RIGID),)
            along = ALONG if free.along_edge else ""
            spot = f"of the {len(free.held)} supports{along} at {where(place)}"
            out.append(Effect(self, place, change, figures, 1, LIMITS, spot))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """What each of them holds with."""
        k = quantity(values["k"], stiffness_unit(effect.place))
        share = " on the average, by the length of edge that is its own"
        k += share if ALONG in effect.spot else ""
        return f"Each {effect.spot} gives way: it holds with {k}, while the model holds it rigidly."


def classes(context: SearchContext) -> Iterator[tuple[Held, ...]]:
    """Supports of a direction at several nodes; not where it is held at all nodes, for that is how
    a plane structure is said."""
    every = set(context.model.node_ids.tolist())
    for kind in dict.fromkeys(k for _, k in context.supports):
        held = tuple(dict.fromkeys(h for h in context.supports if h[1] == kind))
        nodes = {n for n, _ in held}
        if 1 < len(nodes) <= MOST and nodes != every:
            yield held


def _softened(free: Released, unit: float) -> Model:
    kind = free.held[0][1]
    name = f"equal_supports@{kind}"
    return with_block(free.model, free.springs(unit), name, "a", LIMITS, unit)
