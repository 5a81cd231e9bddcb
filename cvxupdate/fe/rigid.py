"""Rigid-body motion: the null space of K that geometry explains, as against mechanisms."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model


def rigid_motions(model: Model) -> Real:
    """Three translations and three rotations about the centroid on the free DOFs, orthonormal columns of full rank, (N, ≤ 6)."""
    r = model.xyz[model.dof_node] - model.xyz.mean(axis=0)
    size = np.abs(r).max() or 1.0
    R = np.zeros((model.size, 6))
    for axis in range(3):
        R[model.dof_kind == axis, axis] = 1.0
        turn = np.cross(np.eye(3)[axis], r) / size
        for k in range(3):
            R[model.dof_kind == k, 3 + axis] = turn[model.dof_kind == k, k]
        R[model.dof_kind == 3 + axis, 3 + axis] = 1.0 / size
    U, s, _ = np.linalg.svd(R, full_matrices=False)
    return np.asarray(U[:, s > 1e-10 * s[0]])


def rigid_body_modes(model: Model, K: sp.csc_array, M: sp.csc_array) -> Real:
    """Mass-normalised rigid-body modes (N, r): the rigid motions that K does not resist, to rounding.

    A model that holds matrices from another program has no geometry to tell them by; the answer is then (N, 0).
    """
    if any(b.kind.name == "matrix" for b in model.blocks):
        return np.zeros((model.size, 0))
    Q = rigid_motions(model)
    resisted = Q.T @ (K @ Q)
    rounding = np.diag(np.abs(Q).T @ (abs(K) @ np.abs(Q))).max() * np.finfo(float).eps * 256
    values, vectors = np.linalg.eigh((resisted + resisted.T) / 2)
    free = Q @ vectors[:, np.abs(values) <= rounding]
    moved = free.T @ (M @ free)
    values, vectors = np.linalg.eigh((moved + moved.T) / 2)
    heavy = values > 1e-12 * (values.max(initial=0.0) or 1.0)
    return np.asarray(free @ (vectors[:, heavy] / np.sqrt(values[heavy])))
