"""What a finer mesh would make of any mode of rods and beams, from its shape.

The stiffness of a prismatic member is exact whatever its parts; what the mesh leaves out is the
inertia of what happens between the nodes. The nodes of a finer mesh move as static bending has them
(u = T q), and further by what their own inertia bends: u = (T + λ X) q with X = K_ii⁻¹ R,
R = M_ic + M_ii T (the first two terms of an exact dynamic condensation: Leung 1978). Rayleigh's
quotient of that is the eigenvalue on the finer mesh, to the square of its distance, for every mode
that a model may have: beside a hinge, a lump or cords as well as without. Element by element, so
that it follows an end that an effect sets free.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.types import Real
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.model import Model

EXACT = 1e-8  # of a member's stiffness: as far as rounding may have its parts differ from it
STILL = 1e-12  # of the largest eigenvalue: what is below does not swing


@dataclass(frozen=True)
class Members:
    """Elements ``rows`` (e,) of block number ``block``; on their columns (e, d, d) ``stiffness``
    and ``mass`` that their parts have more, ``second`` Rᵀ X and ``third`` Xᵀ M_ii X."""

    block: int
    rows: Index
    stiffness: Real
    mass: Real
    second: Real
    third: Real

    def on(self, model: Model) -> Index:
        """Their DOFs (e, d) on a model that has grown from the one they were found on."""
        return model.blocks[self.block].dofs[self.rows]


@dataclass(frozen=True)
class Inner:
    """What is inside the ``members`` of a model, block by block."""

    members: tuple[Members, ...]

    def ratio(self, model: Model, eigenvalues: Real, shapes: Real) -> Real:
        """By which eigenvalues (modes,) of a model grown from the nominal one go to those of the
        finer mesh; ``shapes`` (n, modes), M-orthonormal. 1 for what does not swing."""
        lam = np.maximum(eigenvalues, 0.0)
        swings = lam > STILL * lam.max(initial=0.0)
        held = np.vstack([shapes, np.zeros((1, shapes.shape[1]))])
        stiffness, mass, second, third = np.zeros((4, len(lam)))
        for m in self.members:
            at = held[m.on(model)]  # (e, d, modes); −1, held, is the last row
            stiffness, mass, second, third = (
                total + np.einsum("edm,edm->m", at, values @ at)
                for total, values in (
                    (stiffness, m.stiffness),
                    (mass, m.mass),
                    (second, m.second),
                    (third, m.third),
                )
            )
        top = 1.0 + lam * second + stiffness / np.where(swings, lam, 1.0)
        bottom = 1.0 + mass + 2.0 * lam * second + lam**2 * third
        return np.asarray(np.where(swings, top / bottom, 1.0))


def inner_of(model: Model, fine: Model) -> Inner | None:
    """What is inside the members that a ``fine`` model has in parts (of the same numbers, block by
    block); None where blocks are others, or their inside is held by nothing."""
    if [b.kind.name for b in model.blocks] != [b.kind.name for b in fine.blocks]:
        return None
    found = []
    for number, (block, parts) in enumerate(zip(model.blocks, fine.blocks, strict=True)):
        if block.nodes is None or len(parts.ids) == len(block.ids):
            continue
        try:
            found.append(_members(model, fine, number, block, parts))
        except np.linalg.LinAlgError:
            return None
    return Inner(tuple(found))


def _members(model: Model, fine: Model, number: int, block: Block, parts: Block) -> Members:
    whole, pieces = (b.combine(b.scalars(b.properties)) for b in (block, parts))
    zero = np.zeros(pieces["K"].shape)
    K, M = pieces["K"], pieces.get("M", zero)
    of: dict[int, list[int]] = {}
    for row, element in enumerate(parts.ids.tolist()):
        of.setdefault(element, []).append(row)
    rows, values = [], []
    for row, element in enumerate(block.ids.tolist()):
        own = of.get(element, [])
        if len(own) < 2:
            continue
        ends = list(_columns(model, block, row))
        places = [list(_columns(fine, parts, k)) for k in own]
        dofs = [parts.dofs[k].tolist() for k in own]
        condensed = _condensed(ends, places, dofs, K[own], M[own])
        condensed[0] -= whole["K"][row]
        condensed[1] -= whole["M"][row] if "M" in whole else 0.0
        if np.abs(condensed[0]).max() <= EXACT * np.abs(whole["K"][row]).max():
            condensed[0] = 0.0  # differences of large numbers say nothing of slow modes
        rows.append(row)
        values.append(condensed)
    d = block.dofs.shape[1]
    every = np.array(values).reshape(-1, 4, d, d)
    return Members(number, np.array(rows, dtype=np.int64), *(every[:, k] for k in range(4)))


def _columns(model: Model, block: Block, row: int) -> Iterator[tuple[int, int]]:
    """(node, kind) of an element's columns."""
    if block.nodes is None:
        return
    kinds = block.direction[row if len(block.direction) > 1 else 0]
    each = len(kinds) // block.nodes.shape[1]
    for k, kind in enumerate(kinds.tolist()):
        yield int(model.node_ids[block.nodes[row][k // each]]), int(kind)


def _condensed(
    ends: Sequence[tuple[int, int]],
    places: Sequence[Sequence[tuple[int, int]]],
    dofs: Sequence[Sequence[int]],
    K: Real,
    M: Real,
) -> Real:
    """K, M, Rᵀ X and Xᵀ M_ii X of the parts of one member on its ``ends``, (4, d, d); of what lies
    between, only what is free moves."""
    at = {key: k for k, key in enumerate(ends)}
    for keys, own in zip(places, dofs, strict=True):
        for key, dof in zip(keys, own, strict=True):
            if key not in at and dof >= 0:
                at[key] = len(at)
    n, d = len(at), len(ends)
    k, m = np.zeros((2, n + 1, n + 1))
    for keys, stiff, heavy in zip(places, K, M, strict=True):
        rows = np.array([at.get(key, n) for key in keys])  # the last: what is held
        k[np.ix_(rows, rows)] += stiff
        m[np.ix_(rows, rows)] += heavy
    inside, c = slice(d, n), slice(0, d)
    T = np.linalg.solve(k[inside, inside], -k[inside, c])
    R = m[inside, c] + m[inside, inside] @ T
    X = np.linalg.solve(k[inside, inside], R)
    across = m[c, inside] @ T
    return np.stack(
        [
            k[c, c] + k[c, inside] @ T,
            m[c, c] + across + across.T + T.T @ m[inside, inside] @ T,
            R.T @ X,
            X.T @ m[inside, inside] @ X,
        ]
    )
