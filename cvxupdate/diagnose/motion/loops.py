"""What the loops of force over motion say by themselves, whatever law is laid through them."""

from __future__ import annotations

import numpy as np
from scipy.signal import find_peaks

from cvxupdate.diagnose.motion.component import Law, Rig, centre
from cvxupdate.diagnose.responses.signals import Real


def travels(r: Rig, law: Law) -> Real:
    """(reversals,): how far the part moves after each reversal until half of the friction acts the
    other way, m; between samples by interpolation. Reversals from which it does not go so far, or
    turns back before, say nothing."""
    half, force = 0.5 * law.at(r.level)[2], r.force - centre(r, law)
    turns = [find_peaks(side * r.x, prominence=law.travel)[0] for side in (1.0, -1.0)]
    order = np.sort(np.concatenate(turns))
    out = []
    for at, end in zip(order, [*order[1:], len(r.x)], strict=True):
        side = -1.0 if at in turns[0] else 1.0
        beyond = np.flatnonzero(side * force[at:end] >= half)
        if half <= 0.0 or not len(beyond) or beyond[0] == 0:
            continue
        k = at + int(beyond[0])
        before, after = side * force[k - 1], side * force[k]
        part = (half - before) / max(after - before, 1e-300)
        there = r.x[k - 1] + part * (r.x[k] - r.x[k - 1])
        out.append(abs(float(there - r.x[at])))
    return np.array(out)
