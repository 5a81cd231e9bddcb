"""What fitted explanations foretell of responses that were not measured."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.reduction.sensors import qr_places


def foretold(point: ResponsePoint, signal: Signal) -> tuple[Complex, Complex]:
    """Responses (lines, sensors) and their derivatives (lines, sensors, unknowns) at a point."""
    there = ResponsePoint(point.setting.on([signal]), point.p, point.found, point.owner)
    Y = there.modelled()[0][:, :, 0]
    # its rows: real parts, then imaginary parts, points before sensors
    J = there.jacobian()
    half = len(J) // 2
    return Y, (J[:half] + 1j * J[half:]).reshape(*Y.shape, J.shape[1])


def diverse(shapes: Real, places: np.ndarray, most: int) -> list[int]:
    """Places whose motion is most unlike in these modes."""
    if len(places) <= most:
        return [int(i) for i in places]
    first = list(qr_places(shapes[:, :most], min(most, shapes.shape[1]), places))
    rest = [int(i) for i in places if i not in set(first)]
    step = max(1, len(rest) // max(1, most - len(first)))
    return [*(int(i) for i in first), *rest[::step]][:most]
