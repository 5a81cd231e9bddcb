"""Derivatives of eigenvalues and mode shapes from element blocks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import factorise
from cvxupdate.fe.model import DerivativeBlock, Matrices
from cvxupdate.residual.pairing import Index

Derivatives = Sequence[Sequence[DerivativeBlock]]


def padded(shapes: Real) -> Real:
    """Shapes with a row of zeros at the end, so that the place −1 of a held DOF reads 0."""
    return np.vstack([shapes, np.zeros((1, shapes.shape[1]))])


def eigenvalue_derivatives(eigenvalues: Real, shapes: Real, derivatives: Derivatives) -> Real:
    """∂λ_r/∂p_j = φ_rᵀ (∂K/∂p_j − λ_r ∂M/∂p_j) φ_r (2.100; Fox and Kapoor 1968), (modes, parameters).

    ``shapes`` (N, modes) mass-normalised; exact for simple eigenvalues.
    """
    phi = padded(shapes)
    out = np.zeros((len(eigenvalues), len(derivatives)))
    for j, blocks in enumerate(derivatives):
        for b in blocks:
            local = phi[b.dofs]
            if b.K is not None:
                out[:, j] += np.einsum("eim,eij,ejm->m", local, b.K, local, optimize=True)
            if b.M is not None:
                out[:, j] -= eigenvalues * np.einsum("eim,eij,ejm->m", local, b.M, local, optimize=True)
    return out


def shape_derivatives(m: Matrices, eigenvalue: float, shape: Real, sensors: Index, derivatives: Derivatives) -> Real:
    """∂φ_s/∂p_j of one mass-normalised mode at the free DOFs ``sensors``, (sensors, parameters).

    Nelson's problem in bordered form, solved for the sensors instead of the parameters: with
    B = [K − λM, −Mφ; −φᵀM, 0] (regular for a simple eigenvalue), B [∂φ; ∂λ] = [−(∂K − λ∂M)φ; ½ φᵀ∂Mφ], and B is symmetric.
    One sparse factorisation serves every sensor and parameter (Nelson 1976; Lee and Jung 1997).

    Raises
    ------
    ModelError
        When the eigenvalue is repeated: its shapes are not determined one by one.
    """
    N = len(shape)
    border = sp.csc_array((-(m.M @ shape))[:, None])
    bordered = sp.block_array([[m.K - eigenvalue * m.M, border], [border.T, None]], format="csc")
    rhs = np.zeros((N + 1, len(sensors)))
    rhs[sensors, np.arange(len(sensors))] = 1.0
    y = factorise(bordered, "the bordered matrix of a repeated eigenvalue", pivot=True).solve(rhs)
    adjoint, share = padded(y[:N]), y[N]
    phi = np.append(shape, 0.0)
    out = np.zeros((len(sensors), len(derivatives)))
    for j, blocks in enumerate(derivatives):
        for b in blocks:
            local = phi[b.dofs]
            force = np.zeros(b.dofs.shape)
            if b.K is not None:
                force -= np.einsum("eij,ej->ei", b.K, local)
            if b.M is not None:
                pushed = np.einsum("eij,ej->ei", b.M, local)
                force += eigenvalue * pushed
                out[:, j] += 0.5 * share * np.sum(local * pushed)
            out[:, j] += np.einsum("eis,ei->s", adjoint[b.dofs], force)
    return out
