"""Mass of shell elements on the DOFs of every corner, per mass and per rotary inertia of area."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.shells.bending import mapped
from cvxupdate.fe.shells.frames import side_vectors
from cvxupdate.fe.shells.outlines import sides_of
from cvxupdate.fe.terms import Real


def membrane_mass(plane: Real, lumped: bool) -> Real:
    """(e, 3 n, 3 n) on (u, v, θz): displacements linear along the sides; drilling carries none."""
    n = plane.shape[1]
    out = np.zeros((len(plane), n, 3, n, 3))
    shared = _corners(plane, lumped)
    out[:, :, 0, :, 0] = out[:, :, 1, :, 1] = shared
    return out.reshape(-1, 3 * n, 3 * n)


def deflection_mass(plane: Real, lumped: bool) -> Real:
    """(e, 3 n, 3 n) on (w, θx, θy): the deflection along each side is the parabola that its end
    rotations bend. The cubic part has no mean along a side and would change the mass by O(L⁴)
    only, less than the stiffness errs."""
    e, n, _ = plane.shape
    if lumped:
        out = np.zeros((e, n, 3, n, 3))
        out[:, :, 0, :, 0] = _corners(plane, lumped)
        return out.reshape(e, 3 * n, 3 * n)
    m = mapped(plane, 5)
    shape = np.zeros((len(m.at.weights), e, n, 3))
    shape[..., 0] = m.at.N[:, None, :]
    vectors = side_vectors(plane) / 8.0
    for k, (i, j) in enumerate(sides_of(n)):
        for node, sign in ((i, 1.0), (j, -1.0)):  # ∂w/∂s = −β·t, β = (θy, −θx)
            bubble = sign * m.at.P[:, None, k]
            shape[:, :, node, 1] += bubble * vectors[:, k, 1]
            shape[:, :, node, 2] -= bubble * vectors[:, k, 0]
    return _product(shape.reshape(-1, e, 3 * n), m.dA)


def rotary_mass(plane: Real, lumped: bool) -> Real:
    """(e, 3 n, 3 n) on (w, θx, θy), per ρ h³ / 12."""
    n = plane.shape[1]
    out = np.zeros((len(plane), n, 3, n, 3))
    out[:, :, 1, :, 1] = out[:, :, 2, :, 2] = _corners(plane, lumped)
    return out.reshape(-1, 3 * n, 3 * n)


def _corners(plane: Real, lumped: bool) -> Real:
    """∫ N N dA of the corners' functions, or its row sums, (e, n, n)."""
    m = mapped(plane, 3 if plane.shape[1] == 4 else 2)
    if not lumped:
        return _product(np.broadcast_to(m.at.N[:, None, :], (*m.dA.shape, m.at.N.shape[1])), m.dA)
    return np.einsum("qe,qi,ij->eij", m.dA, m.at.N, np.eye(m.at.N.shape[1]))


def _product(shape: Real, dA: Real) -> Real:
    left = (shape * dA[..., None]).transpose(1, 2, 0)
    return np.asarray(left @ shape.transpose(1, 0, 2))
