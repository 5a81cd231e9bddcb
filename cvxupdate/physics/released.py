"""The model with several supports set free, and the springs that then hold it: of one compliance,
or along an edge of sheets of one for each metre."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.fe.analysis.rims import spread
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.columns import stiffness_columns
from cvxupdate.fe.elements import Term
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.compliance import EDGE, RIGID, Compliance
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank, opened
from cvxupdate.physics.growth import small_block
from cvxupdate.physics.members import sheet_names

Held = tuple[int, str]  # node, kind
PARALLEL = 0.999  # cosine of an axis and an edge that is held about it
DIRECTIONS = 3  # directions along which one support gives way
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Released:
    """A model with the DOFs of ``held`` supports set free, behind all others (``rows``), and behind
    these what an edge of finer parts between them may do besides following its nodes; ``springs``
    (h, r, r) of the supports on them, one on the average; ``shares`` (h,) of the edge that each
    has; ``spread``: springs act between the nodes, too."""

    model: Model
    held: tuple[Held, ...]
    before: int
    springs: Real
    shares: Real
    spread: bool = False

    @classmethod
    def of(cls, context: SearchContext, held: Sequence[Held], between: bool = True) -> Released:
        """Those of ``held`` that belong to an element; ``between``: with what edges do between
        them, which follow them else, as on one body."""
        base = context.model
        each = {h: context.release(*h) for h in held}
        own = {h: f"n{h[0]}.{h[1]}" for h in each}
        found = tuple(h for h in each if own[h] in each[h].place)
        free = [(each[h], own[h]) for h in found]
        if between:
            further = {x: each[h] for h in found for x in each[h].labels if x not in base.place}
            free += [(m, x) for x, m in further.items() if x not in own.values()]
        model = _opened(base, free)
        shares = edge_shares(base, found)
        told = spread(model, [x for _, x in free], found) if len(free) > len(found) else None
        if told is not None:
            return cls(model, found, base.size, *told, True)
        lumps = np.zeros((len(found), len(free), len(free)))
        at = np.arange(len(found))
        lumps[at, at, at] = shares
        return cls(model, found, base.size, lumps, shares)

    @property
    def rows(self) -> Index:
        """Of the DOFs set free."""
        return np.arange(self.before, self.model.size)

    @cached_property
    def within(self) -> Real:
        """Stiffness (r, r) of the structure at the DOFs set free."""
        return np.asarray(self._columns[self.before :])

    @cached_property
    def across(self) -> tuple[Index, Real]:
        """The DOFs of the structure (u,) that are joined with them, and the stiffness (u, r)."""
        side = self._columns[: self.before]
        used = np.flatnonzero(np.any(side != 0.0, axis=1))
        return used, side[used]

    @cached_property
    def _columns(self) -> Real:
        return stiffness_columns(self.model, self.rows)

    def together(self) -> Model:
        """The model in which they move as one: a DOF by the name of the first, the others tied."""
        last = self.before
        labels = self.model.labels
        first = labels[last]
        return replace(
            self.model,
            labels=labels[: last + 1],
            dof_node=self.model.dof_node[: last + 1],
            dof_kind=self.model.dof_kind[: last + 1],
            blocks=tuple(replace(b, dofs=np.minimum(b.dofs, last)) for b in self.model.blocks),
            ties=(*self.model.ties, *((label, first) for label in labels[last + 1 :])),
        )

    @property
    def unit(self) -> float:
        """Compliance (m/N, rad/(N·m)) that is that of the structure there, on the average."""
        return 1.0 / float(np.mean(np.diag(self.within)[: len(self.held)]))

    def along(self, unit: float) -> LowRank:
        """Springs of that compliance each, at any size."""
        (used, k), most = self.across, max(DIRECTIONS, len(self.held))
        return along_of(used, k, self.within, self.springs.sum(axis=0), unit, most)

    def scaled(self, factors: Real) -> Released:
        """With springs so many times as stiff, (h,)."""
        each = factors[:, None, None]
        return replace(self, springs=each * self.springs, shares=factors * self.shares)

    def sprung(self, unit: float, rigid: float = RIGID) -> Model:
        """On springs to ground, rigid but for one in ``rigid`` of that compliance."""
        model = self.model
        for kind in dict.fromkeys(k for _, k in self.held):
            model = replace(model, blocks=(*model.blocks, self._springs(model, kind, unit / rigid)))
        return model

    def _springs(self, model: Model, kind: str, rigid: float) -> Block:
        """Of one kind of DOF, each of compliance ``rigid``."""
        own = np.flatnonzero([k == kind for _, k in self.held])
        every = np.arange(len(self.rows) if self.spread else 0)
        at = np.array([[i, *np.setdiff1d(every, i)] for i in own])  # its own DOF first
        law = Compliance(1, kind, EDGE) if self.spread else Compliance(1, kind)
        block = small_block(
            model,
            law,
            self.rows[at],
            [KINDS.index(kind)] * at.shape[1],
            "K",
            np.ones((at.shape[1], at.shape[1])),
            {"a": 0.0, "a0": rigid},
        )
        (term,) = block.terms
        values = np.array([self.springs[i][np.ix_(x, x)] for i, x in zip(own, at, strict=True)])
        shared = Term(term.matrix, term.coefficient, values)
        properties = {**block.properties, "share": self.shares[own]}
        return replace(block, terms=(shared,), geometry=np.arange(len(own)), properties=properties)

    @property
    def along_edge(self) -> bool:
        """Whether they hold an edge of sheets, each the part of it that is its own."""
        return self.spread or bool(np.any(self.shares != 1.0))


def along_of(
    used: Index, across: Real, within: Real, springs: Real, unit: float, most: int
) -> LowRank:
    """What is set free on ``springs`` (r, r) of one compliance, at any size, along the ``most``
    softest directions."""
    turn = np.linalg.inv(np.linalg.cholesky(springs))  # in which springs are alike
    return opened(used, across @ turn.T, turn @ within @ turn.T, unit, np.ones_like, most)


def tangent_of(along: LowRank) -> DerivativeBlock:
    """The same per unit of compliance, exact at infinite stiffness."""
    K = (along.W * along.weights) @ along.W.T
    return DerivativeBlock(along.used[None], K[None], None, None, None)


def _opened(base: Model, free: Sequence[tuple[Model, str]]) -> Model:
    """A model with DOFs set free, each as another model (of the same elements) has it."""
    dofs = [b.dofs.copy() for b in base.blocks]
    labels, nodes, kinds = list(base.labels), [], []
    for other, label in free:
        row = other.place[label]
        for mine, theirs in zip(dofs, other.blocks, strict=True):
            mine[(mine < 0) & (theirs.dofs == row)] = len(labels)
        labels.append(label)
        nodes.append(int(other.dof_node[row]))
        kinds.append(int(other.dof_kind[row]))
    opened: Model = replace(
        base,
        labels=tuple(labels),
        dof_node=np.append(base.dof_node, np.array(nodes, dtype=np.int64)),
        dof_kind=np.append(base.dof_kind, np.array(kinds, dtype=np.int64)),
        blocks=tuple(replace(b, dofs=d) for b, d in zip(base.blocks, dofs, strict=True)),
    )
    return opened


def edge_shares(model: Model, held: Sequence[Held]) -> Real:
    """The length of edge of sheets that each of the supports holds from turning about itself, over
    the average; ones where they are not all on such edges, or about several axes."""
    if len({kind for _, kind in held}) > 1:
        return np.ones(len(held))
    at = {n: i for i, (n, _) in enumerate(held)}
    axis = KINDS.index(held[0][1]) - 3 if held else -1
    if axis < 0:
        return np.ones(len(held))
    out = np.zeros(len(held))
    for ends, along in sheet_sides(model, at).items():
        length = float(np.linalg.norm(along))
        if abs(along[axis]) >= PARALLEL * length:
            out[[at[n] for n in ends]] += length / 2.0
    return out / out.mean() if np.all(out > 0.0) else np.ones(len(held))


def sheet_sides(model: Model, at: Collection[int]) -> dict[frozenset[int], Real]:
    """Sides of sheets both ends of which are among the nodes ``at``, with what they span (3,)."""
    sides: dict[frozenset[int], Real] = {}
    sheets = sheet_names()
    for block in model.blocks:
        if block.nodes is None or block.kind.name not in sheets:
            continue
        for nodes in block.nodes:
            ids = model.node_ids[nodes].tolist()
            for k in range(len(ids)):
                a, b = k, (k + 1) % len(ids)
                if ids[a] in at and ids[b] in at:
                    along = model.xyz[nodes[b]] - model.xyz[nodes[a]]
                    sides[frozenset((ids[a], ids[b]))] = along
    return sides


def straight_runs(sides: Mapping[frozenset[int], Real]) -> list[set[int]]:
    """The nodes of sides that follow one another straight on."""
    runs: list[tuple[set[int], Real]] = []
    for ends, along in sides.items():
        way, nodes = along / max(float(np.linalg.norm(along)), TINY), set(ends)
        apart = []
        for run, its in runs:
            if abs(float(its @ way)) >= PARALLEL and not run.isdisjoint(ends):
                nodes |= run
            else:
                apart.append((run, its))
        runs = [*apart, (nodes, way)]
    return [nodes for nodes, _ in runs]
