"""How far modes that are close to one another may be turned into each other: by what a sound model
misses, and by identification."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY
from cvxupdate.diagnose.types import Real
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.shape_rows import channel_rows


def mixed(
    point: ModalPoint, k: int, table: ModeTable, missed: float = FREQUENCY_DISCREPANCY
) -> Real:
    """Deviation that each entry of the shapes of a table (all frequencies with deviations) has by
    it, (modes, channels), as large as the measured shape is.

    What a model misses of a frequency (``missed``, relative) it misses between modes as well, and
    noise that moves an identified frequency acts between modes, too: ε λ of the eigenvalue problem,
    with ε twice both together. To first order that turns a mode by ε λ / |λ − λ'| towards another
    (Fox and Kapoor 1968), and into it where they are as near as that. How near two modes are is
    taken from what was measured of both, else from the model.
    """
    shapes, modes = table.shapes, point.modes
    out = np.zeros((len(table.frequency), len(table.channels)))
    if shapes is None:
        return out
    rows = channel_rows(table, point.residual.model)
    phi = np.vstack([modes.shapes, np.zeros((1, modes.shapes.shape[1]))])[rows]
    lam = np.maximum(modes.eigenvalues, 0.0)
    known = _measured(point)
    for i, at in enumerate(point.places[k].tolist()):
        largest = np.max(np.abs(phi[:, at]), initial=0.0)
        if at < modes.rigid or largest <= 0.0:
            continue
        both = np.isfinite(known) & np.isfinite(known[at])
        here, there = np.where(both, known[at], lam[at]), np.where(both, known, lam)
        gap = np.abs(here - there) / np.sqrt(np.maximum(here * there, np.finfo(float).tiny))
        noise = table.frequency_std[i] / table.frequency[i]
        turn = np.minimum(2.0 * np.hypot(missed, noise) / np.maximum(gap, 1e-12), 1.0)
        turn[: modes.rigid], turn[at] = 0.0, 0.0
        size = np.nanmax(np.abs(shapes[i]), initial=0.0) / largest
        out[i] = size * np.linalg.norm(phi * turn, axis=1)
    return out


def _measured(point: ModalPoint) -> Real:
    """The eigenvalue that was measured of each mode of the model, NaN where none was."""
    out = np.full(len(point.modes.eigenvalues), np.nan)
    tables = (*point.residual.fit, *point.residual.hold_out)
    for table, places in zip(tables, point.places, strict=True):
        there = places >= 0
        out[places[there]] = (2.0 * np.pi * table.frequency[there]) ** 2
    return out
