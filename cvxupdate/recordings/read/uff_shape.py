"""Universal data set 55: data at nodes, here mode shapes."""

from __future__ import annotations

import math

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Shape
from cvxupdate.recordings.read.uff_fields import QUANTITY, Units, fields, integer, real

_TEN, _THIRTEEN = (10,) * 8, (13,) * 6


def read_shape(text: str, units: Units) -> Shape:
    """A normal mode (analysis 2) or a complex one (3 by displacement, 7 by velocity); others raise
    `RecordingError`.

    The frequency of a complex mode is |λ| / 2π and its damping -Re λ / |λ| (λ in rad/s).
    """
    lines = text.splitlines()
    if len(lines) < 8:
        raise RecordingError("its header is cut short")
    _, analysis, _, specific, data_type, per_node = (
        integer(word, name)
        for word, name in zip(
            fields(lines[5], _TEN)[:6],
            (
                "the model type",
                "the analysis type",
                "the data characteristic",
                "the specific data type",
                "the data type",
                "the number of values per node",
            ),
            strict=True,
        )
    )
    if analysis not in (2, 3, 7):
        raise RecordingError(f"analysis type {analysis} is not a mode")
    if data_type not in (2, 5) or per_node not in (3, 6):
        raise RecordingError(
            f"data type {data_type} with {per_node} values per node is not a shape"
        )
    numbers = [real(word, "record 8") for word in fields(lines[7], _THIRTEEN) if word]
    if analysis == 2:
        frequency = numbers[0]
        viscous, hysteretic = (*numbers[2:4], 0.0, 0.0)[:2]
        damping = viscous or hysteretic / 2.0 or math.nan
    else:
        pole = complex(*numbers[:2])
        frequency = abs(pole) / (2.0 * math.pi)
        damping = -pole.real / abs(pole) if abs(pole) > 0.0 else math.nan
    if not frequency >= 0.0:
        raise RecordingError(f"its frequency is {frequency} Hz")
    wanted = per_node * (2 if data_type == 5 else 1)
    nodes: list[int] = []
    rows: list[list[float]] = []
    for line in lines[8:]:
        if not line.strip():
            continue
        if not rows or len(rows[-1]) == wanted:
            nodes.append(integer(line[:10].strip(), "a node"))
            rows.append([])
            continue
        rows[-1].extend(real(word, "a value") for word in fields(line.rstrip(), _THIRTEEN) if word)
    if not rows or len(rows[-1]) != wanted or any(len(row) != wanted for row in rows):
        raise RecordingError("the last node does not have all its values")
    values = np.array(rows)
    if data_type == 5:
        values = values[:, 0::2] + 1j * values[:, 1::2]
    quantity = QUANTITY.get(specific, "displacement")
    scale = np.array([units.scale(quantity, rotation=axis >= 3) for axis in range(per_node)])
    return Shape(frequency, damping, np.array(nodes, dtype=np.int64), values * scale, quantity)
