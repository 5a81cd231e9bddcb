"""Rows of a problem file gathered by element type, and the blocks that they become."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import COMMON, Block, Dynamic, Index
from cvxupdate.fe.elements import Entries
from cvxupdate.fe.elements.base import ElementType, Given, Placed, Real, Surroundings, Term
from cvxupdate.fe.elements.matrix import split
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.shells.frames import shear_lengths
from cvxupdate.registry import ELEMENTS
from cvxupdate.spec import model as sm
from cvxupdate.spec.elements import Row

FARTHEST = 1e50
"""Metres: the square of a longer element is no number."""

Place = dict[tuple[int, int], int]
"""(node, kind) → number of the free DOF."""


@dataclass(frozen=True)
class Batch:
    """Rows of one element type, before their DOFs are numbered."""

    kind: ElementType
    ids: list[int] = field(default_factory=list)
    groups: list[str] = field(default_factory=list)
    nodes: list[tuple[int, ...]] = field(default_factory=list)
    orientation: list[tuple[float, float, float]] = field(default_factory=list)
    properties: dict[str, list[float]] = field(default_factory=dict)


@dataclass(frozen=True)
class GivenMatrix:
    """One matrix of a row, with the row's id and group and the factors that act on it."""

    matrix: Given
    id: int
    group: str
    properties: Mapping[str, float]


def gather(around: Surroundings) -> tuple[list[Batch], list[GivenMatrix]]:
    """Elements on nodes, one batch for each (type, options, section shape, DOF), and matrices on
    DOFs of their own."""
    found: dict[Any, Batch] = {}
    given: list[GivenMatrix] = []
    loss = _loss(around.text)
    for block in around.text.elements:
        kind = ELEMENTS.named(block.type)
        for row in block.rows:
            common = {**COMMON, **loss, **_own(row, around.text)}
            group = row.group or ""
            made: Iterable[Placed | Given] = kind.from_row(row, block, around)
            for part in made:
                if isinstance(part, Given):
                    given.append(GivenMatrix(part, row.id, group, common))
                    continue
                batch = found.setdefault(part.kind, Batch(part.kind))
                batch.ids.append(row.id)
                batch.groups.append(group)
                batch.nodes.append(row.get("nodes"))
                batch.orientation.append(part.orientation)
                for name, value in {**common, **part.properties}.items():
                    batch.properties.setdefault(name, []).append(value)
    return list(found.values()), given


def _loss(text: sm.Model) -> dict[str, float]:
    damping = text.damping
    if isinstance(damping, sm.StructuralDamping):
        return {"eta": damping.eta}
    if isinstance(damping, sm.RayleighDamping):
        return {"alpha": damping.alpha, "beta": damping.beta}
    return {"alpha": damping.alpha} if isinstance(damping, sm.ModalDamping) else {}


def _own(row: Row, text: sm.Model) -> dict[str, float]:
    """What an element says of itself: factors on its matrices, its loss factor (else that of its
    material)."""
    out = {word: row.get(f"{word}_factor", 1.0) for word in ("stiffness", "mass", "damping")}
    material = text.materials.get(row.get("material", ""))
    eta = row.get("eta")
    eta = eta if eta is not None or material is None else material.eta
    return out if eta is None else {**out, "eta": eta}


def block_of(
    batch: Batch,
    position: dict[int, int],
    xyz: Real,
    active: tuple[str, ...],
    place: Place,
) -> Block:
    """The block of a batch whose free DOFs are at ``place``; ``position`` numbers the nodes."""
    kind = batch.kind
    nodes = np.array([[position[n] for n in row] for row in batch.nodes], dtype=np.int64)
    points = xyz[nodes]
    keep = [i for i, d in enumerate(kind.dofs) if d in active]
    kinds = np.array([KINDS.index(kind.dofs[i]) for i in keep], dtype=np.int64)
    dofs = np.array(
        [[place.get((n, k), -1) for n in row for k in kinds] for row in nodes.tolist()],
        dtype=np.int64,
    )
    orientation = np.array(batch.orientation)
    unique, geometry = _distinct(points, orientation)
    law = kind.text.exact(kind) if kind.text.exact is not None else None
    try:
        terms = kind.terms(points[unique], orientation[unique])
        dynamic = () if law is None else law.terms(points[unique], orientation[unique])
    except ModelError as error:
        raise ModelError(f"elements {_span(batch.ids)}: {error}") from error
    columns = [n * len(kind.dofs) + i for n in range(kind.nodes) for i in keep]
    kept, dynamic = _cut(terms, columns), _cut(dynamic, columns)
    properties = {k: np.array(v, dtype=float) for k, v in batch.properties.items()}
    if kind.nodes == 2:
        with np.errstate(over="ignore"):
            properties["length"] = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
        if not np.all(properties["length"] < FARTHEST):
            raise ModelError(
                f"elements {_span(batch.ids)}: a length of {properties['length'].max():.3g} m is "
                "none. Check the coordinates of their nodes."
            )
    elif kind.text.outline == "surface":
        properties["length"] = shear_lengths(points)
    return Block(
        kind,
        np.array(batch.ids, dtype=np.int64),
        tuple(batch.groups),
        dofs,
        np.tile(kinds, kind.nodes)[None],
        kept,
        geometry,
        properties,
        nodes,
        exact=None if law is None else Dynamic(law, dynamic),
    )


def _cut(terms: Sequence[Term], columns: list[int]) -> tuple[Term, ...]:
    """The terms on some of their DOFs; those that vanish there are left out."""
    kept = [
        Term(t.matrix, t.coefficient, np.ascontiguousarray(t.values[:, columns][:, :, columns]))
        for t in terms
    ]
    return tuple(t for t in kept if np.any(t.values != 0.0))


def _distinct(points: Real, orientation: Real) -> tuple[Index, Index]:
    """Elements of one shape and attitude share their matrices: (first of each shape, shape of each
    element)."""
    relative = (points - points[:, :1]).reshape(len(points), -1)
    size = np.abs(relative).max(axis=1, keepdims=True)
    size[size == 0.0] = 1.0
    decade = np.floor(
        np.log10(size)
    )  # twelve digits of each element's own size: a small one beside large ones keeps its own
    key = np.hstack(
        [np.round(np.hstack([relative / size, size / 10.0**decade, orientation]), 12), decade]
    )
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return first.astype(np.int64), inverse.reshape(-1).astype(np.int64)


def given_blocks(
    given: Sequence[GivenMatrix], position: dict[int, int], place: Place
) -> list[Block]:
    """One block for each of K, M, C, D and entry size."""
    parts: dict[tuple[str, int], list[tuple[GivenMatrix, Index, Index, Real]]] = {}
    for g in given:
        dofs = np.array(
            [place.get((position[n], k), -1) for n, k in g.matrix.labels], dtype=np.int64
        )
        kinds = np.array([k for _, k in g.matrix.labels], dtype=np.int64)
        for size, (at, values) in split(g.matrix.values, f"matrix row {g.id}").items():
            if len(at):
                parts.setdefault((g.matrix.matrix, size), []).append(
                    (g, dofs[at], kinds[at], values)
                )
    blocks = []
    for (matrix, size), members in parts.items():
        ids = np.concatenate(
            [np.full(len(dofs), g.id, dtype=np.int64) for g, dofs, _, _ in members]
        )
        groups = tuple(g.group for g, dofs, _, _ in members for _ in range(len(dofs)))
        own = [(g.properties, len(dofs)) for g, dofs, _, _ in members]
        properties = {k: np.concatenate([np.full(n, v[k]) for v, n in own]) for k in COMMON}
        dofs, kinds = np.vstack([m[1] for m in members]), np.vstack([m[2] for m in members])
        values = np.vstack([m[3] for m in members])
        blocks.append(
            Block(
                Entries(matrix, size),
                ids,
                groups,
                dofs,
                kinds,
                (Term(matrix, "one", values),),
                np.arange(len(ids)),
                properties,
            )
        )
    return blocks


def _span(ids: Sequence[int]) -> str:
    return str(ids[0]) if len(ids) == 1 else f"{min(ids)} to {max(ids)}"
