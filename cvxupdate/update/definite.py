"""Smallest eigenvalues of the updated matrices, computed from the matrices themselves and not from
what a solver says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from cvxupdate.convex import smallest_eigenvalue
from cvxupdate.fe.model import Model


def definiteness(model: Model, p: Sequence[float]) -> dict[str, float | None]:
    """Smallest eigenvalues of M and K at ``p``, each matrix scaled to a unit diagonal: D^-½ M D^-½,
    D = |diag|; None for parameters that are NaN.

    A value far below rounding (−1e-10) means an indefinite matrix; 0 for K is a rigid-body motion,
    for M a massless one. The scaling changes no sign (Sylvester) and makes kg and kg·m² comparable.
    """
    values = np.asarray(p, dtype=float)
    if not np.all(np.isfinite(values)):
        return {"mass_eigenvalue_min": None, "stiffness_eigenvalue_min": None}
    m = model.matrices(values)
    return {"mass_eigenvalue_min": smallest(m.M), "stiffness_eigenvalue_min": smallest(m.K)}


def smallest(matrix: Any) -> float:
    """Smallest eigenvalue of a symmetric sparse matrix scaled to a unit diagonal (a DOF with
    neither diagonal nor row is left out)."""
    sparse = sp.csc_array(matrix)
    live = np.flatnonzero(abs(sparse).sum(axis=0) > 0.0)
    if not live.size:
        return 0.0
    sparse = sparse[live][:, live]
    diagonal = np.abs(sparse.diagonal())
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    return smallest_eigenvalue(sp.csc_array(sp.diags_array(scale) @ sparse @ sp.diags_array(scale)))
