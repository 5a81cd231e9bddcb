"""A structure for simulation: a linear part in blocks of two, and laws of internal force.

M q″ + C q′ + K q + B f(x, v) = P p(t), x = Bᵀ q, y = Y q. Undamped modes make the linear part
blocks [[0, 1], [−ω², −2ζω]]; modes that damping couples become the real and imaginary parts of
complex modes (Ewins 2000, section 2.5), which are blocks too. Nothing else is ever integrated
numerically.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from cvxupdate.errors import ModelError
from cvxupdate.forces import Laws
from cvxupdate.forces.laws import Real

COUPLED = 1e-10
"""Of the damping of two modes: below it what couples them is rounding."""
DEFECTIVE = 1e-6
"""Error of the complex modes, relative: above it the damping has no complete set of them."""


@dataclass(frozen=True)
class System:
    """``A`` (blocks, 2, 2); ``drive`` (2 blocks, r) and ``pull`` (2 blocks, m) what inputs and
    internal forces push; ``x_rows``, ``v_rows`` (m, 2 blocks) motion of the elements, ``y_rows``,
    ``yv_rows`` (o, 2 blocks) of the outputs; the m ``laws``. ``omega`` (n,) rad/s, ``damping``
    (n, n) and ``shapes`` (n, m + r + o) are the mass-normalised modes behind it: ω, ΦᵀCΦ, and their
    values at elements, inputs and outputs; ``entry`` (2 blocks, 2n) makes states of modal
    displacements and velocities."""

    A: Real
    drive: Real
    pull: Real
    x_rows: Real
    v_rows: Real
    y_rows: Real
    yv_rows: Real
    laws: Laws
    omega: Real
    damping: Real
    shapes: Real
    entry: Real

    @property
    def modes(self) -> int:
        """Number of modes n."""
        return len(self.omega)

    def parts(self) -> tuple[Real, Real, Real]:
        """``shapes`` at elements (n, m), inputs (n, r) and outputs (n, o)."""
        m, r = self.pull.shape[1], self.drive.shape[1]
        return self.shapes[:, :m], self.shapes[:, m : m + r], self.shapes[:, m + r :]

    def states(self, q: Real, u: Real) -> Real:
        """The state (2 blocks,) of modal displacements and velocities (n,)."""
        return np.asarray(self.entry @ np.concatenate([q, u]))

    def with_laws(self, laws: Laws) -> System:
        """The same structure with other figures for its laws."""
        if laws.size != self.laws.size:
            raise ModelError(f"there are {self.laws.size} elements; got {laws.size} laws.")
        return replace(self, laws=laws)


def system_of(
    M: ArrayLike,
    C: ArrayLike,
    K: ArrayLike,
    laws: Laws,
    directions: ArrayLike,
    inputs: ArrayLike,
    outputs: ArrayLike,
) -> System:
    """A system of small dense matrices (N, N): ``directions`` B (N, m), ``inputs`` P (N, r),
    ``outputs`` Y (o, N).

    Raises
    ------
    ModelError
        M is not positive definite, or K has a negative eigenvalue.
    """
    m, k, c = (np.asarray(a, dtype=float) for a in (M, K, C))
    try:
        lam, shapes = la.eigh(k, m)
    except la.LinAlgError as error:
        raise ModelError(
            "the mass matrix is not positive definite: every DOF needs mass in simulation."
        ) from error
    if lam[0] < -1e-9 * max(lam[-1], 0.0):
        raise ModelError("the stiffness matrix has a negative eigenvalue: the structure buckles.")
    omega = np.sqrt(np.maximum(lam, 0.0))
    omega[omega < 1e-6 * omega.max(initial=0.0)] = 0.0
    places = [np.asarray(a, dtype=float) for a in (directions, inputs)]
    at = np.hstack([shapes.T @ places[0], shapes.T @ places[1], shapes.T @ np.transpose(outputs)])
    return modal_system(omega, shapes.T @ c @ shapes, at, laws, places[1].shape[1])


def modal_system(omega: Real, damping: Real, shapes: Real, laws: Laws, inputs: int) -> System:
    """A system of mass-normalised modes: ``omega`` (n,) rad/s, ``damping`` ΦᵀCΦ (n, n), ``shapes``
    (n, m + r + o) as in `System`, r = ``inputs``.

    Raises
    ------
    ModelError
        The damping has no complete set of complex modes.
    """
    n, m = len(omega), laws.size
    groups = _groups(damping)
    A = np.zeros((n, 2, 2))
    entry = np.zeros((2 * n, 2 * n))
    out, rate = np.zeros((n, 2 * n)), np.zeros((n, 2 * n))
    first = 0
    for group in groups:
        size = len(group)
        rows = slice(2 * first, 2 * (first + size))
        block, into, back = _blocks(omega[group], damping[np.ix_(group, group)])
        A[first : first + size] = block
        entry[rows, group], entry[rows, [n + i for i in group]] = into[:, :size], into[:, size:]
        out[group, rows], rate[group, rows] = back[:size], back[size:]
        first += size
    at, force = shapes[:, :m], entry[:, n:]
    return System(
        A,
        force @ shapes[:, m : m + inputs],
        force @ at,
        at.T @ out,
        at.T @ rate,
        shapes[:, m + inputs :].T @ out,
        shapes[:, m + inputs :].T @ rate,
        laws,
        omega,
        damping,
        shapes,
        entry,
    )


def _groups(damping: Real) -> list[list[int]]:
    """Modes that damping couples, together."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    size = np.sqrt(np.abs(np.diag(damping)))
    joined = np.abs(damping) > COUPLED * np.maximum(np.outer(size, size), np.finfo(float).tiny)
    _, group = connected_components(csr_array(joined | joined.T), directed=False)
    return [np.flatnonzero(group == g).tolist() for g in range(group.max(initial=-1) + 1)]


def _blocks(omega: Real, damping: Real) -> tuple[Real, Real, Real]:
    """Blocks (n, 2, 2) of coupled modes; their states of modal displacements and velocities (2n,
    2n), and the way back."""
    n = len(omega)
    if n == 1:
        block = np.array([[[0.0, 1.0], [-(omega[0] ** 2), -damping[0, 0]]]])
        return block, np.eye(2), np.eye(2)
    full = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -damping]])
    lam, X = la.eig(full)
    real = np.flatnonzero(np.abs(lam.imag) <= 1e-12 * np.abs(lam).max())
    pairs = np.flatnonzero(lam.imag > 1e-12 * np.abs(lam).max())
    back, blocks = np.zeros((2 * n, 2 * n)), np.zeros((n, 2, 2))
    for k, i in enumerate(pairs):
        a, b = lam[i].real, lam[i].imag
        blocks[k] = [[a, b], [-b, a]]
        back[:, 2 * k], back[:, 2 * k + 1] = X[:, i].real, X[:, i].imag
    for k, (i, j) in enumerate(zip(real[::2], real[1::2], strict=True), len(pairs)):
        blocks[k] = np.diag([lam[i].real, lam[j].real])
        back[:, 2 * k], back[:, 2 * k + 1] = X[:, i].real, X[:, j].real
    into: Real = np.asarray(np.linalg.inv(back), dtype=float)
    again = back @ la.block_diag(*blocks) @ into
    if np.abs(again - full).max() > DEFECTIVE * np.abs(full).max():
        raise ModelError(
            "the damping couples the modes so that they have no complete set of complex modes. "
            "Change a dashpot by a little."
        )
    return blocks, into, back
