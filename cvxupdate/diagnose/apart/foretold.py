"""What fitted explanations foretell of responses that were not measured, with a known mass on them
where that is asked."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.apart.known_mass import with_lump
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
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


def loaded(
    evidence: ResponseEvidence, h: Hypothesis, root: Real, node: int, mass: float
) -> tuple[ResponsePoint, Real]:
    """A fitted hypothesis with a known mass on a node, and the root of its unknowns' covariance."""
    setting, p = h.fit.setting, h.fit.p
    n = len(setting.model.parameters)
    grown = with_lump(evidence, setting.model, node)
    unit = grown.parameters[-1].unit_size
    again = evidence.setting(grown, setting.faults, None)
    own = min(setting.damped, again.damped)
    tail = len(setting.faults)
    q, wide = np.zeros(len(again.columns)), np.zeros((len(again.columns), root.shape[1]))
    pairs = [
        (slice(0, n), slice(0, n)),
        (slice(n, setting.ratios.start + own), slice(n + 1, again.ratios.start + own)),
        (slice(len(p) - tail, len(p)), slice(len(q) - tail, len(q))),
    ]
    for old, new in pairs:
        q[new], wide[new] = p[old], root[old]
    q[n] = mass / unit
    return again.evaluate(q), wide
