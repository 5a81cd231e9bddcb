"""Residual attachment modes: what the lowest modes lack of the static response to a force where a
local effect acts (Craig and Bampton 1968; Ewins 2000, 6.4).

A support that gives way turns a clamped end: no number of the clamped structure's own modes shows
that soon, and sizes sought among them are too large. With the response to the effect's own force
beside them, the change is exact in statics and as good as the modes above.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.linalg as la

from cvxupdate.diagnose.types import Real
from cvxupdate.fe.factor import factored
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.low_rank import directions

SHIFT = 0.01  # of the lowest flexible eigenvalue, where the structure is free
APART = 1e-10  # of the largest: columns that are dependent by rounding
NOTHING = 1e-8  # of a force's flexibility: the modes have all of it, and the rest is rounding
FAR = 1e3  # times the highest eigenvalue: a column that is not there


def attachments(
    m: Matrices, modes: Modes, count: int, effects: Sequence[Effect]
) -> tuple[Real, Real]:
    """(shapes (n, N, r), eigenvalues (n, r)) of each effect, mass-normalised, orthogonal in K and M
    to one another and to the first ``count`` of ``modes``; zeros where there are fewer."""
    size, lowest = len(modes.shapes), modes.eigenvalues[modes.rigid :]
    shift = SHIFT * float(lowest[0]) if modes.rigid and len(lowest) else 0.0
    places, columns = [0], [np.zeros((size, 0))]
    for effect in effects:
        acts = directions(effect)
        force = np.zeros((size, 0 if acts is None else acts[1].shape[1]))
        if acts is not None:
            force[acts[0]] = acts[1]
        columns.append(force)
        places.append(places[-1] + force.shape[1])
    forces = np.hstack(columns)
    widest = max((b - a for a, b in pairwise(places)), default=0)
    shapes = np.zeros((len(effects), size, widest))
    values = np.full((len(effects), widest), FAR * float(modes.eigenvalues[-1]))
    if not forces.shape[1]:
        return shapes, values
    phi, stiff = modes.shapes[:, :count], modes.eigenvalues[:count] + shift
    static = factored((m.K + shift * m.M).tocsc()).solve(forces)
    whole = np.sum(forces * static, axis=0)
    static = static - phi @ ((phi.T @ forces) / stiff[:, None])
    static[:, np.sum(forces * static, axis=0) <= NOTHING * whole] = 0.0
    for k, (a, b) in enumerate(pairwise(places)):
        own = _independent(static[:, a:b], m)
        lam, turn = la.eigh(own.T @ (m.K @ own)) if own.shape[1] else (np.zeros(0), own[:0])
        shapes[k, :, : own.shape[1]] = own @ turn if own.shape[1] else 0.0
        values[k, : own.shape[1]] = lam
    return shapes, values


def _independent(X: Real, m: Matrices) -> Real:
    """Columns that span the same, orthonormal in M, rounding left out."""
    if not X.shape[1]:
        return X
    values, vectors = la.eigh(X.T @ (m.M @ X))
    kept = values > APART * max(float(values[-1]), 1e-300)
    return np.asarray(X @ (vectors[:, kept] / np.sqrt(values[kept])))
