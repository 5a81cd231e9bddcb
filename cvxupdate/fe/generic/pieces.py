"""The matrices of single elements as they stand, with their places: what families start from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from cvxupdate.fe.block import COMMON, Index
from cvxupdate.fe.elements.base import Given as OwnMatrix
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.generic.entries import GenericChange
from cvxupdate.fe.generic.shape import ElementShape
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model


class Given(Protocol):
    """A matrix of a row from another program (`fe.batches.GivenMatrix`)."""

    @property
    def matrix(self) -> OwnMatrix: ...  # noqa: D102
    @property
    def id(self) -> int: ...  # noqa: D102
    @property
    def properties(self) -> Mapping[str, float]: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class Piece:
    """One element: ``K`` and ``M`` (d, d), ``dofs`` (d,) places among the free DOFs (−1: held),
    ``kind`` (d,) of each, ``properties`` of all elements (`fe.block.COMMON`), ``shape`` None where
    its places are not known."""

    K: Real
    M: Real
    dofs: Index
    kind: Index
    properties: Mapping[str, float]
    shape: ElementShape | None

    @cached_property
    def key(self) -> bytes:
        """The same for elements that are equal to ten digits, wherever they are."""
        parts = [self.K / max(np.abs(self.K).max(), 1e-300)]
        parts += [self.M / max(np.abs(self.M).max(), 1e-300), self.kind[None]]
        sizes = [float(f"{np.abs(A).max():.9e}") for A in (self.K, self.M)]
        if self.shape is not None:
            r = self.shape.xyz - self.shape.centre
            parts += [r / self.shape.length, self.shape.node[None]]
            sizes.append(float(f"{self.shape.length:.9e}"))
        rounded = [np.round(p, 10).ravel() + 0.0 for p in parts]
        return np.concatenate([*rounded, sizes]).tobytes()

    @cached_property
    def local(self) -> Real:
        """(d, 6 k), what takes its DOFs to its own axes; the DOFs as they are where nothing is
        known."""
        if self.shape is None:
            return np.eye(len(self.K))
        return np.asarray(self.shape.own_axes(self.K) / self.shape.scale[:, None])


def pieces_of(model: Model, wanted: frozenset[int], given: Sequence[Given]) -> dict[int, Piece]:
    """The elements ``wanted`` (empty: all that there are) that stand on nodes, or came as a matrix.

    Rows of a spring, lump or damper are no elements of this kind: one number is all they have.
    """
    out: dict[int, Piece] = {}
    for block in model.blocks:
        if block.nodes is None or block.nodes.shape[1] < 2 or not wanted.intersection(block.ids):
            continue
        mats = block.combine(block.scalars(block.properties))
        zero = np.zeros((len(block.ids), block.dofs.shape[1], block.dofs.shape[1]))
        K, M = (np.asarray(mats.get(name, zero).real) for name in "KM")
        each = block.dofs.shape[1] // block.nodes.shape[1]
        node = np.repeat(np.arange(block.nodes.shape[1]), each)
        for i, number in enumerate(block.ids.tolist()):
            if number not in wanted:
                continue
            kind = block.direction[i if len(block.direction) > 1 else 0]
            shape = ElementShape(model.xyz[block.nodes[i]], node, kind)
            common = {k: float(block.properties[k][i]) for k in COMMON}
            out[number] = Piece(K[i], M[i], block.dofs[i], kind, common, shape)
    rows: dict[int, list[Given]] = {}
    for g in given:
        if g.id in wanted and g.matrix.matrix in "KM":
            rows.setdefault(g.id, []).append(g)
    out |= {number: _given(model, own) for number, own in rows.items()}
    return _changed(model, out)


def _changed(model: Model, pieces: dict[int, Piece]) -> dict[int, Piece]:
    """With what members of families (`fe.generic.members`) already differ by."""
    out = dict(pieces)
    for block in model.blocks:
        kind = block.kind
        if not isinstance(kind, GenericChange) or not out.keys() & set(kind.elements):
            continue
        matrix = kind.matrix
        change = block.combine(block.scalars(block.properties))[matrix].real
        for number, own in zip(kind.elements, change, strict=True):
            if number in out:
                q = out[number]
                out[number] = replace(q, **{matrix: getattr(q, matrix) + own})
    return out


def _given(model: Model, own: Sequence[Given]) -> Piece:
    labels = list(dict.fromkeys(label for g in own for label in g.matrix.labels))
    at = {label: i for i, label in enumerate(labels)}
    full = {name: np.zeros((len(labels), len(labels))) for name in "KM"}
    for g in own:
        where = [at[label] for label in g.matrix.labels]
        factor = g.properties["stiffness" if g.matrix.matrix == "K" else "mass"]
        A = factor * g.matrix.values.toarray()
        full[g.matrix.matrix][np.ix_(where, where)] += (A + A.T) / 2.0
    kind = np.array([k for _, k in labels], dtype=np.int64)
    dofs = np.array([model.place.get(f"n{n}.{KINDS[k]}", -1) for n, k in labels], dtype=np.int64)
    return Piece(full["K"], full["M"], dofs, kind, own[0].properties, _shape(model, labels, kind))


def _shape(model: Model, labels: Sequence[tuple[int, int]], kind: Index) -> ElementShape | None:
    """None where a node has no place of its own."""
    nodes = list(dict.fromkeys(n for n, _ in labels))
    position = {int(n): i for i, n in enumerate(model.node_ids.tolist())}
    if not all(n in position for n in nodes):
        return None
    xyz = model.xyz[[position[n] for n in nodes]]
    if len(np.unique(np.round(xyz, 12), axis=0)) < len(nodes):
        return None
    number = {n: i for i, n in enumerate(nodes)}
    return ElementShape(xyz, np.array([number[n] for n, _ in labels], dtype=np.int64), kind)
