"""The flexible part of K φ = λ M φ, with rigid-body modes taken out exactly.

A free structure is held at as many DOFs as it has rigid-body modes R, so K_ff is regular; with φ =
x − R Rᵀ M x (x zero at the held DOFs) K R = 0 gives φᵀ K φ = xᵀ K_ff x and φᵀ M φ = xᵀ M̃ x, M̃ = M
− (M R)(M R)ᵀ (cf. the self-equilibrated flexibility of Craig and Bampton 1968). No shift has to be
guessed and massless DOFs need no care. The pencil is taken as M̃ x = μ K_ff x, μ = 1/λ, because its
largest eigenvalues are those that rounding leaves whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factored, factored
from cvxupdate.fe.lanczos import largest_eigenvalues
from cvxupdate.fe.pardiso import PardisoFactor
from cvxupdate.fe.positive_mass import check_mass
from cvxupdate.fe.rigid import mass_normalised, rounding

_SINGULAR = (
    "stiffness and mass both vanish on some motion: the model is a mechanism. Add the missing "
    "element or support."
)
TOGETHER = 4  # columns solved for at a time: of 2 to 12 the fastest at 1e4 to 3e5 DOFs
FEW = 0.25  # of all: LAPACK's search for single ones is sooner done up to there (60 to 500 DOFs)
_EXTRA = 3  # modes beyond those wanted, among which a gap is sought for the Sturm count


@dataclass(frozen=True)
class Problem:
    """K, M (N, N), mass-normalised motions ``R`` (N, r) with K R = 0, the DOFs ``held`` (r or
    more); ``shift`` s stands for K + s M."""

    K: sp.csc_array
    M: sp.csc_array
    R: Real
    held: Index
    check_mass: bool
    shift: float = 0.0

    @property
    def size(self) -> int:
        """Number of DOFs N."""
        return int(self.K.shape[0])

    @cached_property
    def free(self) -> Index:
        """DOFs that are not held."""
        every = np.arange(self.size)
        return np.setdiff1d(every, self.held) if len(self.held) else every

    @cached_property
    def stiffness(self) -> sp.csc_array:
        """K_ff + s M_ff; the low-rank rest of s M̃ is left to the callers."""
        return self._cut(self.K + self.shift * self.M if self.shift else self.K)

    @cached_property
    def mass(self) -> sp.csc_array:
        """M_ff."""
        return self._cut(self.M)

    @cached_property
    def carried(self) -> Real:
        """(M R)_f, (N − r, r): M̃ is M_ff less the product of this with its transpose."""
        return np.asarray(self.M @ self.R)[self.free]

    def _cut(self, A: sp.csc_array) -> sp.csc_array:
        return sp.csc_array(A[self.free][:, self.free]) if len(self.held) else A

    def inertia(self, x: Real) -> Real:
        """M̃ x."""
        return np.asarray(self.mass @ x - self.carried @ (self.carried.T @ x))

    def lift(self, x: Real) -> Real:
        """x on the DOFs that are not held → φ on all, M-orthogonal to R."""
        out = np.zeros((self.size, x.shape[1]))
        out[self.free] = x
        return np.asarray(out - self.R @ (self.carried.T @ x))


def filled(A: sp.csc_array) -> Any:
    """(N,) whether a column holds anything but zeros."""
    until = np.concatenate([[0], np.cumsum(A.data != 0.0)])
    return until[A.indptr[1:]] > until[A.indptr[:-1]]


def flexible_modes(problem: Problem, count: int, dense: int) -> tuple[Real, Real]:
    """The lowest ``count`` flexible eigenvalues, ascending, and shapes (N, ≤ count), by LAPACK up
    to ``dense`` DOFs.

    Raises
    ------
    ModelError
        When M has a negative eigenvalue or both K and M vanish on some motion.
    """
    if problem.check_mass:
        check_mass(problem.M, dense)
    heavy = np.flatnonzero(filled(problem.mass))
    count = min(count, len(heavy))
    if count <= 0:
        return np.zeros(0), np.zeros((problem.size, 0))
    if problem.size <= dense or count + _EXTRA > len(problem.free) // 4:
        return _dense(problem, count)
    if len(heavy) <= max(dense, 4 * (count + _EXTRA)):
        return _few_masses(problem, count, heavy)
    return _sparse(problem, count)


def unresisted(K: sp.csc_array, M: sp.csc_array, dense: int) -> Real:
    """Mass-normalised motions (N, r) that K does not resist, found from the matrices alone.

    Raises
    ------
    ModelError
        As `flexible_modes`.
    """
    problem = Problem(
        K, M, np.zeros((K.shape[0], 0)), np.zeros(0, dtype=np.int64), True, _shift(K, M)
    )
    count = 8
    while True:
        values, shapes = flexible_modes(problem, count, dense)
        shapes = shapes / np.sqrt(np.einsum("ij,ij->j", shapes, M @ shapes))
        loose = np.abs(np.einsum("ij,ij->j", shapes, K @ shapes)) <= rounding(K, shapes)
        if not np.all(loose) or len(values) < count:
            return mass_normalised(shapes[:, loose], M)
        count *= 2


def _shift(K: sp.csc_array, M: sp.csc_array) -> float:
    """Well above what rounding of K makes of a zero eigenvalue, and small beside those of the
    mesh."""
    k, m = np.abs(K.diagonal()), M.diagonal()
    heavy = (m > 0.0) & (k > 0.0)
    ratio = k[heavy] / m[heavy] if np.any(heavy) else np.ones(1)
    return float(1e-6 * np.median(ratio) + 1e5 * np.finfo(float).eps * ratio.max())


def _shifted(problem: Problem, attempt: int) -> Problem:
    """The problem made positive by mass, for a K_ff that is not (a mechanism, negative stiffness).

    Raises
    ------
    ModelError
        After four attempts: mass does not help either.
    """
    if attempt == 4:
        raise ModelError(_SINGULAR)
    return replace(problem, shift=max(problem.shift, _shift(problem.K, problem.M)) * 1e3**attempt)


def _ascending(problem: Problem, mu: Real, x: Real, count: int) -> tuple[Real, Real]:
    """λ = 1/μ − s and lifted shapes, ascending; μ at rounding level belongs to massless motions."""
    keep = np.abs(mu) > 1e-14 * np.abs(mu).max(initial=0.0)
    values, shapes = 1.0 / mu[keep] - problem.shift, problem.lift(x[:, keep])
    order = np.argsort(values)[:count]
    return values[order], shapes[:, order]


def _dense(problem: Problem, count: int, attempt: int = 0) -> tuple[Real, Real]:
    carried = problem.carried @ problem.carried.T
    stiffness = problem.stiffness.toarray() - problem.shift * carried
    n = len(stiffness)
    try:
        mu, x = la.eigh(
            problem.mass.toarray() - carried,
            stiffness,
            # many of them sooner among all, by divide and conquer
            subset_by_index=None if count >= FEW * n else [n - count, n - 1],
            check_finite=False,
        )
    except la.LinAlgError:
        return _dense(_shifted(problem, attempt), count, attempt + 1)
    return _ascending(problem, mu[-count:], x[:, -count:], count)


def _few_masses(problem: Problem, count: int, heavy: Index, attempt: int = 0) -> tuple[Real, Real]:
    """Mass on few DOFs of many: with the flexibilities F (N, k) of the heavy DOFs and M̃ = L Lᵀ
    there, Lᵀ F L y = μ y and x = F L y."""
    unit = np.zeros((len(problem.free), len(heavy)))
    unit[heavy, np.arange(len(heavy))] = 1.0
    try:
        F = _inverse(problem, _factored(problem))(unit)
    except ModelError:
        return _few_masses(_shifted(problem, attempt), count, heavy, attempt + 1)
    weights, V = la.eigh(problem.inertia(unit)[heavy], check_finite=False)
    L = V * np.sqrt(np.maximum(weights, 0.0))
    B = L.T @ F[heavy] @ L
    mu, y = la.eigh((B + B.T) / 2, check_finite=False)
    return _ascending(problem, mu, F @ (L @ y), count)


def _sparse(problem: Problem, count: int, attempt: int = 0) -> tuple[Real, Real]:
    """Shift-invert Lanczos; asked for more where the Sturm count says that a repeated mode was
    missed, shifted where K is not positive."""
    wanted, together = count, TOGETHER
    try:
        for _ in range(3):
            values, shapes, factor = _lanczos(
                problem, min(wanted + _EXTRA, len(problem.free) - 2), together
            )
            if (
                len(values) < count
            ):  # one motion so soft that rounding swallows the others: nearly a mechanism
                break
            cut = _gap(values, count)
            A = _less(problem.K, cut, problem.M)
            below = factored(A, "K − μ M", instead_of=factor).negatives()
            missed = 0 if below is None else below - problem.R.shape[1] - int(np.sum(values < cut))
            if missed <= 0:
                return values[:count], shapes[:, :count]
            wanted += missed + _EXTRA
            together += missed
        else:
            # K is positive by the shift and three counts disagree: it is the count that rounding
            # has spoilt
            if attempt:
                return values[:count], shapes[:, :count]
    except ModelError:
        pass
    return _sparse(_shifted(problem, attempt), count, attempt + 1)


def _less(K: sp.csc_array, cut: float, M: sp.csc_array) -> sp.csc_array:
    """K − μ M, with K's pattern where M has the same."""
    if np.array_equal(K.indptr, M.indptr) and np.array_equal(K.indices, M.indices):
        return sp.csc_array((K.data - cut * M.data, K.indices, K.indptr), shape=K.shape)
    return sp.csc_array(K - cut * M)


def _factored(problem: Problem) -> Factored:
    return factored(problem.stiffness, "the stiffness matrix")


def _inverse(problem: Problem, factor: Factored) -> Callable[[Real], Real]:
    """x ↦ (K_ff + s M̃)⁻¹ x, the low-rank part by Woodbury's formula."""
    C = problem.carried
    if not problem.shift or not C.shape[1]:
        return factor.solve
    U = factor.solve(C)
    core = np.eye(C.shape[1]) / problem.shift - C.T @ U

    def solve(b: Real) -> Real:
        y = factor.solve(b)
        return np.asarray(y + U @ np.linalg.solve(core, C.T @ y))

    return solve


def _gap(values: Real, wanted: int) -> float:
    """The middle of the widest relative gap at or after the last mode wanted: there K − μ M is
    farthest from singular."""
    last = values[wanted - 1 :]
    if len(last) < 2:
        return float(last[0] + 1e-6 * abs(last[0]))
    at = int(np.argmax(np.diff(last)))
    return float((last[at] + last[at + 1]) / 2.0)


def _lanczos(
    problem: Problem, count: int, together: int
) -> tuple[Real, Real, PardisoFactor | None]:
    """Eigenvalues, shapes, and the factors where those of the Sturm count can take their place;
    others are let go before, for they are most of the memory."""
    factor = _factored(problem)
    inverse = _inverse(problem, factor)
    mu, x = largest_eigenvalues(inverse, problem.inertia, len(problem.free), count, together)
    # One more inverse iteration takes out what Lanczos gathered in the null space of M (Nour-Omid
    # et al. 1987).
    values, shapes = _ascending(problem, mu, inverse(problem.inertia(x)) / mu, count)
    if isinstance(factor, PardisoFactor) and not len(problem.held):
        return values, shapes, factor
    return values, shapes, None
