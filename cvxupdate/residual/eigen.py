"""Derivatives of eigenvalues and mode shapes: Fox and Kapoor, Nelson, repeated eigenvalues, second
order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import factored
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.derivatives import (
    Derivatives,
    derivatives_of,
    forms,
    padded,
    pushes,
)
from cvxupdate.residual.shape_rows import Index

TOGETHER = 10_000  # DOFs up to which all modes' columns are held side by side
SMALL = 300  # DOFs up to which LAPACK solves sooner than sparse factors (78 to 270 DOFs: 4 to 1.1)

__all__ = [
    "Derivatives",
    "adjoint_shapes",
    "derivatives_of",
    "eigenvalue_derivatives",
    "forms",
    "functional_derivatives",
    "of_functionals",
    "padded",
    "second_derivatives",
    "shape_derivatives",
    "shape_motion",
    "splitting",
]


def eigenvalue_derivatives(eigenvalues: Real, shapes: Real, derivatives: Derivatives) -> Real:
    """∂λ_r/∂p_j = φ_rᵀ (∂K/∂p_j − λ_r ∂M/∂p_j) φ_r (2.100; Fox and Kapoor 1968), (modes,
    parameters).

    ``shapes`` (N, modes) mass-normalised; exact for simple eigenvalues. For a repeated one it is
    that of the shapes given: see `splitting`.
    """
    if not len(eigenvalues):
        return np.zeros((0, derivatives.count))
    dK, dM = forms(shapes, shapes, derivatives)
    return np.asarray(dK - eigenvalues[:, None] * dM)


def splitting(eigenvalue: float, shapes: Real, derivatives: Derivatives) -> Real:
    """The rotation (r, r) of the shapes (N, r) of a repeated eigenvalue to those into which the
    parameters can split it furthest.

    To first order the eigenvalue splits into the eigenvalues of Σ p_j G_j, G_j = Φᵀ (∂K_j − λ ∂M_j)
    Φ (Mills-Curran 1988; Friswell 1996), which no one basis makes diagonal for all j. The basis
    here is that of the dominant direction of the G_j without their means; where nothing splits, it
    stays.
    """
    r = shapes.shape[1]
    i, j = np.triu_indices(r)
    dK, dM = forms(shapes[:, i], shapes[:, j], derivatives)
    G = np.zeros((derivatives.count, r, r))
    G[:, i, j] = G[:, j, i] = (dK - eigenvalue * dM).T
    apart = G - np.trace(G, axis1=1, axis2=2)[:, None, None] * np.eye(r) / r
    if np.abs(apart).max(initial=0.0) <= 1e-9 * np.abs(G).max(initial=0.0):
        return np.eye(r)
    dominant = np.linalg.svd(apart.reshape(len(apart), r * r), full_matrices=False)[2][0].reshape(
        r, r
    )
    return np.asarray(np.linalg.eigh((dominant + dominant.T) / 2)[1])


def shape_derivatives(
    m: Matrices,
    eigenvalue: float,
    shape: Real,
    sensors: Index,
    derivatives: Derivatives,
    others: Real | None = None,
) -> Real:
    """∂φ_s/∂p_j of one mass-normalised mode at the free DOFs ``sensors``, (sensors, parameters):
    `functional_derivatives` of unit functionals.

    Raises
    ------
    ModelError
        When the eigenvalue is repeated and its other shapes are not given: its shapes are not
        determined one by one.
    """
    unit = np.zeros((len(shape), len(sensors)))
    unit[sensors, np.arange(len(sensors))] = 1.0
    y = adjoint_shapes(m, eigenvalue, shape, unit, others)
    return functional_derivatives(eigenvalue, shape, unit, y, derivatives)


def functional_derivatives(
    eigenvalue: float, shape: Real, g: Real, y: Real, derivatives: Derivatives
) -> Real:
    """∂(gᵀφ)/∂p_j = −yᵀ(∂K − λ∂M) φ − ½ gᵀφ φᵀ∂Mφ of functionals g (N, r), (r, parameters), with
    the adjoint shapes ``y`` (N, r) of `adjoint_shapes` or `residual.nelson`."""
    return of_functionals([(eigenvalue, shape, g, y)], derivatives)[0]


def of_functionals(
    each: Sequence[tuple[float, Real, Real, Real]], derivatives: Derivatives
) -> list[Real]:
    """`functional_derivatives` of several modes, of a small model their forms taken together."""
    if not each:
        return []
    phi = np.column_stack([shape for _, shape, _, _ in each])
    if len(each) > 1 and len(phi) > TOGETHER:
        return [of_functionals([one], derivatives)[0] for one in each]
    owner = np.repeat(np.arange(len(each)), [y.shape[1] for _, _, _, y in each])
    right = phi[:, owner] if len(each) > 1 else phi
    dK, dM = forms(np.hstack([y for _, _, _, y in each]), right, derivatives)
    own = forms(phi, phi, derivatives)[1]
    return [
        np.asarray(value * dM[at] - dK[at] - 0.5 * (g.T @ shape)[:, None] * own[k])
        for k, (value, shape, g, _) in enumerate(each)
        for at in [owner == k]
    ]


def adjoint_shapes(
    m: Matrices, eigenvalue: float, shape: Real, g: Real, others: Real | None = None
) -> Real:
    """y (N, r) with (K − λM) y = g − MΦΦᵀg and ΦᵀMy = 0, Φ the shapes of this eigenvalue.

    Nelson's method (1976) turned round: solved for functionals of the shape (its entries at
    sensors, its MAC) instead of the parameters, so one sparse factorisation serves all of both. The
    matrix is singular, and its one free value is settled by holding y at the DOF where φ moves most
    (a border, though shorter to write, fills the factors): a spring there takes no force, because
    the load does no work on φ, so y is zero there and K's pattern and order stay. ``others`` (N, k)
    are further shapes of the same eigenvalue: y is then orthogonal to them too, and the derivative
    is that part which does not turn the shapes among themselves.

    Raises
    ------
    ModelError
        When the eigenvalue is repeated and its other shapes are not given.
    """
    same = shape[:, None] if others is None else np.column_stack([shape, others])
    carried = m.M @ same
    load = g - carried @ (same.T @ g)
    stiffness = m.K.diagonal()
    held = _where_most(np.sqrt(np.abs(stiffness))[:, None] * same)
    A = _less(m, eigenvalue)
    for dof in held.tolist():
        column = slice(A.indptr[dof], A.indptr[dof + 1])
        if not np.any(A.indices[column] == dof):
            A[dof, dof] = 0.0
            column = slice(A.indptr[dof], A.indptr[dof + 1])
        A.data[column][A.indices[column] == dof] += abs(stiffness[dof]) or 1.0
    y = _solved(A, load)
    return np.asarray(y - same @ (carried.T @ y))


def _where_most(moved: Real) -> Index:
    """As many rows of ``moved`` (N, k) as it has columns, pivots of its transpose: of one column
    its largest entry."""
    if moved.shape[1] == 1:
        return np.array([np.argmax(np.abs(moved[:, 0]))])
    _, _, order = la.qr(moved.T, mode="economic", pivoting=True)
    return np.asarray(order[: moved.shape[1]])


def shape_motion(
    modes: Modes, at: int, solved: Callable[[Real], Real], m: Matrices, derivatives: Derivatives
) -> Real:
    """∂φ/∂p (N, parameters) of mode ``at`` itself, the parameters' own form of Nelson's method.

    ``solved`` f (N, n) ↦ (K − λM)⁺ f, as `adjoint_shapes` and `residual.nelson` solve it.
    """
    phi, lam = modes.shapes[:, at], float(modes.eigenvalues[at])
    dK, dM = pushes(phi, derivatives)
    y = solved(lam * dM - dK)
    return np.asarray(y - 0.5 * np.outer(phi, phi @ dM))


def second_derivatives(modes: Modes, at: int, motion: Real, derivatives: Derivatives) -> Real:
    """∂²λ/∂p_j∂p_k (parameters, parameters) of one mode of a model whose matrices are linear in the
    parameters, from the ``motion`` ∂φ/∂p (N, parameters) of its shape.

    2.100 differentiated once more with φᵀMφ = 1: φ_kᵀ(∂K_j − λ∂M_j)φ twice, less ∂λ_k φᵀ∂M_jφ, made
    symmetric (Plaut and Huseyin 1973; Brandon 1984). Thesis 2.8.1 names it after Kuo and Wada.
    """
    phi, lam = modes.shapes[:, at], float(modes.eigenvalues[at])
    dK, dM = pushes(phi, derivatives)
    first = phi @ (dK - lam * dM)
    half = motion.T @ (dK - lam * dM)
    own = np.outer(first, phi @ dM)
    return np.asarray(half + half.T - 0.5 * (own + own.T))


def _less(m: Matrices, eigenvalue: float) -> sp.csc_array:
    """K − λM with the pattern that both share, whatever cancels."""
    K, M = m.K, m.M
    if not (np.array_equal(K.indptr, M.indptr) and np.array_equal(K.indices, M.indices)):
        return sp.csc_array(K - eigenvalue * M)
    out = copy(K)  # not made anew: the check of a pattern takes longer than the difference
    out.data = K.data - eigenvalue * M.data
    return out


def _densely(A: sp.csc_array, b: Real) -> Real | None:
    """A⁻¹ b by LAPACK; None where A is singular."""
    with suppress(np.linalg.LinAlgError):
        return np.asarray(np.linalg.solve(A.toarray(), b))
    return None


def _solved(A: sp.csc_array, b: Real) -> Real:
    """A⁻¹ b of a symmetric indefinite A: densely of a small one; pivots on the diagonal (least
    fill) and one refinement where that leaves more than rounding; with pivoting where that is not
    enough.

    Raises
    ------
    ModelError
        When A is singular.
    """
    size, largest = np.abs(b).max(initial=0.0) or 1.0, np.abs(A.data).max(initial=0.0)
    if len(b) <= SMALL:
        x = _densely(A, b)
        if x is not None and np.abs(b - A @ x).max(initial=0.0) <= 1e-10 * size:
            return x
    what = "K − λM, held where the mode moves most, of a repeated eigenvalue"
    for pivot in (False, True):
        try:
            factor = factored(A, what, pivot, again=True)
        except ModelError:
            continue
        x = factor.solve(b)
        left = b - A @ x
        rounding = np.finfo(float).eps * largest * np.abs(x).max(initial=0.0)
        if not np.abs(left).max(initial=0.0) <= rounding:
            x = x + factor.solve(left)
            left = b - A @ x
        if np.all(np.isfinite(x)) and np.abs(left).max(initial=0.0) <= 1e-8 * size + 500 * rounding:
            return np.asarray(x)
    raise ModelError(
        f"{what}, is singular: its shapes are not determined one by one. Compare frequencies "
        "only, or break the symmetry of the model."
    )
