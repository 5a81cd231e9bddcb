"""The refined elements of one block of a file, and what is done to their matrices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.fe.analysis.reduced import Inner
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real, Term
from cvxupdate.fe.model import Model

INSIDE = 6  # direction of an inner DOF: none of the six
RIGID = 1e-6  # of a term's size: the strain energy of a rigid motion that strains nothing


@dataclass(frozen=True)
class Piece:
    """The elements of one block of the file: its ``number``, the ``inner`` DOFs of each element,
    the ``parts`` of an edge, and the ``terms`` (elements, d, d) on its own
    DOFs and the inner ones."""

    number: int
    inner: tuple[tuple[Inner, ...], ...]
    parts: int
    terms: tuple[Term, ...]

    def only(self, families: frozenset[str]) -> Piece:
        """With the inner DOFs of some families."""
        own = self.terms[0].values.shape[1] - len(self.inner[0])
        kept = [j for j, x in enumerate(self.inner[0]) if x.family in families]
        at = [*range(own), *(own + j for j in kept)]
        terms = tuple(
            Term(t.matrix, t.coefficient, np.ascontiguousarray(t.values[:, at][:, :, at]))
            for t in self.terms
        )
        inner = tuple(tuple(row[j] for j in kept) for row in self.inner)
        return replace(self, inner=inner, terms=terms)

    def on(self, block: Block, place: Mapping[str, int]) -> Block:
        """The block of the file with these matrices, inner DOFs at ``place``."""
        inner = np.array([[place.get(x.label, -1) for x in row] for row in self.inner])
        inner = inner.reshape(len(block.ids), -1).astype(np.int64)
        lines = {}
        if "length" in block.properties:
            lines = {"length": block.properties["length"] / self.parts}
        marks = np.full((len(block.direction), inner.shape[1]), INSIDE)
        return replace(
            block,
            dofs=np.hstack([block.dofs, inner]),
            direction=np.hstack([block.direction, marks]),
            terms=self.terms,
            geometry=np.arange(len(block.ids)),
            properties={**block.properties, **lines},
            own=block.dofs.shape[1],
            parts=self.parts,
        )


def limit(file: Model, coarse: Piece, fine: Piece) -> Piece:
    """Where coefficients do not depend on the length of a part: (4 fine − coarse) / 3; none of what
    it does to the stiffest shapes may make an energy negative."""
    block = file.blocks[fine.number]
    if "shear" in block.kind.properties and "length" in block.properties:
        return fine
    if [x.label for row in coarse.inner for x in row] != [
        x.label for row in fine.inner for x in row
    ]:
        return fine
    terms = tuple(
        Term(b.matrix, b.coefficient, (4.0 * b.values - a.values) / 3.0)
        for a, b in zip(coarse.terms, fine.terms, strict=True)
    )
    found = replace(fine, terms=tuple(_positive(t) if _mass(t) else t for t in terms))
    return found if _sound(block, found) else fine


def _mass(term: Term) -> bool:
    """Whether it is positive by itself; what makes shear lag behind is so beside others only."""
    return term.matrix == "M" and term.coefficient != "lag"


def _positive(term: Term) -> Term:
    """Masses without negative eigenvalues."""
    values, vectors = np.linalg.eigh(term.values)
    clipped = np.einsum("eij,ej,ekj->eik", vectors, np.maximum(values, 0.0), vectors)
    return Term(term.matrix, term.coefficient, clipped)


def _sound(block: Block, piece: Piece) -> bool:
    """Whether no stiffness and no mass is negative, as the properties are today."""
    whole = replace(block, terms=piece.terms, geometry=np.arange(len(block.ids)))
    scalars = [x for x in whole.scalars(whole.properties) if x[0] in "KM"]
    made = whole.combine(scalars) if scalars else {}
    found = [np.linalg.eigvalsh(made[m]) for m in {x[0] for x in scalars}]
    return all(bool(np.all(v[:, 0] >= -RIGID * v[:, -1])) for v in found)


def unstrained(file: Model, piece: Piece) -> Piece:
    """Stiffnesses that rigid motions of an element do not strain, freed of rounding (a preload
    resists rotation)."""
    block = file.blocks[piece.number]
    nodes = np.zeros((0, 2), dtype=np.int64) if block.nodes is None else block.nodes
    motions = [_motions(file, block, n, len(i)) for n, i in zip(nodes, piece.inner, strict=True)]
    terms = []
    for t in piece.terms:
        values = t.values.copy()
        for e, R in enumerate(motions if t.matrix == "K" else ()):
            K = values[e]
            strained = np.abs(np.einsum("ia,ij,ja->a", R, K, R))
            size = np.einsum("ia,ij,ja->a", np.abs(R), np.abs(K), np.abs(R))
            Q, s, _ = np.linalg.svd(R[:, strained <= RIGID * size], full_matrices=False)
            Q = Q[:, s > 1e-10 * s.max(initial=0.0)]
            clean = K - Q @ (Q.T @ K)
            values[e] = clean - (clean @ Q) @ Q.T
        terms.append(Term(t.matrix, t.coefficient, values))
    return replace(piece, terms=tuple(terms))


def _motions(file: Model, block: Block, nodes: Index, inner: int) -> Real:
    """Rigid motions about the first node, (d, 6), lengths in units of the element's."""
    per = block.direction.shape[1] // len(nodes)
    kinds = block.direction[0, :per]
    r = file.xyz[nodes] - file.xyz[nodes[0]]
    size = float(np.abs(r).max())
    rows = []
    for arm in r / size:
        turns = np.cross(np.eye(3), arm)  # (axis, component)
        for k in kinds.tolist():
            row = np.zeros(6)
            row[k] = 1.0 if k < 3 else 1.0 / size
            if k < 3:
                row[3:] = turns[:, k]
            rows.append(row)
    return np.vstack([np.array(rows), np.zeros((inner, 6))])
