"""The lowest modes by Rayleigh–Ritz in a space that grows by K⁻¹M applied to what is left of the
modes wanted: block Lanczos in its residuals (Golub and Underwood 1977; Stathopoulos and McCombs
2007).

Several columns are solved for at a time, which takes a fraction of the time of as many single ones:
factors of large models are read from memory once for all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray
from scipy.linalg.lapack import dsyevd

from cvxupdate.fe.elements.base import Real

Apply = Callable[[NDArray[Any]], Real]

WIDE = 4  # times the modes carried: a space that has grown so far is reduced to its Ritz vectors
INDEPENDENT = 1e-13  # relative eigenvalue of a Gram matrix below which columns are rounding
NEGATIVE = 1e-8  # the same of H below zero, beyond which K is negative on a motion: no rounding
NEARLY = 0.1  # the cosine below which once leaves nothing but rounding of what was orthogonal


def lowest_modes(
    solve: Apply, inertia: Apply, X: Real, wanted: int, accuracy: float, steps: int
) -> tuple[Real, Real] | None:
    """Eigenvalues of K φ = λ M φ, ascending, and shapes with φᵀMφ = 1, as many as ``X`` (N, b) has
    columns, the lowest ``wanted`` of them to ``accuracy``: estimated sine of an angle; eigenvalues
    to its square.

    ``solve`` x ↦ K⁻¹x and ``inertia`` x ↦ M x take (N, k); M may be singular if K⁻¹M is where X
    comes from. None without convergence after ``steps`` blocks, and where K is not positive
    definite on the space.

    What is left of a mode x = B y in the space B = K⁻¹MP is x − P y/λ, for T x would be x/λ: the
    error of P y. That of x is smaller by λ over the first eigenvalue that is not sought, because
    errors lie along the modes from there on.
    """
    space = _Space(X.shape[0], X.shape[1], inertia)
    new, pushed = _orthonormal(X, inertia(X))
    last = 0  # the first mode that had not converged
    for _ in range(steps):
        space.grow(new, solve(pushed))
        ritz = space.ritz()
        if ritz is None:
            return None
        values, Y = ritz
        open_ = np.zeros(0, dtype=int)
        for first in dict.fromkeys((last, 0)):  # those below once more before the end
            left, pushed, size = space.left(values, Y, slice(first, wanted))
            open_ = np.flatnonzero(size * values[first:wanted] / values[-1] > accuracy)
            if len(open_):
                last = first + int(open_[0])
                break
        if not len(open_):
            return values, space.spanned[1] @ Y
        space.leave_room(len(open_), Y)
        new, pushed = space.apart(left[:, open_] / size[open_], pushed[:, open_] / size[open_])
        if not new.shape[1]:
            return None
    return None


class _Space:
    """P (N, k) with PᵀMP = I and B = K⁻¹MP, with H = PᵀMB = BᵀKB and G = BᵀMB: nothing is
    multiplied by K, whose large entries would leave rounding in the small eigenvalues."""

    def __init__(self, size: int, modes: int, inertia: Apply) -> None:
        most = WIDE * modes
        # columns as they come lie together, so that growing moves nothing
        self._P, self._B = (np.empty((size, most), order="F") for _ in range(2))
        self._H, self._G = np.zeros((most, most)), np.zeros((most, most))
        self._modes, self._width, self._inertia = modes, 0, inertia

    @property
    def spanned(self) -> tuple[Real, Real]:
        """P and B."""
        return self._P[:, : self._width], self._B[:, : self._width]

    def grow(self, new: Real, solved: Real) -> None:
        """By the orthonormal columns ``new`` (N, k) and ``solved`` = K⁻¹M of them."""
        before, after = self._width, self._width + new.shape[1]
        self._P[:, before:after], self._B[:, before:after] = new, solved
        self._width = after
        self._measure(before, self._inertia(solved))

    def ritz(self) -> tuple[Real, Real] | None:
        """The lowest Ritz values in the span of B, and the shapes' coefficients; None where
        rounding leaves fewer directions, or K is not positive there.

        1/λ is sought: the lowest modes have the largest.
        """
        k, b = self._width, self._modes
        H, G = self._H[:k, :k], self._G[:k, :k]
        diagonal = H.diagonal()
        if not (np.all(diagonal > 0.0) and np.all(np.isfinite(H)) and np.all(np.isfinite(G))):
            return None
        scale = 1.0 / np.sqrt(diagonal)
        weights, V, _ = dsyevd((H + H.T) * (0.5 * scale) * scale[:, None])
        keep = weights > INDEPENDENT * weights[-1]
        if weights[0] < -NEGATIVE * weights[-1] or np.sum(keep) < b:
            return None
        T = scale[:, None] * V[:, keep] / np.sqrt(weights[keep])
        inverse, Y, _ = dsyevd(T.T @ G @ T)
        inverse, Y = inverse[: -b - 1 : -1], Y[:, : -b - 1 : -1]
        if inverse[-1] <= 0.0:
            return None
        return 1.0 / inverse, T @ Y / np.sqrt(inverse)

    def left(self, values: Real, Y: Real, of: slice) -> tuple[Real, Real, Real]:
        """What is left of the modes ``of`` the Ritz vectors ``Y`` (k, b), M times that, and its
        size."""
        P, B = self.spanned
        left = B @ Y[:, of] - P @ (Y[:, of] / values[of])
        pushed = self._inertia(left)
        return left, pushed, np.sqrt(np.abs(np.einsum("ij,ij->j", left, pushed)))

    def apart(self, new: Real, pushed: Real) -> tuple[Real, Real]:
        """What of ``new`` (N, k) lies apart from P, orthonormal, and M times it; ``pushed`` =
        M new."""
        P = self.spanned[0]
        for _ in range(2):  # twice is enough
            along = P.T @ pushed
            new = new - P @ along
            pushed = self._inertia(new)
            if np.abs(along).max() < NEARLY:
                break
        return _orthonormal(new, pushed)

    def leave_room(self, more: int, Y: Real) -> None:
        """Reduces the space to its Ritz vectors ``Y`` (k, b) where ``more`` columns would make it
        too wide."""
        k, b = self._width, self._modes
        if k + more <= WIDE * b:
            return
        turn = la.solve_triangular(la.cholesky(Y.T @ Y), Y.T, trans="T").T
        for whole in (self._P, self._B):
            whole[:, :b] = whole[:, :k] @ turn
        self._width = b
        # anew: turned along with them, they would keep the rounding of what was given up
        self._measure(0, self._inertia(self._B[:, :b]))

    def _measure(self, begin: int, pushed: Real) -> None:
        """H and G of the columns from ``begin`` on, ``pushed`` = M B of these."""
        k = self._width
        for gram, basis in zip((self._H, self._G), self.spanned, strict=True):
            gram[:k, begin:k] = basis.T @ pushed
            gram[begin:k, :begin] = gram[:begin, begin:k].T


def _orthonormal(X: Real, pushed: Real) -> tuple[Real, Real]:
    """Columns that span the same as X in the inner product of M, those that rounding tells apart,
    and M times them; ``pushed`` = M X."""
    turn = independent(X.T @ pushed)
    return X @ turn, pushed @ turn


def independent(gram: Real, floor: float = 0.0) -> Real:
    """Combinations (k, j ≤ k) that a Gram matrix (k, k) makes orthonormal: without those that
    rounding tells from the others no more, and without columns whose square is not above
    ``floor``."""
    squares = gram.diagonal()
    above = squares > floor
    if not np.all(above):
        turn = np.zeros((len(gram), int(np.sum(above))))
        turn[above] = np.eye(turn.shape[1])
        return turn @ independent(gram[np.ix_(above, above)])
    if not len(gram):
        return gram
    scale = 1.0 / np.sqrt(squares)
    weights, V, _ = dsyevd(gram * scale * scale[:, None])
    keep = weights > INDEPENDENT * weights[-1]
    return np.asarray(scale[:, None] * (V[:, keep] / np.sqrt(weights[keep])))
