"""Measured modes that are none of the model's: an in-plane mode in the table of a plate's bending,
a torsional one in that of a plane beam, two modes taken for one.

Such a row is paired with the mode that is left, half the frequency away, and no effect explains
it. Where its shape is that of no mode, and all the others are explained without it, it is left out
and said to be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.correlate.mac import mac
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.shape_gradients import ShapeRow

# MAC with every mode of the model below which a shape is that of none, and that which the rest have
# at least with theirs (usual in practice: above 0.9 the same mode, below 0.6 a doubtful pair); part
# of the rows that may be so.
NONE, SOUND, FEW = 0.6, 0.9, 0.2


def foreign(point: ModalPoint) -> dict[int, list[tuple[int, float]]]:
    """Of each table to fit the rows with the shape of no mode but those that other rows have, with
    their best MAC: few beside those that have a mode each; nothing where there are more."""
    found: dict[int, list[tuple[int, float]]] = {}
    shapes = point.compared_shapes()
    for k in {s.table for s in shapes}:
        best = _best(point, [s for s in shapes if s.table == k])
        if any(NONE <= value < SOUND for value in best.values()):
            return {}
        odd = [(i, value) for i, value in best.items() if value < NONE]
        if odd:
            found[k] = odd
    return found if sum(map(len, found.values())) <= FEW * len(shapes) else {}


def _best(point: ModalPoint, rows: Sequence[ShapeRow]) -> dict[int, float]:
    """Of each row, by its number, the best MAC with a mode that none has whose shape is clearer."""
    likeness = [
        mac(point.modes.shapes[s.sensors], np.asarray(s.measured)[:, None])[:, 0] for s in rows
    ]
    out: dict[int, float] = {}
    taken: list[int] = []
    for n in sorted(range(len(rows)), key=lambda n: -float(np.max(likeness[n]))):
        own = likeness[n].copy()
        own[taken] = 0.0
        out[rows[n].mode] = float(np.max(own))
        if out[rows[n].mode] >= SOUND:
            taken.append(int(np.argmax(own)))
    return out


def was_there(table: ModeTable, row: int, before: Sequence[ModeTable]) -> bool:
    """Whether one of the tables ``before`` has a mode with the shape of a row, at the sensors that
    both have, and no other row with that shape is nearer to it: what hangs from a structure makes
    two modes of one."""
    if table.shapes is None:
        return False
    own = {c.label: i for i, c in enumerate(table.channels)}
    for other in before:
        known = {c.label: i for i, c in enumerate(other.channels)}
        both = [label for label in own if label in known]
        if other.shapes is None or len(both) < 2:
            continue
        theirs = other.shapes[:, [known[label] for label in both]]
        mine = table.shapes[:, [own[label] for label in both]]
        if not np.all(np.isfinite(mine[row])):
            continue
        told = np.flatnonzero(np.all(np.isfinite(mine), axis=1))
        whole = np.flatnonzero(np.all(np.isfinite(theirs), axis=1))
        alike = mac(theirs[whole].T, mine[told].T) >= SOUND
        apart = np.abs(np.log(other.frequency[whole][:, None] / table.frequency[told]))
        nearest = np.argmin(np.where(alike, apart, np.inf), axis=1)
        if np.any(alike.any(axis=1) & (told[nearest] == row)):
            return True
    return False


def without(table: ModeTable, rows: Sequence[int]) -> ModeTable | None:
    """A table without some rows; None where their errors are correlated."""
    if table.covariance is not None:
        return None
    kept = np.setdiff1d(np.arange(len(table.frequency)), np.array(rows, dtype=np.int64))
    spread = table.shape_std
    if spread is not None and table.shapes is not None and spread.shape == table.shapes.shape:
        spread = spread[kept]
    return replace(
        table,
        frequency=table.frequency[kept],
        frequency_std=table.frequency_std[kept],
        damping=table.damping[kept],
        damping_std=table.damping_std[kept],
        shapes=None if table.shapes is None else table.shapes[kept],
        shape_std=spread,
        pairs=table.pairs[kept],
    )


def line(table: ModeTable, row: int, value: float) -> str:
    """One left out, in words."""
    return (
        f"The mode at {table.frequency[row]:.4g} Hz was left out: its shape is that of no "
        f"further mode of the model (MAC {value:.2f} at most), while all others are explained. "
        "It may move in directions that the model does not have."
    )
