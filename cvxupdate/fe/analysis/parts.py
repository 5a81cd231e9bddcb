"""The parts of the elements of a file on a finer mesh, element by element."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.build import build_model
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.refinement import Made, held_everywhere, refined
from cvxupdate.spec import Spec
from cvxupdate.spec import model as sm


@dataclass(frozen=True)
class Fine:
    """The divided elements of a structure without supports: ``model`` their finer mesh, the nodes
    ``made`` on it, and for each of its blocks the number of the block of the file (``of``)."""

    model: Model
    made: Mapping[int, Made]
    of: tuple[int, ...]

    @cached_property
    def kind(self) -> Index:
        """(DOFs,): 0 … 5."""
        return self.model.dof_kind

    @cached_property
    def node(self) -> Index:
        """(DOFs,): numbers of the nodes."""
        return self.model.node_ids[self.model.dof_node]


def fine_of(spec: Spec, file: Model, parts: Mapping[str, int]) -> Fine:
    """The elements of a problem whose types ``parts`` names, each edge in so many."""
    text = spec.model
    blocks = tuple(b for b in text.elements if parts.get(b.type, 1) > 1)
    alone = text.model_copy(update={"elements": blocks})
    made = refined(alone, lambda block, row: parts[block.type])
    everywhere = tuple(sorted(held_everywhere(text)))
    supports = (sm.Support(nodes="all", dofs=everywhere),) if everywhere else ()  # type: ignore[arg-type]
    # without what moves it, which the recordings say, too
    bare = made.model.model_copy(update={"supports": supports, "ties": (), "bases": ()})
    model = build_model(replace(spec, model=bare, update=None, recordings=()))
    kinds = [b.kind for b in file.blocks]
    return Fine(model, made.made, tuple(kinds.index(b.kind) for b in model.blocks))


@dataclass(frozen=True)
class Assembled:
    """The parts of one element: ``dofs`` (n,) of the fine model, and each term's matrix on them
    (n, n), with the scalars of the properties of today left out; ``scalars`` (matrix, term, value)
    of K and M."""

    dofs: Index
    terms: tuple[Real, ...]
    scalars: tuple[tuple[str, int, float], ...]

    def matrix(self, name: str) -> Real:
        """K or M as the properties are today."""
        out = np.zeros((len(self.dofs), len(self.dofs)))
        for matrix, i, value in self.scalars:
            if matrix == name:
                out += value * self.terms[i]
        return out


def assembled(block: Block, rows: Index, scalars: list[tuple[str, int, Real]]) -> Assembled:
    """The rows of a block, which are the parts of one element, together."""
    dofs = np.unique(block.dofs[rows])
    dofs = dofs[dofs >= 0]
    mine = block.geometry[rows]
    terms = tuple(summed(block, rows, dofs, t.values[mine]) for t in block.terms)
    one = tuple((m, i, float(np.real(v[rows[0]]))) for m, i, v in scalars)
    return Assembled(dofs, terms, one)


def summed(block: Block, rows: Index, dofs: Index, values: Real) -> Real:
    """Matrices (rows, d, d) of the ``rows`` of a block, on ``dofs`` (n,): (n, n)."""
    place = np.full(int(dofs[-1]) + 2, len(dofs))
    place[dofs] = np.arange(len(dofs))
    at = np.where(block.dofs[rows] >= 0, place[block.dofs[rows]], len(dofs))
    n = len(dofs) + 1
    flat = (at[:, :, None] * n + at[:, None, :]).reshape(-1)
    whole = np.asarray(np.bincount(flat, values.reshape(-1), n * n), dtype=float)
    return whole.reshape(n, n)[:-1, :-1]
