"""Rayleigh and Ritz's modes of a space of shapes (Bathe 1996, 11.6)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.elements.base import Real


def ritz(V: Real, K: sp.csc_array, M: sp.csc_array) -> Real | None:
    """Columns that span the same as V (n, r), orthonormal in M and apart in K, the softest first;
    None where some of V are alike to rounding, or have no mass."""
    stiff, massive = V.T @ (K @ V), V.T @ (M @ V)
    try:
        _, X = la.eigh((stiff + stiff.T) / 2.0, (massive + massive.T) / 2.0)
    except la.LinAlgError:
        return None
    return np.asarray(V @ X)
