"""The largest eigenvalues of K⁻¹M by block Lanczos (Golub and Underwood 1977) with full
reorthogonalisation and thick restarts (Wu and Simon 2000).

Factors of a large model are read from memory once for all the columns that are solved for
together: four take 1.3 times (MKL Pardiso) or twice (SuperLU) the time of one. A block also holds
every copy of an eigenvalue that is repeated up to as many times as it is wide.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dsyevd

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.subspace import Apply, independent

WIDE = 4  # times what is sought: a basis that has grown so far is reduced to half of it
ACCURACY = 1e-10  # of an eigenvalue, what a step leaves: a last inverse iteration takes it to 1e-12
OFTEN = 10  # eigenvalues of the small matrix are taken each time it has grown by a tenth
RESTARTS = 300
ROUNDING = 1e-13  # of a block's size: columns that small are rounding of what was taken away
LEFT = 0.5  # of a column the second time: what loses more was such rounding


def largest_eigenvalues(
    solve: Apply, inertia: Apply, size: int, count: int, together: int
) -> tuple[Real, Real]:
    """The ``count`` eigenvalues θ of K⁻¹M that are largest in magnitude, and vectors x (size,
    count) with xᵀMx = 1; fewer where K⁻¹M has no more.

    ``solve`` x ↦ K⁻¹x and ``inertia`` x ↦ M x take (size, k); ``together`` columns at a time. M
    may be singular, K indefinite.

    Raises
    ------
    ModelError
        When not all have converged after `RESTARTS` restarts.
    """
    lanczos = _Lanczos(solve, inertia, size, count, together)
    for _ in range(RESTARTS):
        found = lanczos.run()
        if found is not None:
            return found
        lanczos.restart()
    raise ModelError(
        f"the natural modes did not converge after {RESTARTS} restarts. Is the mass matrix "
        "positive semidefinite?"
    )


class _Lanczos:
    """Q (N, k) with QᵀMQ = I, T = QᵀM K⁻¹M Q, the next block beside them, and ``rest``: K⁻¹M of
    the last block is Q T + block · rest."""

    def __init__(self, solve: Apply, inertia: Apply, size: int, count: int, together: int) -> None:
        self._solve, self._inertia = solve, inertia
        self._size, self._count, self._together = size, count, together
        self._random = np.random.default_rng(0)
        most = min(size, WIDE * (count + together)) + together
        # columns as they come lie together
        self._Q, self._T = np.empty((size, most), order="F"), np.zeros((most, most))
        self._width = 0
        self._near = 0  # the first column that Lanczos's recurrence reaches back to
        self._begin()

    def run(self) -> tuple[Real, Real] | None:
        """Until all have converged, or None when the basis is full."""
        look = self._count
        while self._width + self._block.shape[1] <= len(self._T):
            if not self._block.shape[1]:  # nothing is left of K⁻¹M: these are all
                return self._taken(*self._ritz())
            last = self._step()
            if self._width < look and self._block.shape[1]:
                continue
            look = self._width + max(self._width // OFTEN, 1)
            values, Y = self._ritz()
            left = np.linalg.norm(self._rest @ Y[last], axis=0)
            if len(values) == self._count and np.all(left <= ACCURACY * np.abs(values)):
                return self._taken(values, Y)
            if not self._block.shape[1]:  # an invariant space, too small
                self._begin()
        return None

    def restart(self) -> None:
        """Reduces the basis to the half that belongs to the largest eigenvalues."""
        values, Y = self._ritz(max(len(self._T) // 2, self._count))
        self._Q[:, : len(values)] = self._taken(values, Y)[1]
        self._T[:] = 0.0
        self._width, self._near = len(values), 0
        np.fill_diagonal(self._T[: self._width, : self._width], values)

    def _begin(self) -> None:
        """A random block, apart from Q; K⁻¹M takes out of it what has no mass."""
        drawn = self._random.standard_normal((self._size, self._together))
        self._apart(self._solve(self._inertia(drawn)))

    def _step(self) -> slice:
        """Takes the block into Q and sets the next one; the columns where it stands."""
        before, after = self._width, self._width + self._block.shape[1]
        self._Q[:, before:after] = self._block
        self._width = after
        # beyond the recurrence there is rounding alone, which would keep vectors from converging
        near = slice(self._near, after)
        along = self._apart(self._solve(self._pushed))[near]
        self._T[near, before:after] = along
        self._T[before:after, near] = along.T
        self._near = before
        return slice(before, after)

    def _apart(self, new: Real) -> Real:
        """Makes what of ``new`` (N, p) lies apart from Q the next block: ``new`` = Q ``along`` +
        block · rest; ``along`` (k, p).

        Twice, for what is small beside what was taken away has its errors.
        """
        pushed = self._inertia(new)
        floor = ROUNDING**2 * np.einsum("ij,ij->j", new, pushed).max(initial=0.0)
        along, rest = np.zeros((self._width, new.shape[1])), np.eye(new.shape[1])
        for first in (self._near, 0):
            Q = self._Q[:, first : self._width]
            part = Q.T @ pushed
            new = new - Q @ part
            pushed = self._inertia(new)
            gram = new.T @ pushed
            turn = independent(gram, floor)
            along[first:] += part @ rest
            rest = turn.T @ gram @ rest
            new, pushed, floor = new @ turn, pushed @ turn, LEFT**2
        self._block, self._pushed, self._rest = new, pushed, rest
        return along

    def _ritz(self, most: int | None = None) -> tuple[Real, Real]:
        """The eigenvalues of T that are largest in magnitude, and its vectors (k, most)."""
        values, Y, _ = dsyevd(self._T[: self._width, : self._width])
        order = np.argsort(-np.abs(values))[: most or self._count]
        return values[order], Y[:, order]

    def _taken(self, values: Real, Y: Real) -> tuple[Real, Real]:
        return values, self._Q[:, : self._width] @ Y
