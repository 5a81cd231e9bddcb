"""Modes followed from one parameter vector to the next."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linear_sum_assignment

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.modes import Modes

STILL = 1e-12
"""Likeness of shapes that move no node, which only their eigenvalues tell apart."""
OCTAVE = np.log(4.0)
"""Of eigenvalues, four times: how far a mode of exact members may go in one step and still count
as near. Modes of a member that look alike on its end nodes are farther apart, and trust regions
refuse steps that large."""


def follow(
    shapes: Real,
    M: sp.csc_array,
    modes: Modes,
    taken: Index | None = None,
    before: Real | None = None,
) -> Index:
    """Where earlier mass-normalised ``shapes`` (N, m) went among ``modes``: the assignment of
    largest Σ (φᵀ M φ')², (m,).

    Modes that cross keep their identity, because the shapes of one structure stay orthogonal in its
    mass matrix. Modes ``taken`` are left out. On the few nodes of exact members, which have more
    modes than DOFs, different modes look alike: then the eigenvalues ``before`` (m,) count too.

    Raises
    ------
    ModelError
        When fewer modes are left than there are shapes (a mass has vanished).
    """
    free = np.setdiff1d(np.arange(len(modes.eigenvalues)), [] if taken is None else taken)
    if len(free) < shapes.shape[1]:
        raise ModelError(
            f"the model has only {len(free)} modes left for the {shapes.shape[1]} that are "
            "followed: a mass has vanished. Bound it from below."
        )
    likeness = (shapes.T @ (M @ modes.shapes[:, free])) ** 2
    if before is not None:
        size, own = (np.einsum("ij,ij->j", x, M @ x) for x in (shapes, modes.shapes[:, free]))
        scale = np.outer(size, own)
        moving = scale > STILL * np.max(scale, initial=0.0)
        likeness = np.divide(likeness, scale, out=np.zeros_like(scale), where=moving) + STILL
        likeness *= _near(before, modes.eigenvalues[free])
    rows, columns = linear_sum_assignment(likeness, maximize=True)
    return np.asarray(free[columns[np.argsort(rows)]], dtype=np.int64)


def _near(before: Real, now: Real) -> Real:
    """(m, n): 1 where an eigenvalue is as it was, e^−½ at an octave of frequency."""
    every = np.concatenate([before, now])
    floor = 1e-6 * float(np.min(every[every > 0.0], initial=1.0))
    apart = np.log((np.maximum(now, 0.0) + floor) / (np.maximum(before, 0.0)[:, None] + floor))
    return np.asarray(np.exp(-0.5 * (apart / OCTAVE) ** 2))
