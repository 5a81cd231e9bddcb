"""The lowest modes of a model, and Rayleigh and Ritz's modes of a space of shapes (Bathe 1996,
11.6)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.modes import Modes, natural_modes

WHOLE = 100  # DOFs up to which every mode is taken


def ritz(V: Real, K: sp.csc_array, M: sp.csc_array) -> Real | None:
    """Columns that span the same as V (n, r), orthonormal in M and apart in K, the softest first;
    None where some of V are alike to rounding, or have no mass."""
    stiff, massive = V.T @ (K @ V), V.T @ (M @ V)
    try:
        _, X = la.eigh((stiff + stiff.T) / 2.0, (massive + massive.T) / 2.0)
    except la.LinAlgError:
        return None
    return np.asarray(V @ X)


def modes_up_to(K: sp.csc_array, M: sp.csc_array, top: float, rigid: Real) -> Modes:
    """Every mode up to ``top`` (Hz) at least; ``rigid`` (N, k): rigid-body motions."""
    count = K.shape[0] if K.shape[0] <= WHOLE else 40
    while True:
        modes = natural_modes(K, M, min(count, K.shape[0]), rigid)
        if count >= K.shape[0] or (len(modes.frequencies) and modes.frequencies[-1] > top):
            return modes
        count *= 2
