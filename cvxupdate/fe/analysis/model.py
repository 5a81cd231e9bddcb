"""The analysis model of a problem file (see the package)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.fe.analysis.edges import Edge
from cvxupdate.fe.analysis.parts import Fine, assembled, fine_of
from cvxupdate.fe.analysis.reduced import Inner, inner_of, matrices
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real, Term
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model
from cvxupdate.fe.refinement import held_kinds
from cvxupdate.spec import Spec

DIVIDED = ("rod", "beam2d", "beam3d", "plate")  # types of elements that have parts
# times as many parts of a line as of the edge of a sheet: those that deform in shear converge with
# the square of their length and are not extrapolated, and cost next to nothing
LINES = {"rod": 2, "beam2d": 2, "beam3d": 2}
INSIDE = 6  # direction of an inner DOF: none of the six
RIGID = 1e-6  # of a term's size: the strain energy of a rigid motion that strains nothing
NOTHING = 1e-12  # of the largest stiffness of a term: none
SAME = 12  # digits to which two elements are alike


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


@dataclass(frozen=True)
class Analysis:
    """Refined elements (``pieces``) for any model on the mesh of the file; each edge in ``parts``;
    ``inner`` the DOFs that they bring; ``finest`` the elements before they were extrapolated."""

    parts: int
    pieces: tuple[Piece, ...]
    inner: tuple[Inner, ...]
    finest: tuple[Piece, ...]

    @property
    def plain(self) -> Analysis:
        """Without extrapolation."""
        return replace(self, pieces=self.finest)

    def on(self, file: Model) -> Model:
        """The model of the file (or one that differs by its supports) with refined elements."""
        free = [x for x in self.inner if not x.ends or any(label in file.place for label in x.ends)]
        place = {x.label: file.size + i for i, x in enumerate(free)}
        blocks = list(file.blocks)
        for piece in self.pieces:
            blocks[piece.number] = piece.on(blocks[piece.number], place)
        at = {int(n): i for i, n in enumerate(file.node_ids)}
        nodes = np.array([at[x.node] for x in free], dtype=np.int64)
        return replace(
            file,
            labels=(*file.labels, *(x.label for x in free)),
            dof_node=np.concatenate([file.dof_node, nodes]),
            dof_kind=np.concatenate([file.dof_kind, np.full(len(nodes), INSIDE)]),
            blocks=tuple(blocks),
        )

    def only(self, families: frozenset[str]) -> Analysis:
        """With the inner DOFs of some families."""
        return replace(
            self,
            pieces=tuple(p.only(families) for p in self.pieces),
            finest=tuple(p.only(families) for p in self.finest),
            inner=tuple(x for x in self.inner if x.family in families),
        )

    @property
    def families(self) -> tuple[str, ...]:
        """Kinds of inner DOFs."""
        return tuple(dict.fromkeys(x.family for x in self.inner))


def analysis_of(spec: Spec, file: Model, parts: int) -> Analysis | None:
    """With every edge of every element in so many ``parts``; None where there is no element that
    can be divided. Where errors are of second order in the length of a part, from half as many and
    as many to the limit (Richardson 1911).

    Raises
    ------
    ModelError
        Where the inside of an element is a mechanism.
    """
    types = {b.type for b in spec.model.elements} & set(DIVIDED)
    if not types:
        return None
    coarse, fine = (
        [_rigid(file, p) for p in _level(spec, file, {t: n * LINES.get(t, 1) for t in types})]
        for n in (parts // 2, parts)
    )
    pieces = [_limit(file, a, b) for a, b in zip(coarse, fine, strict=True)]
    resisted = _resisted(pieces)
    inner = {x.label: x for p in pieces for row in p.inner for x in row if x.label in resisted}
    whole = Analysis(parts, tuple(pieces), tuple(inner.values()), tuple(fine))
    return whole.only(frozenset(x.family for x in inner.values()))


def _level(spec: Spec, file: Model, parts: Mapping[str, int]) -> list[Piece]:
    held, fine = held_kinds(spec.model), fine_of(spec, file, parts)
    blocks = enumerate(fine.model.blocks)
    return [_piece(file, fine, k, parts[b.kind.name], held) for k, b in blocks]


def _piece(
    file: Model, fine: Fine, number: int, parts: int, held: Mapping[int, frozenset[str]]
) -> Piece:
    block, own = fine.model.blocks[number], file.blocks[fine.of[number]]
    scalars = [x for x in block.scalars(block.properties) if x[0] in "KM"]
    per = len(block.ids) // len(own.ids)
    known: dict[object, tuple[tuple[Real, ...], Index]] = {}
    terms: list[list[Real]] = [[] for _ in block.terms]
    inner = []
    for e, nodes in enumerate([] if own.nodes is None else own.nodes):
        rows = np.arange(per * e, per * (e + 1))
        edges = _edges(file, fine, own, nodes, held)
        labels = _own_labels(file, own, nodes)
        key = (
            block.geometry[rows].tobytes(),
            np.round(file.xyz[nodes] - file.xyz[nodes[0]], SAME).tobytes(),
            tuple((k.ruled, k.turns) for k in edges),
            tuple(np.argsort(file.node_ids[nodes]).tolist()),
            tuple(float(np.real(v[rows[0]])) for _, _, v in scalars),
        )
        if key not in known:
            whole = assembled(block, rows, scalars)
            known[key] = matrices(fine, whole, labels, edges)
        found, inside = known[key]
        for out, matrix in zip(terms, found, strict=True):
            out.append(matrix)
        first = int(file.node_ids[nodes[0]])
        inner.append(tuple(inner_of(edges, int(own.ids[e]), first, inside)))
    made = tuple(
        Term(t.matrix, t.coefficient, np.array(v)) for t, v in zip(block.terms, terms, strict=True)
    )
    return Piece(fine.of[number], tuple(inner), parts, made)


def _own_labels(file: Model, block: Block, nodes: Index) -> list[str]:
    per = block.direction.shape[1] // len(nodes)
    kinds = [KINDS[int(k)] for k in block.direction[0, :per]]
    return [f"n{file.node_ids[n]}.{k}" for n in nodes for k in kinds]


def _edges(
    file: Model, fine: Fine, block: Block, nodes: Index, held: Mapping[int, frozenset[str]]
) -> list[Edge]:
    """Around a sheet, or the one of a line."""
    ids = [int(file.node_ids[n]) for n in nodes]
    place = dict(zip(ids, file.xyz[nodes], strict=True))
    sheet = len(ids) > 2
    pairs = list(zip(ids, [*ids[1:], ids[0]], strict=True)) if sheet else [(ids[0], ids[1])]
    turns = any(k.startswith("r") for k in block.kind.dofs)
    rims = {frozenset(m.weights) for m in fine.made.values() if m.sheets == 1}
    out = []
    for a, b in (sorted(p) for p in pairs):
        edge = Edge(a, b, place[a], place[b], turns, frozenset((a, b)) in rims)
        both = held.get(a, frozenset()) & held.get(b, frozenset())
        out.append(replace(edge, ruled=edge.rim and turns and _ruled(edge, both)))
    return out


def _ruled(edge: Edge, both: frozenset[str]) -> bool:
    """Whether a translation across it is held at both ends, and not the rotation that bends it."""
    e = edge.axes[0]
    for k in range(3):
        if KINDS[k] in both and abs(e[k]) < 0.99:
            about = np.cross(e, np.eye(3)[k])
            needed = {KINDS[3 + j] for j in range(3) if abs(about[j]) > 1e-6}
            if not needed <= both:
                return True
    return False


def _limit(file: Model, coarse: Piece, fine: Piece) -> Piece:
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
    limit = replace(fine, terms=tuple(_positive(t) if t.matrix == "M" else t for t in terms))
    return limit if _sound(block, limit) else fine


def _positive(term: Term) -> Term:
    """Masses without negative eigenvalues."""
    values, vectors = np.linalg.eigh(term.values)
    clipped = np.einsum("eij,ej,ekj->eik", vectors, np.maximum(values, 0.0), vectors)
    return Term(term.matrix, term.coefficient, clipped)


def _sound(block: Block, piece: Piece) -> bool:
    """Whether no stiffness is negative, as the properties are today."""
    whole = replace(block, terms=piece.terms, geometry=np.arange(len(block.ids)))
    scalars = [x for x in whole.scalars(whole.properties) if x[0] == "K"]
    values = np.linalg.eigvalsh(whole.combine(scalars)["K"]) if scalars else np.zeros((1, 1))
    return bool(np.all(values[:, 0] >= -RIGID * values[:, -1]))


def _rigid(file: Model, piece: Piece) -> Piece:
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


def _resisted(pieces: Sequence[Piece]) -> set[str]:
    """Labels of the inner DOFs that some element resists."""
    out: set[str] = set()
    for p in pieces:
        for t in p.terms:
            if t.matrix != "K" or not p.inner:
                continue
            own = t.values.shape[1] - len(p.inner[0])
            stiff = np.abs(np.diagonal(t.values, axis1=1, axis2=2)[:, own:])
            felt = stiff > NOTHING * stiff.max(initial=0.0)
            for row, marks in zip(p.inner, felt, strict=True):
                out |= {x.label for x, mark in zip(row, marks.tolist(), strict=True) if mark}
    return out
