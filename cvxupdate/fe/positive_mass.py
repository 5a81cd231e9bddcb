"""A mass matrix that no motion makes negative."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dpotrf

from cvxupdate.errors import ModelError
from cvxupdate.fe.factor import factored


def check_mass(M: sp.csc_array, dense: int) -> None:
    """M is positive semidefinite: Cholesky up to ``dense`` DOFs, else the signs of the pivots, in
    units of its diagonal.

    Raises
    ------
    ModelError
        When it has a negative eigenvalue.
    """
    d = M.diagonal()
    remedy = "A mass parameter has gone too far: set its lower bound."
    if np.any(d < 0.0):
        raise ModelError(
            f"the mass matrix has a negative diagonal entry ({d.min():.3g} at DOF number "
            f"{int(np.argmin(d))}). {remedy}"
        )
    scale = 1.0 / np.sqrt(np.where(d > 0.0, d, 1.0))
    if M.shape[0] > dense:
        factors = sp.diags_array(scale)
        negative = bool(
            factored(
                sp.csc_array(factors @ M @ factors + 1e-9 * sp.eye_array(M.shape[0])),
                "the mass matrix",
            ).negatives()
        )
    else:
        whole = scale[:, None] * M.toarray() * scale + 1e-9 * np.eye(M.shape[0])
        negative = dpotrf(whole, lower=1, clean=0)[1] > 0
    if negative:
        raise ModelError(f"the mass matrix has a negative eigenvalue. {remedy}")
