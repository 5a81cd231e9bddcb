"""Springs to ground that the model has, for it was brought to a reference state, and that give more
today: each in series with a compliance, so that zero means as before."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements.base import Term
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.fe.parameters import Parameter, Target
from cvxupdate.physics.compliance import EDGE, Compliance
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank
from cvxupdate.physics.given import is_given

LITTLE = 0.02  # of the largest: what a spring spread along an edge resists less has no direction


@dataclass(frozen=True)
class Sprung:
    """Spring ``row`` of block number ``block``, element ``id``, at a node and kind of DOF: ``k``
    (N/m or N·m/rad) times a ``pattern`` (d, d) on the DOFs ``dofs`` (d,), its own first."""

    block: int
    row: int
    id: int
    node: int
    kind: str
    k: float
    dofs: np.ndarray
    pattern: Real

    def beside(self, context: SearchContext) -> float:
        """Stiffness of the structure there, without it."""
        return max(context.local(int(self.dofs[0]))[0] - self.k * float(self.pattern[0, 0]), 1e-300)

    def along(self, unit: float) -> LowRank:
        """With a compliance of ``unit`` p more, at any size: −k + 1 / (1 / k + unit p)."""
        free = self.dofs >= 0
        values, vectors = np.linalg.eigh(self.pattern[np.ix_(free, free)])
        kept = values > LITTLE * values[-1]
        own = self.k * values[kept]
        return LowRank(
            self.dofs[free], vectors[:, kept], -unit * self.k * own, np.ones_like, -1.0 / own
        )


def sprung_of(context: SearchContext) -> list[Sprung]:
    """All that stand under the model and not in its file (``own`` of the context), each along one
    DOF: of a row of the file that has several none can be told apart."""
    model, own, out = context.model, context.own or frozenset(), []
    rows = Counter(i for b in model.blocks for i in b.ids.tolist())
    for number, block in enumerate(model.blocks):
        if block.kind.name != "spring" or block.kind.nodes != 1 or is_given(block):
            continue
        (term,) = block.terms
        each = np.real(block.properties["k"] * block.properties["stiffness"])
        for row, (i, dofs, k) in enumerate(zip(block.ids.tolist(), block.dofs, each, strict=True)):
            if i not in own and rows[i] == 1 and dofs[0] >= 0 and k > 0.0:
                node = int(model.node_ids[model.dof_node[dofs[0]]])
                kind = KINDS[int(model.dof_kind[dofs[0]])]
                pattern = np.asarray(term.values[block.geometry[row]])
                out.append(Sprung(number, row, i, node, kind, float(k), dofs, pattern))
    return out


def softened(model: Model, springs: Sequence[Sprung], times: Sequence[float]) -> Model:
    """The model with springs by their compliance, ``times`` as stiff a unit of it: nothing changes
    before the property ``a`` of these elements is moved. What moved the springs moves them still.
    """
    blocks, parameters = list(model.blocks), list(model.parameters)
    for number in dict.fromkeys(s.block for s in springs):
        own = [(s, by) for s, by in zip(springs, times, strict=True) if s.block == number]
        rows, block = np.array([s.row for s, _ in own]), blocks[number]
        stiffness = block.properties["stiffness"].copy()
        stiffness[rows] = 0.0  # the other block has it, under the same number
        blocks[number] = replace(block, properties={**block.properties, "stiffness": stiffness})
        parameters = [_moved(q, number, rows, len(blocks), own) for q in parameters]
        blocks.append(_compliant(block, rows, own))
    return replace(model, blocks=tuple(blocks), parameters=tuple(parameters))


def _compliant(block: Block, rows: Index, own: Sequence[tuple[Sprung, float]]) -> Block:
    """Rows of a block of springs as compliances."""
    k, by = (np.array(x) for x in zip(*((s.k, times) for s, times in own), strict=True))
    common = {name: np.full(len(rows), value) for name, value in COMMON.items()}
    return Block(
        Compliance(1, own[0][0].kind, EDGE),
        block.ids[rows],
        tuple(block.groups[r] for r in rows.tolist()),
        block.dofs[rows],
        block.direction if len(block.direction) == 1 else block.direction[rows],
        (Term("K", "k", np.array([times * s.pattern for s, times in own])),),
        np.arange(len(rows)),
        {**common, "a": np.zeros(len(rows)), "a0": by / k, "share": by},
        own=block.own,
    )


def _moved(
    q: Parameter, number: int, rows: Index, to: int, own: Sequence[tuple[Sprung, float]]
) -> Parameter:
    """A parameter on springs, some of which are in another block: by their p-value."""
    targets = list[Target]()
    for t in q.targets:
        there = np.isin(t.rows, rows)
        if t.block != number or not there.any() or t.properties not in (("stiffness",), ("k",)):
            targets.append(t)
            continue
        at = [int(np.flatnonzero(rows == r)[0]) for r in t.rows[there]]
        of_k = t.properties == ("k",)
        by = np.array([1.0 / own[i][0].k if of_k else 1.0 for i in at])
        targets.append(Target(to, np.array(at), ("stiffness",), t.scales[:, there] * by))
        if not there.all():
            targets.append(Target(t.block, t.rows[~there], t.properties, t.scales[:, ~there]))
    return replace(q, targets=tuple(targets))


def joined(parts: Sequence[LowRank]) -> LowRank:
    """Several changes of static stiffness along directions of their own, as one."""
    used = np.unique(np.concatenate([p.used for p in parts]))
    W = np.zeros((len(used), sum(p.W.shape[1] for p in parts)))
    first = 0
    for p in parts:
        W[np.searchsorted(used, p.used), first : first + p.W.shape[1]] = p.W
        first += p.W.shape[1]
    weights, behind = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("weights", "behind")
    )
    return LowRank(used, W, weights, np.ones_like, behind)
