"""Points of sheets that the nominal model holds on springs, for sheets give way there
(`cvxupdate.diagnose.nominal.points`); a support that gives way there adds to their compliance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank, opened
from cvxupdate.physics.growth import append_parameters, limited

POINTS = "points of sheets"  # the group of these springs


def is_given(block: Block) -> bool:
    """Whether it is one of such springs: no part of the structure that may be otherwise."""
    return bool(block.groups) and block.groups[0] == POINTS


@dataclass(frozen=True)
class Points:
    """Springs ``ids`` of compliance ``rigid`` (m/N) at ``nodes``, on the DOFs ``rows`` (r,) across
    sheets; ``across`` (u, r)
    the stiffness of the structure between the DOFs ``used`` (u,), their own among them, and
    these, ``within`` (r, r) of the latter alone."""

    model: Model
    ids: tuple[int, ...]
    nodes: tuple[int, ...]
    dof: str
    rigid: float
    rows: Index
    used: Index
    across: Real
    within: Real

    @classmethod
    def of(cls, context: SearchContext) -> list[Points]:
        """All that there are."""
        model, out = context.model, []
        for block in filter(is_given, model.blocks):
            rows, rigid = block.dofs[:, 0], np.real(block.properties["a0"])
            K = context.K[:, rows].toarray()
            K[rows, np.arange(len(rows))] -= 1.0 / rigid
            used = np.flatnonzero(np.any(K != 0.0, axis=1))
            nodes = tuple(int(model.node_ids[n]) for n in model.dof_node[rows])
            ids, dof = tuple(block.ids.tolist()), KINDS[int(block.direction[0, 0])]
            out.append(cls(model, ids, nodes, dof, float(rigid[0]), rows, used, K[used], K[rows]))
        return out

    def only(self, k: int) -> Points:
        """The ``k``-th alone."""
        of = slice(k, k + 1)
        return Points(
            self.model,
            self.ids[of],
            self.nodes[of],
            self.dof,
            self.rigid,
            self.rows[of],
            self.used,
            self.across[:, of],
            self.within[of, of],
        )

    @property
    def unit(self) -> float:
        """Compliance (m/N) that is that of the structure there, on the average."""
        return 1.0 / float(np.mean(np.diag(self.within)))

    @property
    def tangent(self) -> DerivativeBlock:
        """−k² w² per unit of compliance: the reactions, which inertia is part of."""
        k = np.full((len(self.rows), 1, 1), -self.unit / self.rigid**2)
        return DerivativeBlock(self.rows[:, None], k, *[None] * 3)

    @property
    def along(self) -> LowRank:
        """The same at any size."""
        return opened(self.used, self.across, self.within, self.unit, np.ones_like)

    def softer(self, name: str, limits: tuple[float, float]) -> Model:
        """With one parameter for what they give more."""
        return append_parameters(
            self.model, [limited(name, "a", list(self.ids), limits, self.unit)]
        )
