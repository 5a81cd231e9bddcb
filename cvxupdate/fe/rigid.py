"""Rigid-body motion: the null space of K that geometry explains, as against mechanisms."""

from __future__ import annotations

import weakref
from copy import copy
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model

TURNS = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)
"""r @ TURNS[k] is the motion of a point at r that turns about axis k by a unit."""


_SEEN: dict[int, tuple[tuple[weakref.ref[Any], ...], Real]] = {}
"""Motions by the number of the places they were made of, as long as those are there: a fit looks at
one geometry thousands of times, through models that differ in their parameters."""


def rigid_motions(model: Model) -> Real:
    """Three translations and three rotations about the centroid on the free DOFs, orthonormal
    columns of full rank, (N, ≤ 6), read-only."""
    made_of, key = (model.xyz, model.dof_node, model.dof_kind), id(model.xyz)
    there = _SEEN.get(key)
    if there is not None and all(ref() is a for ref, a in zip(there[0], made_of, strict=True)):
        return there[1]
    found = _rigid_motions(model)
    found.setflags(write=False)
    refs = tuple(weakref.ref(a, lambda _: _SEEN.pop(key, None)) for a in made_of)
    _SEEN[key] = refs, found
    return found


def _rigid_motions(model: Model) -> Real:
    r = model.xyz[model.dof_node] - model.xyz.mean(axis=0)
    size = np.abs(r).max() or 1.0
    R = np.zeros((model.size, 6))
    for axis in range(3):
        R[model.dof_kind == axis, axis] = 1.0
        turn = r @ TURNS[axis] / size
        for k in range(3):
            R[model.dof_kind == k, 3 + axis] = turn[model.dof_kind == k, k]
        R[model.dof_kind == 3 + axis, 3 + axis] = 1.0 / size
    U, s, _ = np.linalg.svd(R, full_matrices=False)
    return np.asarray(U[:, s > 1e-10 * s[0]])


def rigid_body_modes(model: Model, K: sp.csc_array, M: sp.csc_array) -> Real:
    """Mass-normalised rigid-body modes (N, r): the rigid motions that K does not resist, to
    rounding.

    A model that holds matrices from another program has no geometry to tell them by; the answer is
    then (N, 0).
    """
    if any(b.kind.name == "matrix" for b in model.blocks):
        return np.zeros((model.size, 0))
    return mass_normalised(free_motions(model, K), M)


def free_motions(model: Model, K: sp.csc_array) -> Real:
    """Orthonormal rigid motions (N, r) that K does not resist, to rounding; some may carry no mass
    (a bar that spins about itself)."""
    Q = rigid_motions(model)
    resisted = Q.T @ (K @ Q)
    _, vectors = np.linalg.eigh((resisted + resisted.T) / 2)
    Q = Q @ vectors
    energy = np.abs(np.einsum("ij,ij->j", Q, K @ Q))
    return Q[:, energy <= rounding(K, Q)]


def rounding(K: sp.csc_array, shapes: Real) -> Real:
    """The strain energy φᵀ K φ that rounding alone can make, for each column of ``shapes`` (N, m):
    8 ε |φ|ᵀ |K| |φ|, (m,).

    The bound is linear in the number of elements because equal elements carry equal errors. It
    depends on the shape, not on the largest k/m of the model, so a soft suspension (far below 1 Hz
    at 100,000 DOFs) lies above it.
    """
    moved = np.abs(shapes)
    size = copy(K)  # abs(K) checks the pattern anew, which takes longer than the rest of this
    size.data = np.abs(K.data)
    return np.asarray(8.0 * np.finfo(float).eps * np.einsum("ij,ij->j", moved, size @ moved))


def mass_normalised(motions: Real, M: sp.csc_array) -> Real:
    """Columns that span the same motions with φᵀ M φ = 1, those without mass left out."""
    if not motions.shape[1]:
        return motions
    moved = motions.T @ (M @ motions)
    values, vectors = np.linalg.eigh((moved + moved.T) / 2)
    heavy = values > 1e-12 * (values.max(initial=0.0) or 1.0)
    return np.asarray(motions @ (vectors[:, heavy] / np.sqrt(values[heavy])))


def pins(R: Real, rotations: Real) -> Index:
    """As many DOFs as there are rigid motions ``R`` (N, r), such that holding them is a statically
    determinate support.

    ``rotations`` (N,) is 1 for DOFs to be held only where nothing else does: a plate held by its
    rotations at one point is soft.
    """
    if not R.shape[1]:
        return np.zeros(0, dtype=np.int64)
    scaled = R / np.abs(R).max(axis=0) * np.where(rotations > 0, 1e-3, 1.0)[:, None]
    _, _, order = la.qr(scaled.T, mode="economic", pivoting=True)
    return np.sort(order[: R.shape[1]]).astype(np.int64)
