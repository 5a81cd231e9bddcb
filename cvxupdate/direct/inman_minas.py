"""Inman and Minas (1990): eigenstructure assignment, iterated until it is symmetric (2.7.4)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.direct.assignment import minas_inman
from cvxupdate.direct.fuh_chen import realised
from cvxupdate.direct.least_change import check
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import InputError

Real = NDArray[np.float64]
CYCLES, STEPS = 30, 60
"""Of the iteration, at most; a few tens of steps in all are needed."""
FALL = 1e-4
"""Of the gradient in one cycle: what rounding adds beyond it would grow along later directions."""
LEFT = 1e-12
"""Asymmetry, relative to the change, at which it ends."""


def inman_minas(K: Real, M: Real, C: Real, Phi: NDArray[Any], rates: NDArray[Any]) -> DirectUpdate:
    """Symmetric C_U, K_U with the modes, nearest to what `minas_inman` gives (2.97).

    The assignment is made symmetric, which spoils the modes; they are assigned again by the least
    change of the gain (outputs D₀ = I, D₁ = I / |s|), and so on. Such alternating projections on
    two flat sets end in the nearest point that both have; steps along conjugate directions, as
    here, end there sooner. The thesis says only that the scheme iterates; this iteration is ours.

    Parameters
    ----------
    K, M, C : (N, N); Phi : (N, m); rates : (m,) complex s, one of each conjugate pair.

    Raises
    ------
    InputError
        When no symmetric C and K with this mass have the modes (real shapes that are not orthogonal
        in the mass), so that the iteration does not settle.
    """
    check(len(M), Phi.real)
    first = minas_inman(K, M, C, Phi, rates)
    X, block = realised(Phi, rates)
    size = float(np.mean(np.abs(rates)))
    XL = X @ block / size
    force = -(M @ X @ block @ block + C @ X @ block + K @ X)
    outputs = np.linalg.pinv(np.vstack([X, XL]), rcond=1e-12)  # (2m, 2N)
    n = len(M)

    def kept(x: Real) -> Real:
        """The part of a change (N, 2N) that leaves the assigned modes alone."""
        return np.asarray(x - (x[:, :n] @ X + x[:, n:] @ XL) @ outputs)

    def skew(x: Real) -> Real:
        return np.hstack([0.5 * (x[:, :n] - x[:, :n].T), 0.5 * (x[:, n:] - x[:, n:].T)])

    change = np.hstack([first.K - K, (0.0 * K if first.C is None else first.C - C) * size])
    whole = max(float(np.linalg.norm(change)), np.finfo(float).tiny)
    for _ in range(CYCLES):
        change = change + (force - change[:, :n] @ X - change[:, n:] @ XL) @ outputs
        if float(np.linalg.norm(skew(change))) <= LEFT * whole:
            dK, dC = change[:, :n], change[:, n:]
            return DirectUpdate("Inman and Minas", M.copy(), K + dK, C + dC / size)
        change = change + _conjugate(lambda x: kept(skew(x)), -kept(skew(change)))
    raise InputError(
        "inman_minas: no symmetric damping and stiffness with this mass have these modes; correct "
        "the shapes or the mass first."
    )


def _conjugate(acts: Callable[[Real], Real], right: Real) -> Real:
    """x with ``acts(x)`` = ``right`` but for `FALL` of it, by conjugate gradients from nothing."""
    x, rest = np.zeros_like(right), right
    along = rest
    for _ in range(STEPS):
        turned = acts(along)
        curvature = float(np.sum(along * turned))
        if curvature <= 0.0:
            break
        step = float(np.sum(rest * rest)) / curvature
        x, after = x + step * along, rest - step * turned
        if np.linalg.norm(after) <= FALL * np.linalg.norm(right):
            break
        along = after + float(np.sum(after * after) / np.sum(rest * rest)) * along
        rest = after
    return x
