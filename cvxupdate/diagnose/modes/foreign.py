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
from numpy.typing import NDArray

from cvxupdate.correlate.mac import mac
from cvxupdate.diagnose.types import Real
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint

# MAC with every mode of the model below which a shape is that of none, and that which the rest have
# at least with theirs (usual in practice: above 0.9 the same mode, below 0.6 a doubtful pair); part
# of the rows that may be so.
NONE, SOUND, FEW = 0.6, 0.9, 0.2


def foreign(point: ModalPoint) -> dict[int, list[tuple[int, float]]]:
    """Of each table to fit the rows with the shape of no mode, with their best MAC: few beside
    those that have a mode each; nothing where there are more."""
    found: dict[int, list[tuple[int, float]]] = {}
    best = [(s.table, s.mode, _best(point, s.sensors, s.measured)) for s in point.compared_shapes()]
    odd = [(k, i, value) for k, i, value in best if value < NONE]
    if not odd or len(odd) > FEW * len(best) or any(NONE <= v < SOUND for *_, v in best):
        return {}
    for k, i, value in odd:
        found.setdefault(k, []).append((i, value))
    return found


def _best(point: ModalPoint, sensors: NDArray[np.int64], measured: Real) -> float:
    return float(np.max(mac(point.modes.shapes[sensors], np.asarray(measured)[:, None])))


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
        f"The mode at {table.frequency[row]:.4g} Hz was left out: its shape is that of no mode of "
        f"the model (MAC {value:.2f} at most), while all others are explained. It may move in "
        "directions that the model does not have."
    )
