"""Derivatives of mode shapes with the one factorisation of K that the modes were found with.

(K − λᵢM) y = f, y orthogonal to the mode's own shapes (Nelson 1976), splits into what the known
modes say exactly and a rest in their complement. There K⁻¹(K − λᵢM) has its eigenvalues between
1 − λᵢ/λ₊ and 1, λ₊ the first eigenvalue not known, so conjugate gradients with K⁻¹ as
preconditioner need a few iterations whatever the mesh, and all modes and right-hand sides go
together (cf. Alvin 1997). No factorisation of K − λM, one for each mode, is made or kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factored

ITERATIONS = 200
ACCURATE = 1e-8  # relative decrease of the preconditioned residual: what the modes are known to


@dataclass(frozen=True)
class SharedSolver:
    """M, ``factor`` of K, and the lowest modes, known exactly: ``eigenvalues`` (k,), ``shapes``
    (N, k) with φᵀMφ = 1, of a structure without rigid-body modes."""

    mass: sp.csc_array
    factor: Factored
    eigenvalues: Real
    shapes: Real

    def solve(self, own: Real, f: Real, same: Real) -> Real:
        """y (N, c) with (K − λM) y = f less what lies along the mode's own shapes, Φ_ownᵀ M y = 0.

        Parameters
        ----------
        own : eigenvalue λ of each column, (c,); f : (N, c).
        same : (k, c), True where known mode j has the eigenvalue of column c (its own cluster).

        Raises
        ------
        ModelError
            Where the iteration does not converge: λ is repeated beyond the known modes.
        """
        Phi, MPhi = self.shapes, self.mass @ self.shapes
        forced = Phi.T @ f
        gap = self.eigenvalues[:, None] - own[None, :]
        modal = np.where(same, 0.0, forced / np.where(same, 1.0, gap))
        return np.asarray(Phi @ modal + self._rest(MPhi, own, f - MPhi @ forced))

    def _rest(self, MPhi: Real, own: Real, r: Real) -> Real:
        """The part of y in the M-complement of the known modes, by conjugate gradients, column by
        column in one block.

        K d is carried along with d, for K times a vector would bring in the rounding of K's largest
        entries.
        """
        M, y = self.mass, np.zeros_like(r)
        z = self._preconditioned(r, MPhi)
        rho = np.einsum("ij,ij->j", r, z)
        live = np.flatnonzero(rho > 0.0)
        first = rho[live]
        r, d, Kd, rho, lam = r[:, live], z[:, live], r[:, live], rho[live], own[live]
        for _ in range(ITERATIONS):
            if not len(live):
                return y
            q = Kd - (M @ d) * lam
            alpha = rho / np.einsum("ij,ij->j", d, q)
            y[:, live] += alpha * d
            r = r - alpha * q
            z = self._preconditioned(r, MPhi)
            new = np.einsum("ij,ij->j", r, z)
            d, Kd = z + (new / rho) * d, r + (new / rho) * Kd
            on = new > ACCURATE**2 * first
            live, first, lam, rho = live[on], first[on], lam[on], new[on]
            r, d, Kd = r[:, on], d[:, on], Kd[:, on]
        raise ModelError(
            "the derivatives of the mode shapes did not converge: an eigenvalue is nearly repeated "
            "beyond the modes that were computed. Compare frequencies only, or break the symmetry "
            "of the model."
        )

    def _preconditioned(self, r: Real, MPhi: Real) -> Real:
        """K⁻¹ r without its part along the known modes, which only rounding brings in."""
        z = self.factor.solve(r)
        return np.asarray(z - self.shapes @ (MPhi.T @ z))
