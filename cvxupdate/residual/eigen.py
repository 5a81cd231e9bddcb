"""Derivatives of eigenvalues and mode shapes from element blocks.

Element matrices are sums of constant terms with scalar factors, so every derivative that a mode
needs is a bilinear form of those terms, computed once for all parameters, times derivatives of
factors. No element matrix is formed for any parameter, and none of size N × N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import STEP, Block
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.factor import factorise
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.residual.shape_rows import Index

CHUNK = 2_000_000  # numbers held at once for the forms of one term


@dataclass(frozen=True)
class TermDerivative:
    """One term of one block: d(factor)/dp_j = ``factors`` of the elements ``rows``, parameter after
    parameter as ``parameters`` (entries,) says."""

    block: Block
    matrix: str
    term: int
    rows: Index
    parameters: Index
    factors: Real


@dataclass(frozen=True)
class Derivatives:
    """∂K/∂p and ∂M/∂p of a model at one point for all ``count`` parameters, as factors of the
    elements' constant terms."""

    count: int
    terms: tuple[TermDerivative, ...]


def derivatives_of(model: Model, p: Real) -> Derivatives:
    """Derivatives at ``p`` (n,), by complex step on the factors (exact to rounding); parameters
    that move the same property go together."""
    properties = model.properties(p)
    together: dict[tuple[int, tuple[str, ...]], list[tuple[int, Index, Real]]] = {}
    for j, parameter in enumerate(model.parameters):
        for t in parameter.targets:
            together.setdefault((t.block, t.properties), []).append((j, t.rows, t.scales))
    out = []
    for (number, names), members in together.items():
        block = model.blocks[number]
        rows = np.concatenate([r for _, r, _ in members])
        owner = np.concatenate([np.full(len(r), j, dtype=np.int64) for j, r, _ in members])
        scales = np.concatenate([s for _, _, s in members], axis=1)
        local: dict[str, Values] = {
            k: v[rows].astype(complex) for k, v in properties[number].items()
        }
        for name, scale in zip(names, scales, strict=True):
            local[name] = local[name] + 1j * STEP * scale
        for matrix, i, factor in block.scalars(local):
            change = np.imag(factor) / STEP
            live = change != 0.0
            if matrix in "KM" and np.any(live):
                out.append(TermDerivative(block, matrix, i, rows[live], owner[live], change[live]))
    return Derivatives(len(model.parameters), tuple(out))


def padded(shapes: Real) -> Real:
    """Shapes with a row of zeros at the end, so that the place −1 of a held DOF reads 0."""
    return np.vstack([shapes, np.zeros((1, shapes.shape[1]))])


def forms(left: Real, right: Real, derivatives: Derivatives) -> tuple[Real, Real]:
    """l_cᵀ ∂K/∂p_j r_c and l_cᵀ ∂M/∂p_j r_c, each (columns, parameters), of the columns of ``left``
    and ``right`` (N, columns) or (N, 1)."""
    l, r = padded(left), padded(right)
    columns = max(l.shape[1], r.shape[1])
    out = {"K": np.zeros((derivatives.count, columns)), "M": np.zeros((derivatives.count, columns))}
    for t in derivatives.terms:
        values = t.block.terms[t.term].values
        step = max(1, CHUNK // (values.shape[1] * columns))
        for first in range(0, len(t.rows), step):
            part = slice(first, first + step)
            dofs = t.block.dofs[t.rows[part]]
            matrix = values[0] if len(values) == 1 else values[t.block.geometry[t.rows[part]]]
            energy = np.einsum(
                "edc,edc->ec",
                np.broadcast_to(l[dofs], (*dofs.shape, columns)),
                np.broadcast_to(matrix @ r[dofs], (*dofs.shape, columns)),
            )
            np.add.at(out[t.matrix], t.parameters[part], t.factors[part, None] * energy)
    return out["K"].T, out["M"].T


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
    """∂φ_s/∂p_j of one mass-normalised mode at the free DOFs ``sensors``, (sensors, parameters).

    Nelson's method (1976) turned round: solved for the sensors instead of the parameters, so one
    sparse factorisation serves all of both. With A = K − λM, A y_s = e_s − φ_s Mφ and φᵀM y_s = 0,
    ∂φ_s = −y_sᵀ (∂K − λ∂M) φ − ½ φ_s φᵀ∂Mφ. A is singular, and its one free value is settled by
    holding y at the DOF where φ moves most (a border, though shorter to write, fills the factors).
    ``others`` (N, k) are further shapes of the same eigenvalue: y is then orthogonal to them too,
    and the derivative is that part which does not turn the shapes among themselves.

    Raises
    ------
    ModelError
        When the eigenvalue is repeated and its other shapes are not given: its shapes are not
        determined one by one.
    """
    N = len(shape)
    same = shape[:, None] if others is None else np.column_stack([shape, others])
    A = sp.csc_array(m.K - eigenvalue * m.M)
    carried = m.M @ same
    load = -carried @ same[sensors].T
    load[sensors, np.arange(len(sensors))] += 1.0
    _, _, order = la.qr(
        (np.sqrt(np.abs(m.K.diagonal()))[:, None] * same).T, mode="economic", pivoting=True
    )
    free = np.setdiff1d(np.arange(N), order[: same.shape[1]])
    y = np.zeros((N, len(sensors)))
    y[free] = _solved(sp.csc_array(A[free][:, free]), load[free])
    y -= same @ (carried.T @ y)
    dK, dM = forms(y, shape[:, None], derivatives)
    own = forms(shape[:, None], shape[:, None], derivatives)[1]
    return np.asarray(eigenvalue * dM - dK - 0.5 * shape[sensors][:, None] * own)


def _solved(A: sp.csc_array, b: Real) -> Real:
    """A⁻¹ b of a symmetric indefinite A: pivots on the diagonal (least fill) and one refinement;
    with pivoting where that is not enough.

    Raises
    ------
    ModelError
        When A is singular.
    """
    size = np.abs(b).max(initial=0.0) or 1.0
    what = "K − λM, held where the mode moves most, of a repeated eigenvalue"
    for pivot in (False, True):
        try:
            factor = factorise(A, what, pivot)
        except ModelError:
            continue
        x = factor.solve(b)
        x = x + factor.solve(b - A @ x)
        rounding = 1e-13 * abs(A).max() * np.abs(x).max(initial=0.0)
        if np.all(np.isfinite(x)) and np.abs(A @ x - b).max(initial=0.0) <= 1e-8 * size + rounding:
            return np.asarray(x)
    raise ModelError(
        f"{what}, is singular: its shapes are not determined one by one. Compare frequencies "
        "only, or break the symmetry of the model."
    )
