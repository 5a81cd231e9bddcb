"""A model in the coordinates of a space of shapes, of which the first are chosen DOFs of its own: a
small model that every method takes like any other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg as la

from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements.base import Term
from cvxupdate.fe.elements.matrix import Entries
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter, Target
from cvxupdate.fe.synthesis.projected import projected
from cvxupdate.fe.synthesis.space import Space
from cvxupdate.fe.terms import Real

TELLS = 1e-6  # least of the largest singular value: DOFs that the shapes can move one by one


@dataclass(frozen=True)
class Coordinates:
    """``model`` of r DOFs, and the ``lift`` (N, r) from there to the DOFs of the model that it
    stands for."""

    model: Model
    lift: Real = field(repr=False)

    def lowered(self, shapes: Real, M: Real) -> Real:
        """Shapes (N, m) as coordinates (r, m), by least squares in the mass matrix."""
        carried = M @ self.lift
        inside = la.cho_factor(self.lift.T @ carried)
        return np.asarray(la.cho_solve(inside, carried.T @ shapes))


def coordinates_of(space: Space, chosen: Index) -> Coordinates | None:
    """The model of a space with its DOFs ``chosen`` (rows, each once) as the first coordinates;
    None where the shapes cannot move these one by one."""
    full, s = space.model, len(chosen)
    U, values, W = la.svd(space.V[chosen], full_matrices=True)
    if s > len(W) or (s and values[-1] <= TELLS * values[0]):
        return None
    turn = np.hstack([W[:s].T @ (U.T / values[:, None]), W[s:].T])
    made = projected(full, space.V)
    blocks = [_entries(k, turn.T @ A @ turn) for k, A in made.fixed.items() if k in "KM"]
    places: dict[tuple[int, int], int] = {}
    for part in made.parts:
        places[part.number, part.row] = len(blocks)
        sums = {i: made.sums.terms[at] for i, at in part.terms.items()}
        blocks.append(_part(full.blocks[part.number], part.row, sums, turn))
    labels = tuple(full.labels[k] for k in chosen.tolist())
    model = replace(
        full,
        labels=(*labels, *(f"shape {k}" for k in range(len(W) - s))),
        dof_node=np.zeros(len(W), dtype=np.int64),
        dof_kind=np.zeros(len(W), dtype=np.int64),
        blocks=tuple(blocks),
        parameters=tuple(_moved(q, places) for q in full.parameters),
        ties=tuple(tie for tie in full.ties if tie[1] in labels),
    )
    return Coordinates(model, space.V @ turn)


def _entries(matrix: str, A: Real) -> Block:
    """A matrix that no parameter moves."""
    r = len(A)
    return Block(
        Entries(matrix, r),
        np.zeros(1, dtype=np.int64),
        ("",),
        np.arange(r)[None],
        np.zeros((1, r), dtype=np.int64),
        (Term(matrix, "one", A[None]),),
        np.zeros(1, dtype=np.int64),
        {k: np.full(1, v) for k, v in COMMON.items()},
    )


def _part(block: Block, row: int, terms: Mapping[int, Real], turn: Real) -> Block:
    """Elements that have one another's factors, as one element of all coordinates."""
    r = turn.shape[1]
    made = tuple(
        replace(t, values=(turn.T @ terms[i] @ turn if i in terms else np.zeros((r, r)))[None])
        for i, t in enumerate(block.terms)
    )
    return replace(
        block,
        ids=block.ids[row : row + 1],
        groups=block.groups[row : row + 1],
        dofs=np.arange(r)[None],
        direction=np.zeros((1, r), dtype=np.int64),
        terms=made,
        geometry=np.zeros(1, dtype=np.int64),
        properties={k: v[row : row + 1] for k, v in block.properties.items()},
        nodes=None,
        own=None,
    )


def _moved(q: Parameter, places: dict[tuple[int, int], int]) -> Parameter:
    """A parameter of the parts in place of their elements."""
    targets = []
    for t in q.targets:
        for k, row in enumerate(t.rows.tolist()):
            at = places.get((t.block, row))
            if at is not None:
                zero = np.zeros(1, dtype=np.int64)
                targets.append(Target(at, zero, t.properties, t.scales[:, k : k + 1]))
    return replace(q, targets=tuple(targets))
