"""Small dense matrices in the place of a model's: one dense system for each point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.synthesis.basis import Basis

Field = NDArray[Any]
Complex = NDArray[np.complex128]
CHUNK = 4_000_000
"""Entries of dense systems held at a time."""


@dataclass(frozen=True)
class Galerkin:
    """VᵀKV, VᵀMV, VᵀCV and VᵀDV (k, k)."""

    K: Real
    M: Real
    C: Real
    D: Real

    @classmethod
    def of(cls, basis: Basis, modal: Real) -> Galerkin:
        """Of a basis, with ``modal`` (k,) viscous damping of each vector besides its own."""
        C, D = np.diag(basis.viscous + modal), np.diag(basis.loss)
        return cls(
            np.diag(basis.kappa),
            np.diag(basis.mu),
            C if basis.C is None else C + basis.C,
            D if basis.D is None else D + basis.D,
        )

    def at(self, s: Complex, B: Real, F: Real) -> Complex:
        """H (points, o, i) between outputs with the shapes ``B`` (o, k) and inputs with ``F``
        (i, k)."""
        out = np.empty((len(s), len(B), len(F)), dtype=np.complex128)
        step = max(1, CHUNK // max(self.K.size, 1))
        for start in range(0, len(s), step):
            some = slice(start, start + step)
            out[some] = B @ np.linalg.solve(self.stiffness(s[some]), F.T.astype(complex)[None])
        return out

    def stiffness(self, s: Complex, lossy: bool = True) -> Field:
        """K + s²M + sC + iD (points, k, k); its real part alone unless ``lossy``, for undamped
        points on the imaginary axis."""
        t = s[:, None, None]
        Z = self.K + t**2 * self.M
        return np.asarray(Z + t * self.C + 1j * self.D if lossy else Z.real)
