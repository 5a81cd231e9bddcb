"""``sensor_fault``: a channel with a wrong gain, sign or delay: the measurement, not the structure."""

from __future__ import annotations

import numpy as np

from cvxupdate.physics.base import Candidate, Context, Place


def candidates(context: Context) -> list[Candidate]:
    """A gain (sign included) and a delay for every channel; tell-tale: one channel is off at all frequencies, the others are not."""
    out = []
    for label in context.sensors:
        node, _, dof = label.partition(".")
        for how, name in (("gain", "gain"), ("delay", "delay")):
            out.append(Candidate("sensor_fault", Place(nodes=(int(node[1:]),), dof=dof), context.model, 1, np.zeros(1), channel=label, sensor=how,
                                 report=((name, 0, how),)))
    return out
