"""Sparse factorisations of symmetric matrices, reused for many right-hand sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import SuperLU, splu

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.orders import order_of
from cvxupdate.fe.pardiso import LARGE, PardisoFactor, Perturbed, library

SINGULAR = (
    "{} is singular. The model is a mechanism, or a DOF has neither stiffness nor mass: add the "
    "missing element or support."
)
SYMMETRIC = 1e-12  # of the largest entry: what assembly leaves between two halves


class Factored(Protocol):
    """What the factors of a symmetric matrix A are asked for, whoever made them."""

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """A⁻¹ rhs, (N,) or (N, k), real or complex."""

    def negatives(self) -> int | None:
        """Number of negative eigenvalues of a real A; None where it cannot be told."""


@dataclass(frozen=True)
class Factor:
    """A = L U of SuperLU, symmetric ordering; `solve` takes (N,) or (N, k), real or complex as
    A."""

    lu: SuperLU

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """A⁻¹ rhs."""
        return np.asarray(self.lu.solve(np.ascontiguousarray(rhs)))

    def negatives(self) -> int | None:
        """Number of negative eigenvalues of a real symmetric A by Sylvester's law of inertia; None
        where rows were exchanged."""
        if not np.array_equal(self.lu.perm_r, self.lu.perm_c):
            return None
        return int(np.sum(self.lu.U.diagonal() < 0.0))


@dataclass(frozen=True)
class OrderedFactor:
    """The same of a matrix in the order ``at``: A[at][:, at] = L U."""

    factor: Factor
    at: Index

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """A⁻¹ rhs."""
        found = self.factor.solve(rhs[self.at])
        out = np.empty_like(found)
        out[self.at] = found
        return out

    def negatives(self) -> int | None:
        """As of A."""
        return self.factor.negatives()


def factored(
    A: sp.sparray,
    what: str = "the matrix",
    pivot: bool = False,
    again: bool = False,
    instead_of: PardisoFactor | None = None,
) -> Factored:
    """Factors of a symmetric A (N, N): MKL Pardiso's where it is real and large and the extra
    ``fast`` is installed, else SuperLU's; either way the same answers.

    Pardiso pivots by itself (1 × 1 and 2 × 2, within the blocks of its elimination tree), so
    ``pivot`` is for SuperLU. Where that does not do, and on singular matrices, SuperLU is asked.
    ``again``: matrices of this pattern are factored many times, so its order is kept
    (`cvxupdate.fe.orders`). ``instead_of``: factors that nobody needs any more; where A has their
    pattern, their order and memory are used.

    Raises
    ------
    ModelError
        As `factorise`.
    """
    matrix = sp.csc_array(A)
    pardiso = library() if matrix.shape[0] > LARGE else None
    if pardiso is not None and not np.iscomplexobj(matrix.data) and _symmetric(matrix):
        try:
            if instead_of is not None and instead_of.taken_over(matrix):
                return instead_of
            return PardisoFactor(matrix, pardiso)
        except Perturbed:
            pass
    order = order_of(matrix) if again and not pivot else None
    if order is None:
        return factorise(matrix, what, pivot)
    try:
        return OrderedFactor(Factor(order.factors(matrix)), order.at)
    except RuntimeError as error:
        raise ModelError(SINGULAR.format(what)) from error


def _symmetric(A: sp.csc_array) -> bool:
    apart = abs(A - A.T)
    return bool(apart.max() <= SYMMETRIC * np.abs(A.data).max(initial=0.0))


def factorise(
    A: sp.sparray, what: str = "the matrix", pivot: bool = False, ordered: bool = False
) -> Factor:
    """SuperLU's factors, for callers that look into them or keep their order: a fill-reducing
    symmetric ordering; pivots stay on the diagonal unless ``pivot`` (for saddle-point matrices).

    ``ordered``: A has its fill-reducing order already (the argsort of ``perm_c`` of a matrix of the
    same pattern).

    Raises
    ------
    ModelError
        When A is singular; the message says ``what`` it was.
    """
    try:
        order = "NATURAL" if ordered else "MMD_AT_PLUS_A"
        lu = splu(
            sp.csc_array(A),
            permc_spec=order,
            diag_pivot_thresh=0.1 if pivot else 0.0,
            options={"SymmetricMode": not pivot},
        )
    except RuntimeError as error:
        raise ModelError(SINGULAR.format(what)) from error
    return Factor(lu)
