"""The model with several supports set free, and the springs that then hold it: of one compliance,
or along an edge of sheets of one for each metre."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.columns import stiffness_columns
from cvxupdate.fe.elements import Term
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.compliance import RIGID, Compliance
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank, opened
from cvxupdate.physics.growth import small_block
from cvxupdate.physics.members import sheet_names

Held = tuple[int, str]  # node, kind
PARALLEL = 0.999  # cosine of an axis and an edge that is held about it
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Released:
    """A model with the DOFs of ``held`` supports set free, behind all others (``rows``);
    ``shares`` (r,) of the springs that then hold it, one on the average."""

    model: Model
    held: tuple[Held, ...]
    before: int
    shares: Real

    @classmethod
    def of(cls, context: SearchContext, held: Sequence[Held]) -> Released:
        """Those of ``held`` that belong to an element."""
        base = context.model
        dofs = [b.dofs.copy() for b in base.blocks]
        labels, nodes, found = list(base.labels), [], []
        for node, kind in held:
            free, label = context.release(node, kind), f"n{node}.{kind}"
            if label not in free.place:
                continue
            row = free.place[label]
            for mine, theirs in zip(dofs, free.blocks, strict=True):
                mine[(mine < 0) & (theirs.dofs == row)] = len(labels)
            labels.append(label)
            nodes.append(int(free.dof_node[row]))
            found.append((node, kind))
        kinds = np.array([KINDS.index(k) for _, k in found], dtype=np.int64)
        model: Model = replace(
            base,
            labels=tuple(labels),
            dof_node=np.append(base.dof_node, np.array(nodes, dtype=np.int64)),
            dof_kind=np.append(base.dof_kind, kinds),
            blocks=tuple(replace(b, dofs=d) for b, d in zip(base.blocks, dofs, strict=True)),
        )
        return cls(model, tuple(found), base.size, edge_shares(base, tuple(found)))

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
        return 1.0 / float(np.mean(np.diag(self.within)))

    def tangent(self, unit: float) -> DerivativeBlock:
        """−k kᵀ per unit of compliance, exact at infinite stiffness."""
        used, k = self.across
        return DerivativeBlock(used[None], (-unit * ((k / self.shares) @ k.T))[None], *[None] * 3)

    def along(self, unit: float) -> LowRank:
        """The same at any size."""
        (used, k), apart = self.across, 1.0 / np.sqrt(self.shares)  # in which springs are alike
        within = apart[:, None] * self.within * apart
        return opened(used, k * apart, within, unit, np.ones_like)

    def sprung(self, unit: float) -> Model:
        """On springs to ground, rigid but for a ten thousandth."""
        model = self.model
        for kind in dict.fromkeys(k for _, k in self.held):
            model = replace(model, blocks=(*model.blocks, self._springs(model, kind, unit)))
        return model

    def _springs(self, model: Model, kind: str, unit: float) -> Block:
        """Of one kind of DOF."""
        own = [k == kind for _, k in self.held]
        block = small_block(
            model,
            Compliance(1, kind),
            self.rows[own][:, None],
            [KINDS.index(kind)],
            "K",
            np.ones((1, 1)),
            {"a": 0.0, "a0": unit / RIGID},
        )
        (term,) = block.terms
        shared = Term(term.matrix, term.coefficient, self.shares[own][:, None, None])
        return replace(block, terms=(shared,), geometry=np.arange(sum(own)))

    @property
    def along_edge(self) -> bool:
        """Whether they hold an edge of sheets, each the part of it that is its own."""
        return bool(np.any(self.shares != 1.0))


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
