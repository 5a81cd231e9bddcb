"""A sum over the vectors of a basis: H(s) = Σ b fᵀ / (κ + iη + sc + s²μ), and what couples them by
Woodbury's formula."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.synthesis.basis import Basis, columns

Complex = NDArray[np.complex128]
CHUNK = 2_000_000
"""Complex numbers held at a time."""


@dataclass(frozen=True)
class ModalSum:
    """Vectors with stiffness ``kappa``, mass ``mu``, viscous ``viscous`` and hysteretic ``loss``
    damping (k,); for mass-normalised modes ω², 1, 2ζω, 0.

    ``C`` and ``D`` (low, low), None where there is none: further viscous (or gyroscopic) and
    hysteretic damping that couples the first ``low`` of them.
    """

    kappa: Real
    mu: Real
    viscous: Real
    loss: Real
    C: Real | None = None
    D: Real | None = None

    @classmethod
    def of(cls, basis: Basis, modal: Real) -> ModalSum:
        """Of a basis, with ``modal`` (k,) viscous damping of each vector besides its own."""
        viscous = basis.viscous + modal
        return cls(basis.kappa, basis.mu, viscous, basis.loss, basis.C, basis.D)

    def inverse(self, s: Complex) -> Complex:
        """1 / (κ + iη + sc + s²μ), (points, k)."""
        t = s[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):  # `responses` says where it has none
            return np.asarray(
                1.0 / (self.kappa + 1j * self.loss + t * self.viscous + t**2 * self.mu)
            )

    def at(self, s: Complex, B: Real, F: Real) -> Complex:
        """H (points, o, i) between outputs with the shapes ``B`` (o, k) and inputs with ``F``
        (i, k)."""
        pairs = (B[:, None, :] * F[None, :, :]).reshape(-1, B.shape[1]).T
        out = np.empty((len(s), len(B), len(F)), dtype=np.complex128)
        U, W, weight = self._coupling()
        r = U.shape[1]
        step = max(1, CHUNK // (B.shape[1] + r * (len(B) + len(F) + r)))
        for start in range(0, len(s), step):
            some = slice(start, start + step)
            g = self.inverse(s[some])
            H = _times(g, pairs).reshape(-1, len(B), len(F))
            if r:
                H = H - _coupled(g, U, W, weight(s[some]), B, F)
            out[some] = H
        return out

    def _coupling(self) -> tuple[Real, Real, Any]:
        """The coupling damping as U X Wᵀ: U and W (k, r), and the diagonal of X at points s,
        (points, r)."""
        k = len(self.kappa)
        empty = (np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))
        (c, Uc, Wc), (d, Ud, Wd) = (empty if A is None else columns(A) for A in (self.C, self.D))
        U, W = (
            np.hstack([np.vstack([v, np.zeros((k - len(v), v.shape[1]))]) for v in pair])
            for pair in ((Uc, Ud), (Wc, Wd))
        )

        def weight(s: Complex) -> Complex:
            return np.hstack([s[:, None] * c, np.broadcast_to(1j * d, (len(s), len(d)))])

        return U, W, weight


def _coupled(g: Complex, U: Real, W: Real, weight: Complex, B: Real, F: Real) -> Complex:
    """What (Δ + U X Wᵀ)⁻¹ lacks of Δ⁻¹: B Δ⁻¹ U (I + X Wᵀ Δ⁻¹ U)⁻¹ X Wᵀ Δ⁻¹ Fᵀ, Δ⁻¹ = diag ``g``.

    The inverse is taken of the product, so that a vanishing X does no harm.
    """

    def between(left: Real, right: Real) -> Complex:
        pairs = (left[:, :, None] * right[:, None, :]).reshape(len(left), -1)
        return _times(g, pairs).reshape(len(g), left.shape[1], right.shape[1])

    core = np.eye(U.shape[1]) + weight[:, :, None] * between(W, U)
    return np.asarray(between(B.T, U) @ np.linalg.solve(core, weight[:, :, None] * between(W, F.T)))


def _times(g: Complex, real: Real) -> Complex:
    """Complex times real without making the real one complex."""
    return np.asarray(g.real @ real + 1j * (g.imag @ real))
