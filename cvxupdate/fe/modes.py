"""Natural modes: K φ = λ M φ, dense for small models, shift-invert Lanczos with a Sturm check for large ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import factorise
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.rigid import rigid_body_modes

DENSE = 500  # DOFs below which LAPACK beats shift-invert (measured in tests/benchmarks/test_modes.py)


@dataclass(frozen=True)
class Modes:
    """Modes in ascending order: ``eigenvalues`` (m,) in (rad/s)², ``shapes`` (N, m) with φᵀ M φ = 1, the first ``rigid`` of them rigid."""

    eigenvalues: Real
    shapes: Real
    rigid: int

    @property
    def frequencies(self) -> Real:
        """Natural frequencies in Hz; rigid-body modes are 0."""
        return np.sqrt(np.maximum(self.eigenvalues, 0.0)) / (2.0 * np.pi)

    def flexible(self) -> Modes:
        """Without the rigid-body modes."""
        return Modes(self.eigenvalues[self.rigid:], self.shapes[:, self.rigid:], 0)


def model_modes(model: Model, count: int, p: Real | None = None, matrices: Matrices | None = None) -> Modes:
    """The lowest ``count`` flexible modes of a model and all its rigid-body modes.

    Raises
    ------
    ModelError
        For a mechanism (a motion without stiffness that is not a rigid-body motion; the message names the DOF that moves most)
        or a mass matrix that is not positive semidefinite.
    """
    m = model.matrices(p) if matrices is None else matrices
    known = not any(b.kind.name == "matrix" for b in model.blocks)
    rigid = rigid_body_modes(model, m.K, m.M)
    modes = natural_modes(m.K, m.M, count, rigid)
    zero = _zero_level(m.K, m.M)
    loose = int(np.sum(modes.eigenvalues[rigid.shape[1]:] <= zero))
    if known and loose:
        shape = modes.shapes[:, rigid.shape[1]]
        raise ModelError(f"the model is a mechanism: {loose} motion(s) without stiffness besides the {rigid.shape[1]} rigid-body modes; the first moves "
                         f"{model.labels[int(np.argmax(np.abs(shape)))]} most. Add the missing element or support there.")
    if known:
        return modes
    return Modes(modes.eigenvalues, modes.shapes, loose)


def natural_modes(K: sp.csc_array, M: sp.csc_array, count: int, rigid: Real | None = None) -> Modes:
    """The lowest ``count`` modes of K φ = λ M φ beside the known mass-normalised rigid-body modes ``rigid`` (N, r).

    Massless DOFs follow statically. Repeated eigenvalues are complete: large models are checked by counting the negative pivots of
    K − μ M (Sylvester's law of inertia) and computed again where one was missed.

    Raises
    ------
    ModelError
        When M has a negative eigenvalue or both K and M vanish on some motion.
    """
    N = K.shape[0]
    R = np.zeros((N, 0)) if rigid is None else rigid
    available = int(np.sum(M.diagonal() != 0.0)) - R.shape[1]
    count = min(count, available)
    if count <= 0:
        return Modes(np.zeros(R.shape[1]), R, R.shape[1])
    if N <= DENSE or count > N // 3:
        values, shapes = _dense(K.toarray(), M.toarray(), count + R.shape[1])
    else:
        values, shapes = _sparse(K, M, count + R.shape[1], R)
    values, shapes = values[R.shape[1]:], shapes[:, R.shape[1]:]
    if R.shape[1]:  # what rounding left of the rigid-body motion comes out
        shapes = shapes - R @ (R.T @ (M @ shapes))
    shapes = shapes / np.sqrt(np.einsum("ij,ij->j", shapes, M @ shapes))
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    shapes = shapes * np.where(largest < 0, -1.0, 1.0)
    return Modes(np.concatenate([np.zeros(R.shape[1]), values]), np.hstack([R, shapes]), R.shape[1])


def _zero_level(K: sp.csc_array, M: sp.csc_array) -> float:
    """The eigenvalue that rounding alone can make of a zero."""
    k, m = np.abs(K.diagonal()), np.abs(M.diagonal())
    heavy = m > 0.0
    return float(64 * np.finfo(float).eps * (k[heavy] / m[heavy]).max(initial=0.0) * max(1.0, np.sqrt(len(k)) / 8))


def _dense(K: Real, M: Real, count: int) -> tuple[Real, Real]:
    massless = ~np.any(M != 0.0, axis=1)
    master, slave = np.flatnonzero(~massless), np.flatnonzero(massless)
    T = np.zeros((len(K), len(master)))
    T[master, np.arange(len(master))] = 1.0
    if slave.size:  # exact: f = 0 on a massless DOF at every frequency
        try:
            T[slave] = -la.solve(K[np.ix_(slave, slave)], K[np.ix_(slave, master)], assume_a="sym")
        except la.LinAlgError as error:
            raise ModelError("a massless DOF has no stiffness: the model is a mechanism. Add the missing element or support.") from error
    Kc, Mc = T.T @ K @ T, M[np.ix_(master, master)]
    count = min(count, len(master))
    try:
        values, shapes = la.eigh(Kc, Mc, subset_by_index=[0, count - 1])
        return values, T @ shapes
    except la.LinAlgError:
        pass
    weights = la.eigvalsh(Mc)
    if weights[0] < -1e-9 * weights[-1]:
        raise ModelError(f"the mass matrix has a negative eigenvalue ({weights[0]:.3g}). A mass parameter has gone too far: set its lower bound.")
    shift = np.abs(np.diag(Kc)).max() / weights[-1] * 1e-6 + np.finfo(float).tiny
    try:  # M singular but for rounding: take it as the "stiffness" of the inverse problem
        inverse, shapes = la.eigh(Mc, Kc + shift * Mc)
    except la.LinAlgError as error:
        raise ModelError("stiffness and mass both vanish on some motion: the model is a mechanism. Add the missing element or support.") from error
    keep = np.argsort(inverse)[::-1][:count]
    keep = keep[inverse[keep] > 1e-14 * inverse.max()]
    return 1.0 / inverse[keep] - shift, T @ (shapes[:, keep] / np.sqrt(inverse[keep]))


def _sparse(K: sp.csc_array, M: sp.csc_array, count: int, R: Real) -> tuple[Real, Real]:
    sigma = 0.0
    if R.shape[1] or np.any(K.diagonal() == 0.0):
        sigma = -_shift(K, M)
    wanted = count
    for _ in range(4):
        values, shapes = _lanczos(K, M, wanted, sigma, tol=0.0)
        if R.shape[1] and len(values) > R.shape[1] and values[R.shape[1]] < -0.01 * sigma:  # the shift was far too large to separate the low modes
            sigma = -0.3 * max(float(values[R.shape[1]]), -1e-3 * sigma)
            continue
        last = min(count, len(values)) - 1
        beyond = 1.000001 * values[last] + _zero_level(K, M)
        below = factorise(K - beyond * M, "K - μ M").negatives()
        if below is None or below <= np.sum(values <= beyond):
            return values[:count], shapes[:, :count]
        wanted = below + 2  # a repeated mode was missed
    return values[:count], shapes[:, :count]


def _shift(K: sp.csc_array, M: sp.csc_array) -> float:
    """A first guess well below the flexible modes yet above rounding of K."""
    k, m = K.diagonal(), M.diagonal()
    heavy = (m > 0) & (k > 0)
    return float(np.median(k[heavy] / m[heavy]) / K.shape[0] ** 2 * 10 + 1e3 * np.finfo(float).eps * np.max(k[heavy] / m[heavy]))


def _lanczos(K: sp.csc_array, M: sp.csc_array, count: int, sigma: float, tol: float) -> tuple[Real, Real]:
    N = K.shape[0]
    factor = factorise(K - sigma * M if sigma else K, "the stiffness matrix")
    inverse = LinearOperator((N, N), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(N)
    try:
        values, shapes = eigsh(K, count, M, sigma=sigma, OPinv=inverse, v0=start, tol=tol, ncv=min(N - 1, max(2 * count + 1, 24)))
    except ArpackError as error:
        raise ModelError(f"the natural modes did not converge ({error}). Is the mass matrix positive semidefinite?") from error
    order = np.argsort(values)
    return values[order], shapes[:, order]
