"""``stiffness_change`` of all springs to ground alike: the mounts on which a structure stands.

Pads and feet of one kind are all softer, or all stiffer, than the catalogue says; hardly a test is
without it, and one number says it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from cvxupdate.fe.model import Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.factors import factors, percent
from cvxupdate.physics.members import groups_that_are
from cvxupdate.physics.stiffness_change import LIMITS


@final
class SoftMounts(EffectType):
    """A factor on K of all springs to ground."""

    name = "stiffness_change"
    noun = "a change of stiffness"
    rig = True

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One, where there are several such springs."""
        found, own = mounts_of(context.model), context.own
        mounts = found if own is None else tuple(i for i in found if i in own)
        if len(mounts) < 2:
            return []
        groups: dict[str, set[int]] = {}
        for block in context.model.blocks:
            for i, name in zip(block.ids.tolist(), block.groups, strict=True):
                if name:
                    groups.setdefault(name, set()).add(i)
        sets = [(mounts, groups_that_are(mounts, groups))]
        return factors(self, context.model, "stiffness", sets, LIMITS)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The change in percent."""
        return percent(effect, values, "stiffer", "softer")


def mounts_of(model: Model) -> tuple[int, ...]:
    """Numbers of the springs to ground."""
    found = {
        int(i)
        for b in model.blocks
        if b.kind.name == "spring" and b.kind.nodes == 1
        for i in b.ids.tolist()
    }
    return tuple(sorted(found))
