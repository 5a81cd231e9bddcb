"""Of a class of equal supports or joints: what each has of its own, for no two are quite alike.

One stiffness for all of them says what a rig does; bearings, anchors and bolted joints of one kind
differ by a quarter all the same. Taken as exactly equal they leave differences for which a lump or
a softer member beside them stands. So each has a factor of its own on the common stiffness, as
groups of elements have: scatter, and no size that is sought.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.physics.context import Real
from cvxupdate.physics.effect import Effect, ModelChange
from cvxupdate.physics.growth import Wanted, append_parameters
from cvxupdate.physics.planting import Planted

OWN = "own"  # to which these parameters belong, in place of a group of the file
MOST = 12  # of a class, beyond which what one has of its own hardly matters
FACTORS = (-0.8, 2.0)  # of the common stiffness, less 1


@dataclass(frozen=True, eq=False)
class AlikeChange(ModelChange):
    """A class with one size; ``own`` of its members have a factor of their own beside it."""

    own: int = 0

    @property
    def columns(self) -> int:
        """Parameters of the model: the unknowns, and what each member has of its own."""
        return self.count + self.own

    def plant(self, effect: Effect, model: Model, guess: Real, delay_unit: float) -> Planted:
        """On the model that it was made for; members begin alike where ``guess`` has sizes only."""
        start = np.zeros(self.columns)
        if len(guess) in (self.count, self.columns):
            start[: len(guess)] = guess
        return Planted(effect, self.model, start)


def owned(members: Collection[Hashable]) -> int:
    """How many of a class have a factor of their own."""
    return len(members) if 1 < len(members) <= MOST else 0


def with_own(model: Model, name: str, springs: Iterable[tuple[Hashable, int]]) -> Model:
    """The model with a factor on the stiffness of each member of a class, behind the last
    parameter: on all ``springs`` (whose, number) that are its own; as it is where there are too
    many."""
    each: dict[Hashable, list[int]] = {}
    for member, spring in springs:
        each.setdefault(member, []).append(spring)
    wanted = [
        Wanted(f"{name}, {k} of its own", "stiffness", tuple(own), OWN, *FACTORS, 1.0)
        for k, own in enumerate(each.values(), 1)
    ]
    return append_parameters(model, wanted) if owned(each) else model
