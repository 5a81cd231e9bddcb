"""One element of the file with the matrices of its parts, on the DOFs of its nodes, coordinates of
its edges and a few of its inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.analysis.edges import Edge
from cvxupdate.fe.analysis.parts import Assembled, Fine
from cvxupdate.fe.analysis.rims import coordinate
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.labels import KINDS

ALONG = 1e-6  # component of a direction that counts
NOTHING = 1e-12  # of the largest strain energy: rounding


@dataclass(frozen=True)
class Inner:
    """A coordinate of an edge or of the inside of an element: its ``label``, its ``family`` (the
    same function on every edge), the ``node`` of the file that it goes with, and on a rim the DOFs
    (labels) of both ends: held where all of them are."""

    label: str
    family: str
    node: int
    ends: tuple[str, ...] = ()


def inner_of(edges: Sequence[Edge], number: int, node: int, inside: Index) -> list[Inner]:
    """The coordinates of an element in the order of its `matrices`."""
    out = []
    for edge in edges:
        for family, d in edge.names:
            shift = 3 if family.startswith("twist") else 0
            kinds = [KINDS[shift + k] for k in range(3) if abs(d[k]) > ALONG]
            ends = tuple(f"n{n}.{k}" for n in (edge.a, edge.b) for k in kinds) if edge.rim else ()
            out.append(Inner(coordinate(edge, family, d), family, edge.a, ends))
    return [*out, *(Inner(f"inside{k} of {number}", f"inside{k}", node) for k in inside)]


def matrices(
    fine: Fine, parts: Assembled, own: Sequence[str], edges: Sequence[Edge]
) -> tuple[tuple[Real, ...], Index]:
    """The terms of an element on its ``own`` DOFs, coordinates of its ``edges``, and those of its
    inside, of which the numbers (0 … 5) come second.

    Points of an edge follow it; those inside follow the edges statically, and answer to the inertia
    of each rigid motion of the element by one further coordinate.

    Raises
    ------
    ModelError
        Where the inside is a mechanism.
    """
    column = {x: j for j, x in enumerate(own)}
    P, inside = _following(fine, parts.dofs, edges, column)
    used = np.zeros(0, dtype=np.int64)
    if inside.any():
        stiff, heavy = parts.matrix("K"), parts.matrix("M")
        out = ~inside
        loads = heavy @ _motions(fine, parts.dofs)
        push = np.hstack([-stiff[np.ix_(inside, out)] @ P[out], loads[inside]])
        try:
            found = la.cho_solve(la.cho_factor(stiff[np.ix_(inside, inside)]), push)
        except la.LinAlgError as error:
            raise ModelError("the inside of a refined element is a mechanism.") from error
        X = np.zeros((len(P), 6))
        P[inside], X[inside] = found[:, : P.shape[1]], found[:, P.shape[1] :]
        energy = np.einsum("ij,ij->j", X, stiff @ X)
        used = np.flatnonzero(energy > NOTHING * max(float(energy.max()), 1e-300))
        P = np.hstack([P, X[:, used] / np.abs(X[:, used]).max(axis=0)])
    # of the parts of an element each is tied to a few neighbours
    return tuple(_symmetric(P.T @ (sp.csr_array(t) @ P)) for t in parts.terms), used


def _symmetric(A: Real) -> Real:
    return np.asarray((A + A.T) / 2.0)


def _following(
    fine: Fine, dofs: Index, edges: Sequence[Edge], column: Mapping[str, int]
) -> tuple[Real, NDArray[np.bool_]]:
    """(rows of the DOFs at nodes of the file and on edges, True for those inside)."""
    at = {frozenset((e.a, e.b)): k for k, e in enumerate(edges)}
    firsts = np.cumsum([len(column), *(len(e.names) for e in edges)])
    own = [
        [
            (shift + j, column[x])
            for n, shift in ((e.a, 0), (e.b, 6))
            for j, word in enumerate(KINDS)
            if (x := f"n{n}.{word}") in column
        ]
        for e in edges
    ]
    P = np.zeros((len(dofs), int(firsts[-1])))
    inside = np.zeros(len(dofs), dtype=bool)
    found: dict[int, tuple[Real, Real]] = {}
    nodes, kinds = fine.node[dofs].tolist(), fine.kind[dofs].tolist()
    for i, (node, kind) in enumerate(zip(nodes, kinds, strict=True)):
        if node not in fine.made:
            P[i, column[f"n{node}.{KINDS[kind]}"]] = 1.0
            continue
        ends = fine.made[node].weights
        k = at.get(frozenset(ends))
        if k is None:
            inside[i] = True
            continue
        edge = edges[k]
        if node not in found:
            found[node] = edge.followed(ends[edge.b]), edge.further(ends[edge.b])
        follows, further = found[node]
        for j, at_end in own[k]:
            P[i, at_end] += follows[kind, j]
        P[i, firsts[k] : firsts[k + 1]] = further[kind]
    return P, inside


def _motions(fine: Fine, dofs: Index) -> Real:
    """Rigid motions about the centre, (n, 6)."""
    model = fine.model
    xyz = model.xyz[model.dof_node[dofs]]
    r, kind = xyz - xyz.mean(axis=0), fine.kind[dofs]
    R = np.zeros((len(dofs), 6))
    for axis in range(3):
        turn = np.cross(np.eye(3)[axis], r)
        R[kind == axis, axis] = 1.0
        for k in range(3):
            R[kind == k, 3 + axis] = turn[kind == k, k]
        R[kind == 3 + axis, 3 + axis] = 1.0
    return R
