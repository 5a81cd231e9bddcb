"""Natural modes of a structure that has changed a little since its modes were known.

One factorisation of K, and Rayleigh–Ritz in a space that grows from the modes before
(`cvxupdate.fe.subspace`). The factors stay: sensitivities of the shapes are solved with them
(`cvxupdate.residual.nelson`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.factor import Factored, factored
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.subspace import lowest_modes

STEPS = 40  # blocks solved for, after which the modes are sought from nothing
EXACT = 1e-7
"""Estimated sine of the angle between a mode and what is found of it; what it really is was 10 to
100 times less on the models of problems/real/smu-modal-data."""


@dataclass(frozen=True)
class Continued:
    """``modes`` of which the first ``exact`` have converged (the others are Ritz vectors), the
    ``factor`` of K, and M without stored zeros."""

    modes: Modes
    exact: int
    factor: Factored
    mass: sp.csc_array


def continued_modes(
    m: Matrices, before: Modes, wanted: int, accuracy: float = EXACT
) -> Continued | None:
    """As many modes as ``before`` has, the lowest ``wanted`` of them to ``accuracy`` (sine of an
    angle; eigenvalues to its square).

    None where they have to be sought from nothing: rigid-body modes, or no convergence. A mode that
    ``before`` does not contain may be missed; the Sturm count of `cvxupdate.fe.modes` tells.

    Raises
    ------
    ModelError
        When K is not positive definite although nothing was rigid before: a mechanism, or negative
        stiffness.
    """
    if before.rigid or not 0 < wanted <= len(before.eigenvalues):
        return None
    factor = factored(m.K, "the stiffness matrix", again=True)
    if factor.negatives() != 0:  # None: rows were exchanged, for a pivot was zero
        raise ModelError(
            "the stiffness matrix is not positive definite: a stiffness parameter has gone too "
            "far. Bound it from below."
        )
    M = m.M.copy()
    M.eliminate_zeros()  # K and M share a pattern, and M may be far emptier
    found = lowest_modes(factor.solve, M.__matmul__, before.shapes, wanted, accuracy, STEPS)
    if found is None:
        return None
    values, shapes = found
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    return Continued(Modes(values, shapes * np.where(largest < 0, -1.0, 1.0), 0), wanted, factor, M)
