"""``axial_preload``: geometric stiffness of a tension or compression in a group or a straight
member (Przemieniecki 1968, 15.2); tell-tale: low modes shift most."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import final

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.fe.sections import section_constants
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.factors import on_sets
from cvxupdate.physics.growth import Wanted, limited
from cvxupdate.physics.members import member_sets, straight
from cvxupdate.physics.place import at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import quantity

HELD = -1  # in place of a node that is held in any way, and of the ground
LIMITS = (-5.0, 50.0)  # of Euler's load


@final
class AxialPreload(EffectType):
    """An axial force."""

    name = "axial_preload"
    noun = "an axial preload"

    def candidates(self, context: SearchContext) -> list[Effect]:
        """In every group and every straight member, but in none with two free ends: nothing is
        there to push against."""
        model = context.model
        whole = straight(model, "N")
        members = {tuple(sorted(m)) for m in whole}
        free = _free(model, whole) if whole else set[int]()
        sets = [
            (i, g)
            for i, g in member_sets(model, "N")
            if (g or i in members) and not free.issuperset(i)
        ]

        def wanted(k: int, ids: tuple[int, ...]) -> list[Wanted]:
            return [limited(f"{self.name}@{k}", "N", ids, LIMITS, _euler(model, ids))]

        return on_sets(self, model, sets, wanted, [physical("N", "N")], limits=LIMITS)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Tension or compression, and how much."""
        kind = "a tension" if values["N"] > 0 else "a compression"
        return (
            f"{capital(at(effect.place))} there is {kind} of {quantity(abs(values['N']), 'N')} "
            "that the model leaves out."
        )


def _free(model: Model, members: Sequence[Sequence[int]]) -> set[int]:
    """The elements of straight members at whose ends nothing else that is stiff is, and which are
    not held there."""
    nodes, every = dict[int, list[int]](), Counter[int]()
    for block in model.blocks:
        if not any(t.matrix == "K" for t in block.terms):
            continue
        count = 2 if block.kind.nodes == 2 else block.nodal.shape[1]
        parts = np.split(block.nodal, count, axis=1) if count else []
        for i, *rows in zip(block.ids.tolist(), *parts, strict=True):
            at = [HELD if np.any(p < 0) else int(model.dof_node[p[0]]) for p in rows]
            nodes[i] = at if count == 2 else sorted(set(at))
            every.update(nodes[i])
    out = set[int]()
    for member in members:
        own = Counter(n for i in member for n in nodes[i])
        ends = [n for n, times in own.items() if times == 1]
        if len(ends) == 2 and HELD not in own and all(every[n] == 1 for n in ends):
            out.update(member)
    return out


def _euler(model: Model, ids: Sequence[int]) -> float:
    """π² E I / L² of the elements taken as one bar: the size of a force that matters."""
    wanted = set(ids)
    for block in model.blocks:
        rows = np.flatnonzero([i in wanted for i in block.ids.tolist()])
        section = getattr(block.kind, "section", None)
        if len(rows) and section is not None:
            c = section_constants(section, block.properties)
            inertia = np.real([c["Iy"][rows], c["Iz"][rows]])
            inertia[inertia <= 0.0] = np.inf  # not given: a plane frame bends one way only
            bending = float(np.min(inertia * block.properties["E"][rows]))
            length = np.sum(block.properties["length"][rows] * block.parts)
            return float(np.pi**2 * bending / length**2)
    return 1.0
