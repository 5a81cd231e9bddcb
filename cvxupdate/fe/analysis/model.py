"""The analysis model of a problem file (see the package)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.analysis.corners import corner_names, corner_nodes, corner_terms
from cvxupdate.fe.analysis.edges import Edge
from cvxupdate.fe.analysis.held import with_held_edges
from cvxupdate.fe.analysis.parts import Fine, assembled, fine_of
from cvxupdate.fe.analysis.piece import INSIDE, Piece, limit, unstrained
from cvxupdate.fe.analysis.reduced import Inner, inner_of, matrices
from cvxupdate.fe.analysis.solid import LAG, TERMS, TURNING, beyond
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
FEWEST = 4  # parts: of half as many an edge still has a point of its own
LACKING = {"sheared": TURNING, "turning": LAG}  # of sheets that are solids in part
NOTHING = 1e-12  # of the largest stiffness of a term: none
ALONG = 1e-6  # component of a direction that counts
SAME = 12  # digits to which two elements are alike


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
        fine = replace(
            file,
            labels=(*file.labels, *(x.label for x in free)),
            dof_node=np.concatenate([file.dof_node, nodes]),
            dof_kind=np.concatenate([file.dof_kind, np.full(len(nodes), INSIDE)]),
            blocks=tuple(blocks),
        )
        return with_held_edges(file, fine, free)

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


def analysis_of(
    spec: Spec,
    file: Model,
    parts: int,
    solid: bool = False,
    known: dict[int, list[Piece]] | None = None,
) -> Analysis | None:
    """With every edge of every element in so many ``parts``; None where there is no element that
    can be divided. Where errors are of second order in the length of a part, from half as many and
    as many to the limit (Richardson 1911). ``solid``: sheets with what Kirchhoff leaves out of a
    solid (`cvxupdate.fe.analysis.solid`), beams with what centre lines leave out of a frame
    (`cvxupdate.fe.analysis.corners`: nothing unless the property ``corner`` is moved). ``known``:
    pieces by their parts that were made before, to which these are added.

    Raises
    ------
    ModelError
        Where parts are too few, or the inside of an element is a mechanism.
    """
    types = {b.type for b in spec.model.elements} & set(DIVIDED)
    if not types:
        return None
    if min(parts * LINES.get(t, 1) for t in types) < FEWEST:
        raise ModelError(
            f"Finer elements need each edge in at least {FEWEST} parts, for half as many tell how "
            f"far they are from the limit; got {parts}."
        )
    known = {} if known is None else known
    for n in {parts // 2, parts} - set(known):
        level = _level(spec, file, {t: n * LINES.get(t, 1) for t in types}, solid)
        known[n] = [unstrained(file, p) for p in level]
    coarse, fine = known[parts // 2], known[parts]
    pieces = [limit(file, a, b) for a, b in zip(coarse, fine, strict=True)]
    resisted = _resisted(pieces)
    inner = {x.label: x for p in pieces for row in p.inner for x in row if x.label in resisted}
    whole = Analysis(parts, tuple(pieces), tuple(inner.values()), tuple(fine))
    return whole.only(frozenset(x.family for x in inner.values()))


def as_stated(spec: Spec, file: Model, parts: int | None = None) -> Model:
    """The model of a problem on so many parts of its elements, by default as [model] ``refine``
    says; as it is where none are asked for or nothing can be divided.

    Raises
    ------
    InputError
        `solid` without `refine`.
    ModelError
        Where the inside of an element is a mechanism.
    """
    parts, solid = spec.model.refine if parts is None else parts, spec.model.solid
    if solid and parts is None:
        raise InputError(
            f"{spec.path}: model.solid: is of finer parts only. Add refine = 8, or leave it out."
        )
    found = None if parts is None else analysis_of(spec, file, parts, bool(solid))
    return file if found is None else _in_part(found.on(file), solid)


def _in_part(model: Model, solid: bool | str) -> Model:
    """With what sheets are said to have of it."""
    lacking = LACKING.get(str(solid))
    if lacking is None:
        return model
    blocks = (
        replace(b, properties={**b.properties, lacking: np.zeros(len(b.ids))})
        if lacking in b.kind.properties
        else b
        for b in model.blocks
    )
    return replace(model, blocks=tuple(blocks))


def _level(spec: Spec, file: Model, parts: Mapping[str, int], solid: bool) -> list[Piece]:
    held, fine = held_kinds(spec.model), fine_of(spec, file, parts)
    blocks = enumerate(fine.model.blocks)
    return [_piece(file, fine, k, parts[b.kind.name], held, solid) for k, b in blocks]


def _piece(
    file: Model,
    fine: Fine,
    number: int,
    parts: int,
    held: Mapping[int, frozenset[str]],
    solid: bool,
) -> Piece:
    block, own = fine.model.blocks[number], file.blocks[fine.of[number]]
    scalars = [x for x in block.scalars(block.properties) if x[0] in "KM"]
    per = len(block.ids) // len(own.ids)
    known: dict[object, tuple[tuple[Real, ...], Index]] = {}
    thick = solid and block.kind.name == "plate"
    further = TERMS if thick else corner_names(block) if solid else ()
    names = [*((t.matrix, t.coefficient) for t in block.terms), *further]
    corners = corner_nodes(file) if further and not thick else frozenset()
    terms: list[list[Real]] = [[] for _ in names]
    inner = []
    for e, nodes in enumerate([] if own.nodes is None else own.nodes):
        rows = np.arange(per * e, per * (e + 1))
        edges = _edges(file, fine, own, nodes, held)
        labels = _own_labels(file, own, nodes)
        ends = tuple(int(n) in corners for n in nodes)
        key = (
            ends,
            block.geometry[rows].tobytes(),
            np.round(file.xyz[nodes] - file.xyz[nodes[0]], SAME).tobytes(),
            tuple((k.ruled, k.turns, k.rim, k.clamped) for k in edges),
            tuple(np.argsort(file.node_ids[nodes]).tolist()),
            tuple(float(np.real(v[rows[0]])) for _, _, v in scalars),
        )
        if key not in known:
            whole = assembled(block, rows, scalars)
            if thick:
                more = beyond(fine, block, rows, whole.dofs, edges)
                whole = replace(whole, terms=(*whole.terms, *more))
            elif further:
                length = float(np.linalg.norm(file.xyz[nodes[1]] - file.xyz[nodes[0]]))
                more = corner_terms(block, rows, whole.dofs, (ends[0], ends[1]), length)
                whole = replace(whole, terms=(*whole.terms, *more))
            known[key] = matrices(fine, whole, labels, edges)
        found, inside = known[key]
        for out, matrix in zip(terms, found, strict=True):
            out.append(matrix)
        first = int(file.node_ids[nodes[0]])
        inner.append(tuple(inner_of(edges, int(own.ids[e]), first, inside)))
    made = tuple(Term(m, c, np.array(v)) for (m, c), v in zip(names, terms, strict=True))
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
        edge = Edge(a, b, place[a], place[b], turns, frozenset((a, b)) in rims, line=not sheet)
        both = held.get(a, frozenset()) & held.get(b, frozenset())
        out.append(
            replace(
                edge,
                ruled=edge.rim and turns and _ruled(edge, both),
                clamped=sheet and turns and _clamped(edge, both),
            )
        )
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


def _clamped(edge: Edge, both: frozenset[str]) -> bool:
    """Whether both ends hold what is upright to it and the rotation about it."""
    e, _, up, _ = edge.axes
    held = [np.array([k in both for k in KINDS[i : i + 3]]) for i in (0, 3)]
    return all(not np.any(np.abs(d[~h]) > ALONG) for d, h in zip((up, e), held, strict=True))


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
