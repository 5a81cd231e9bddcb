"""Where the DOFs of one element are, and which half-turns and mirrors leave the element as it is.

Every symmetry used here is its own inverse, and those of one frame commute. So their joint
eigenspaces are the symmetry classes (7.19, 7.22, 7.24), and what belongs to different classes does
not mix even where eigenvalues repeat, as those of a square plate do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real

SAME = 1e-6  # of the element's length: nodes nearer than that are one place
ALIKE = 1e-8  # of a matrix's norm: what a symmetry may change of it by rounding
SIGNS = tuple(
    (x, y, z)
    for x in (1.0, -1.0)
    for y in (1.0, -1.0)
    for z in (1.0, -1.0)
    if (x, y, z) != (1,) * 3
)
"""Diagonals of the mirrors, half-turns and the inversion in the axes of a frame."""


@dataclass(frozen=True, eq=False)
class ElementShape:
    """DOFs of one element: ``xyz`` (k, 3) places of its nodes [m], ``node`` (d,) the node of each
    DOF, ``kind`` (d,) 0..5 = x..rz."""

    xyz: Real
    node: Index
    kind: Index

    @cached_property
    def centre(self) -> Real:
        """The mean of the nodes, (3,)."""
        return np.asarray(self.xyz.mean(axis=0))

    @cached_property
    def length(self) -> float:
        """Twice the r.m.s. distance of the nodes from the centre: the length of a beam; 1 where all
        nodes are one place."""
        r = float(np.sqrt(np.mean(np.sum((self.xyz - self.centre) ** 2, axis=1))))
        return 2.0 * r if r > 0.0 else 1.0

    @cached_property
    def scale(self) -> Real:
        """(d,) that makes rotations lengths, as in {w, L w′} of (7.16)."""
        return np.where(self.kind >= 3, self.length, 1.0)

    @cached_property
    def rigid(self) -> Real:
        """Translations along the axes and rotations about the centre [1/length], (d, 6)."""
        R = np.zeros((len(self.kind), 6))
        r = (self.xyz - self.centre)[self.node]
        for axis in range(3):
            R[self.kind == axis, axis] = 1.0
            turn = np.cross(np.eye(3)[axis], r)
            for k in range(3):
                R[self.kind == k, 3 + axis] = turn[self.kind == k, k]
            R[self.kind == 3 + axis, 3 + axis] = 1.0
        R[:, 3:] /= self.length
        return R

    def turned(self, axes: Real) -> Real:
        """What takes DOFs in global axes to those in ``axes`` (rows, (3, 3)) at the same nodes,
        (d, 6 k): every node has all six."""
        out = np.zeros((len(self.kind), len(self.xyz), 2, 3))
        for i, (n, k) in enumerate(zip(self.node.tolist(), self.kind.tolist(), strict=True)):
            out[i, n, k // 3] = axes[:, k % 3]
        return out.reshape(len(self.kind), -1)

    def own_axes(self, K: Real) -> Real:
        """`turned` to the first of `frames`: the element's own axes."""
        return self.turned(next(self.frames(K)))

    def frames(self, K: Real) -> Iterator[Real]:
        """Frames that may hold the symmetries, rows the axes (3, 3): along the first edge (a line:
        with the principal axes of its stiffness ``K`` (d, d) across), then the principal axes of
        the nodes.

        Where another program numbered the nodes, the second may lie across a diagonal from the
        first. A square has mirrors there too, with other classes, so edges are told from diagonals.
        """
        r = self.xyz - self.centre
        edge = self.xyz - self.xyz[0]
        first = self._outermost(edge)
        if first is None:
            yield np.eye(3)
            return
        x = first / np.linalg.norm(first)
        side = self._outermost(edge - np.outer(edge @ x, x))
        if side is None:
            yield self._across(x, K)
            return
        y = side / np.linalg.norm(side)
        yield np.stack([x, y, np.cross(x, y)])
        yield np.linalg.svd(r)[2]

    def _outermost(self, vectors: Real) -> Real | None:
        """The first of ``vectors`` (k, 3) that is not zero nor between others, as a diagonal is
        between two edges: no sum of the others, with factors that are not negative. The first of
        all where every one is; None where all are zero."""
        from scipy.optimize import nnls

        some = vectors[np.linalg.norm(vectors, axis=1) > SAME * self.length]
        rays = some / np.linalg.norm(some, axis=1, keepdims=True)
        for ray, vector in zip(rays, some, strict=True):
            others = rays[np.linalg.norm(rays - ray, axis=1) > SAME]
            if not len(others) or nnls(others.T, ray)[1] > SAME:
                return np.asarray(vector)
        return np.asarray(some[0]) if len(some) else None

    def _across(self, x: Real, K: Real) -> Real:
        """The frame of a line along ``x``: y and z are the principal axes of the translational
        stiffness across it."""
        block = np.zeros((3, 3))
        for n in range(len(self.xyz)):
            for i in np.flatnonzero((self.node == n) & (self.kind < 3)):
                for j in np.flatnonzero((self.node == n) & (self.kind < 3)):
                    block[self.kind[i], self.kind[j]] += K[i, j]
        least = np.eye(3)[int(np.argmin(np.abs(np.round(x, 6))))]
        start = least - (least @ x) * x
        y0 = start / np.linalg.norm(start)
        plane = np.stack([y0, np.cross(x, y0)])
        across = plane @ block @ plane.T
        if np.ptp(np.linalg.eigvalsh(across)) <= ALIKE * np.linalg.norm(block):
            return np.stack([x, *plane])
        y = np.linalg.eigh(across)[1][:, 0] @ plane
        y = y * (1.0 if y[int(np.argmax(np.abs(y)))] > 0.0 else -1.0)
        return np.stack([x, y, np.cross(x, y)])

    def symmetries(self, matrices: tuple[Real, ...]) -> tuple[Real, ...]:
        """Half-turns, mirrors and the inversion of one frame that leave the nodes, the kinds of
        DOFs and every matrix (d, d) of ``matrices`` as they are: (d, d) each, symmetric and
        commuting. Of all frames the one with most of them."""
        K = matrices[0]
        found = [
            tuple(P for s in SIGNS for P in self._acting(axes.T @ np.diag(s) @ axes, matrices))
            for axes in self.frames(K)
        ]
        return max(found, key=len)

    def _acting(self, turn: Real, matrices: tuple[Real, ...]) -> Iterator[Real]:
        """What the isometry ``turn`` (3, 3) about the centre does to the DOFs, (d, d); nothing
        where it is no symmetry."""
        r = self.xyz - self.centre
        apart = np.linalg.norm((r @ turn.T)[:, None] - r[None], axis=2)
        to = np.argmin(apart, axis=1)
        if np.any(apart.min(axis=1) > SAME * self.length) or len(set(to.tolist())) < len(to):
            return
        d = len(self.kind)
        P = np.zeros((d, d))
        spun: Real = np.linalg.det(turn) * turn  # of rotations, which are axial vectors
        place = {(n, k): i for i, (n, k) in enumerate(zip(self.node, self.kind, strict=True))}
        for j, (n, k) in enumerate(zip(self.node.tolist(), self.kind.tolist(), strict=True)):
            for a, part in enumerate((spun if k >= 3 else turn)[:, k % 3].tolist()):
                i = place.get((int(to[n]), a + 3 * (k // 3)))
                if i is not None:
                    P[i, j] = part
        if not np.allclose(P.T @ P, np.eye(d), atol=SAME):
            return  # a kind of DOF that is not there would move
        if all(
            np.linalg.norm(P @ A @ P.T - A) <= ALIKE * float(np.linalg.norm(A)) for A in matrices
        ):
            yield P


def symmetry_classes(symmetries: tuple[Real, ...], size: int) -> tuple[Real, ...]:
    """Orthonormal bases (size, n) of the joint eigenspaces of commuting ``symmetries``, in a fixed
    order: symmetric in all first."""
    bases = [np.eye(size)]
    for P in symmetries:
        split = []
        for B in bases:
            values, vectors = np.linalg.eigh(B.T @ P @ B)
            split += [B @ vectors[:, some] for some in (values > 0.0, values <= 0.0)]
        bases = [B for B in split if B.shape[1]]
    return tuple(bases)


def own_classes(K: Real, M: Real) -> tuple[Real, ...]:
    """Orthonormal bases of subspaces that neither ``K`` nor ``M`` (d, d) mixes, found from the
    matrices alone; one basis of everything where there is none.

    A symmetric matrix that commutes with both has such subspaces as its eigenspaces. All of those
    matrices are the null space of a linear map, and a general one of them tells most subspaces
    apart (Murota, Kanno, Kojima and Kojima 2010).
    """
    K, M = (A / max(float(np.linalg.norm(A)), 1e-300) for A in (K, M))
    values, U = np.linalg.eigh(K)
    level = np.concatenate([[0], np.cumsum(np.diff(values) > SAME * np.abs(values).max())])
    i, j = np.array(
        [(a, b) for a in range(len(K)) for b in range(a, len(K)) if level[a] == level[b]]
    ).T
    C = U.T @ M @ U
    rows = np.zeros((len(i), len(K), len(K)))
    for n, (a, b) in enumerate(zip(i.tolist(), j.tolist(), strict=True)):
        E = np.zeros_like(K)
        E[a, b] = E[b, a] = 1.0
        rows[n] = E @ C - C @ E
    _, s, Vt = np.linalg.svd(rows.reshape(len(i), -1).T, full_matrices=True)
    null = Vt[int(np.sum(s > SAME * max(float(s.max(initial=0.0)), 1e-300))) :]
    mix = np.random.default_rng(0).normal(size=len(null)) @ null
    X = np.zeros_like(K)
    X[i, j] = X[j, i] = mix
    parts, Q = np.linalg.eigh(X)
    cuts = np.flatnonzero(np.diff(parts) > SAME * np.abs(parts).max()) + 1
    return tuple(U @ Q[:, some] for some in np.split(np.arange(len(K)), cuts))
