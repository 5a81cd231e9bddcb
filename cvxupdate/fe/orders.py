"""Fill-reducing orders of patterns that are factored again and again: a loop asks for the factors
of K(p), or of K − λM, at every point, and two fifths of the time of each would go into the same
order."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import SuperLU, splu

from cvxupdate.fe.block import Index

KEPT = 4  # patterns: those of one model's K and of what is held of it
SMALL = 20_000
"""DOFs up to which orders are kept: above, the order is a small part of the time, and the pattern
much memory."""
NARROW = 1  # columns of a relaxed supernode: its zeros cost more than they save at these sizes


@dataclass(frozen=True)
class Order:
    """A pattern (``indptr``, ``indices`` of a CSC matrix (N, N)) and its fill-reducing symmetric
    order ``at``: column k of the ordered matrix is column at[k]; ``data`` gathers its entries."""

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    at: Index
    data: Index
    ordered: sp.csc_array

    def fits(self, A: sp.csc_array) -> bool:
        """Whether A has this pattern."""
        return (
            len(A.indices) == len(self.indices)
            and np.array_equal(A.indptr, self.indptr)
            and np.array_equal(A.indices, self.indices)
        )

    def factors(self, A: sp.csc_array) -> SuperLU:
        """SuperLU's factors of the ordered A; RuntimeError where a pivot is zero."""
        rows = self.ordered
        return splu(
            sp.csc_array((A.data[self.data], rows.indices, rows.indptr), shape=A.shape),
            permc_spec="NATURAL",
            diag_pivot_thresh=0.0,
            relax=NARROW,
            options={"SymmetricMode": True},
        )


_KNOWN: OrderedDict[int, Order] = OrderedDict()


def order_of(A: sp.csc_array) -> Order | None:
    """The order of A's pattern (symmetric), None for large A.

    It depends on the pattern alone, not on what was asked before or on A's values.
    """
    if A.shape[0] > SMALL:
        return None
    for key, known in _KNOWN.items():
        if known.fits(A):
            _KNOWN.move_to_end(key)
            return known
    found = _found(A)
    _KNOWN[id(found)] = found
    if len(_KNOWN) > KEPT:
        _KNOWN.popitem(last=False)
    return found


def _found(A: sp.csc_array) -> Order:
    """SuperLU gives its order with the factors only: those of a matrix of the same pattern that is
    diagonally dominant, so that it has them."""
    count = len(A.indices)
    pattern = sp.csc_array((np.full(count, -1.0), A.indices, A.indptr), shape=A.shape)
    lu = splu(
        sp.csc_array(pattern + sp.diags_array(np.diff(A.indptr) + 1.0)),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    at = np.argsort(lu.perm_c)
    numbers = np.arange(1, count + 1, dtype=np.int64)  # no entry may be a zero
    numbered = sp.csc_array((numbers, A.indices, A.indptr), shape=A.shape)
    ordered = sp.csc_array(numbered[at][:, at])
    ordered.sort_indices()
    data = np.asarray(ordered.data - 1, dtype=np.int64)
    return Order(A.indptr.copy(), A.indices.copy(), at, data, ordered)
