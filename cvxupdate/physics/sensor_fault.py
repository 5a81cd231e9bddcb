"""``sensor_fault``: a channel with a wrong gain, sign or delay, or two channels exchanged: the
measurement, not the structure.

A sign is a gain of −1. An exchange has no size of its own: its ``gain`` is the share of the other
channel's motion that each reads, 1 for a true exchange; a fit that drives it away from 1 says that
the channels were not exchanged (`EXCHANGED` is how near it must end).
"""

from __future__ import annotations

import itertools

import numpy as np

from cvxupdate.physics.base import Candidate, Context, Place, given

# of channels tried for an exchange; beyond, only those at one node and neighbours in the recording
MOST_PAIRS = 500
EXCHANGED = 0.1  # largest departure of an exchange's ``gain`` from 1


def candidates(context: Context) -> list[Candidate]:
    """Gains, delays and exchanges; tell-tale: one or two channels are off at all frequencies, the
    others are not."""
    return faults(context) + swaps(context)


def faults(context: Context) -> list[Candidate]:
    """A gain (sign included) and a delay for every channel."""
    out = []
    for label in context.sensors:
        node, dof = _place(label)
        for how in ("gain", "delay"):
            out.append(
                Candidate(
                    "sensor_fault",
                    Place(nodes=(node,), dof=dof),
                    given(context.model),
                    1,
                    np.zeros(1),
                    channel=label,
                    sensor=how,
                    report=((how, 0, how),),
                )
            )
    return out


def swaps(context: Context) -> list[Candidate]:
    """Every pair of channels exchanged (``channel`` and ``other``)."""
    labels = context.sensors
    pairs = list(itertools.combinations(range(len(labels)), 2))
    if len(pairs) > MOST_PAIRS:
        pairs = [
            (a, b) for a, b in pairs if b == a + 1 or _place(labels[a])[0] == _place(labels[b])[0]
        ]
    out = []
    for a, b in pairs:
        (first, kind), (second, other) = _place(labels[a]), _place(labels[b])
        place = Place(
            nodes=(first, second) if first != second else (first,),
            dof=kind if kind == other else None,
        )
        out.append(
            Candidate(
                "sensor_fault",
                place,
                given(context.model),
                1,
                np.zeros(1),
                channel=labels[a],
                sensor="swap",
                other=labels[b],
                report=(("gain", 0, "gain"),),
            )
        )
    return out


def _place(label: str) -> tuple[int, str]:
    node, _, dof = label.partition(".")
    return int(node[1:]), dof
