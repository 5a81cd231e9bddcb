"""How far entries of shapes may be off: modes that are close to one another are turned into each
other, by what a sound model misses and by identification; sensors stand beside their nodes."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.settings import BESIDE, FREQUENCY_DISCREPANCY
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Channel, ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.shape_rows import channel_rows


def mixed(
    point: ModalPoint, k: int, table: ModeTable, missed: float = FREQUENCY_DISCREPANCY
) -> Real:
    """Deviation that each entry of the shapes of a table (all frequencies with deviations) has by
    it, (modes, channels), as large as the measured shape is.

    What a model misses of a frequency (``missed``, relative; beside a reference what a test
    repeated would) it misses between modes as well, and noise that moves an identified frequency
    acts between modes, too: ε λ of the eigenvalue problem,
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


def off_nodes(point: ModalPoint, k: int, table: ModeTable) -> Real:
    """What `BESIDE` of way between sensor and node makes of each entry of the shapes of a table,
    (modes, channels), by the slope of the mode that each is paired with, as large as the measured
    shape is."""
    model, shapes = point.residual.model, table.shapes
    out = np.zeros((len(table.frequency), len(table.channels)))
    if shapes is None:
        return out
    rows, turns = channel_rows(table, model), [slopes_of(model, c) for c in table.channels]
    for i, at in enumerate(point.places[k].tolist()):
        own = np.append(point.modes.shapes[:, at], 0.0)
        largest = np.max(np.abs(own[rows]), initial=0.0)
        if at >= 0 and largest > 0.0:
            slope = np.array([np.linalg.norm(own[t]) for t in turns])
            out[i] = BESIDE * slope * np.nanmax(np.abs(shapes[i]), initial=0.0) / largest
    return out


def slopes_of(model: Model, channel: Channel) -> list[int]:
    """Rows of the rotations that move what a translation reads where it stands beside its node."""
    axes = [f"r{axis}" for axis in "xyz" if axis != channel.dof]
    labels = [f"n{channel.node}.{a}" for a in axes] if channel.dof in ("x", "y", "z") else []
    return [model.place[label] for label in labels if label in model.place]


def _measured(point: ModalPoint) -> Real:
    """The eigenvalue that was measured of each mode of the model, NaN where none was."""
    out = np.full(len(point.modes.eigenvalues), np.nan)
    tables = (*point.residual.fit, *point.residual.hold_out)
    for table, places in zip(tables, point.places, strict=True):
        there = places >= 0
        out[places[there]] = (2.0 * np.pi * table.frequency[there]) ** 2
    return out
