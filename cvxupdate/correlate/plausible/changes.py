"""Units that a recording may be in without its saying so: one factor, one power of the frequency,
one factor on the frequency axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.measured import MOTION


@dataclass(frozen=True)
class Change:
    """What was recorded is ``factor`` · s^``power`` times what the problem file says, at ``axis``
    times the frequency; ``asks`` is the question to its author."""

    asks: str
    factor: float = 1.0
    power: int = 0
    axis: float = 1.0


NONE = Change("")
G, INCH, FOOT, POUND = 9.80665, 0.0254, 0.3048, 4.4482216

AXES = {
    "frf": (
        Change("is the frequency axis in kHz?", axis=1e3),
        Change("is the frequency axis in rad/s?", axis=1.0 / (2.0 * np.pi)),
        Change("is the frequency axis in revolutions per minute?", axis=1.0 / 60.0),
    ),
    "time": (
        Change("is the rate in kHz, or the time in ms?", axis=1e3),
        Change("is the time in μs?", axis=1e6),
    ),
    "modes": (
        Change("are the frequencies in kHz?", axis=1e3),
        Change("are the frequencies in rad/s?", axis=1.0 / (2.0 * np.pi)),
        Change("are the frequencies in revolutions per minute?", axis=1.0 / 60.0),
    ),
}
"""By kind of recording."""


def changes_of(kind: str, quantity: str, units: frozenset[str]) -> tuple[Change, ...]:
    """Every change that is looked for in responses of ``quantity`` whose channels state
    ``units``."""
    stated = units - {"", "-"}
    length = "mm (mm/s, mm/s²)"
    out = [
        Change(f"is it in {length}, or the force in kN?", 1e3),
        Change("is it in cm, or in Gal?", 1e2),
        Change("is it in inches (in/s, in/s²)?", 1.0 / INCH),
        Change("is it in feet (ft/s, ft/s²)?", 1.0 / FOOT),
        Change("is it in μm?", 1e6),
        Change("is the force in lbf?", POUND),
        Change("is the force in kip?", 1e3 * POUND),
        Change("is the force in mN, or is the model's mass in t?", 1e-3),
    ]
    if quantity == "acceleration":
        out.append(Change("is it in g?", 1.0 / G))
    if any("g" in unit for unit in stated):
        out.append(Change(f"is it in m/s², and not in {_names(stated)}?", G))
    else:
        out.append(Change("is the force in kgf?", G))
    if stated:
        out.append(Change(f"is the unit {_names(stated)} right?", 1e-3))
    order = MOTION.index(quantity)
    out += [
        Change(f"is it {_article(MOTION[to])}, and not {_article(quantity)}?", power=to - order)
        for to in range(3)
        if to != order
    ]
    return (*out, *AXES[kind])


def _names(units: frozenset[str]) -> str:
    return ", ".join(sorted(units))


def _article(quantity: str) -> str:
    return f"an {quantity}" if quantity[0] in "aeiou" else f"a {quantity}"
