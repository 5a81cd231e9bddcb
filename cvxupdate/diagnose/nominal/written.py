"""What of the theory that was fitted a problem file has words for."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cvxupdate.diagnose.nominal.scatter import scatter_of
from cvxupdate.diagnose.nominal.theory import (
    ASIDE,
    BODY,
    CLAMP,
    CORNER,
    GROUP,
    POINT,
    ROTARY,
    SHEAR,
)
from cvxupdate.diagnose.settings import WRITTEN
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.analysis.solid import LAG, TURNING
from cvxupdate.fe.model import Model
from cvxupdate.physics.units import number

SHEETS = {LAG: "Shear", TURNING: "Rotary inertia"}
WORDS = {
    CORNER: "Members were fitted as stiffer where they meet",
    CLAMP: "Clamped edges were fitted as holding from before their line on",
}


def sayable(model: Model, p: Real) -> tuple[Model, Real, list[str]]:
    """The model with the parameters that a file has words for, their values (columns,), and what it
    has none for: of theory it has shear, springs under points, bodies for lumps, and rotary
    inertia wholly or not at all."""
    own: list[int] = []
    values, notes, aside = p[: len(model.parameters)].copy(), list[str](), False
    for j, q in enumerate(model.parameters):
        size = float(values[j])
        if q.group == ASIDE:  # it changes no matrix
            aside |= abs(size) > scatter_of(q)
            continue
        if q.group != GROUP or q.of in (POINT, BODY) or (q.of == SHEAR and size >= WRITTEN):
            own.append(j)
        elif q.of == ROTARY:
            own.append(j)
            values[j] = np.round(size)
            if abs(size - values[j]) > WRITTEN:
                notes.append(_turning(size - q.lower, values[j] - q.lower))
        elif abs(size) > WRITTEN and q.of in WORDS:
            notes.append(f"{WORDS[q.of]}, for which this file has no word: its error is larger.")
    if aside:
        notes.append(
            "Forces or sensors were fitted as more than usually beside their nodes, for which this "
            "file has no word: its error is larger."
        )
    return model.with_parameters(tuple(model.parameters[j] for j in own)), values[own], notes


def solid_of(model: Model, p: Real) -> tuple[bool | Literal["sheared", "turning"], list[str]]:
    """What [model] ``solid`` says of sheets that were fitted with parts of their theory, and what
    it cannot."""
    has, notes = {LAG: True, TURNING: True}, list[str]()
    for q, size in zip(model.parameters, p, strict=False):
        if q.group == GROUP and q.of in has:
            share = float(size) - q.lower
            has[q.of] = share > 0.5
            if abs(share - has[q.of]) > WRITTEN:
                whole = "all" if has[q.of] else "none"
                notes.append(
                    f"{SHEETS[q.of]} of sheets was fitted as {number(share, 2)} of what solids "
                    f"have; this file has {whole} of it, so its error is larger than the diagnosis "
                    "says."
                )
    if has[LAG] == has[TURNING]:
        return has[LAG], notes
    return ("sheared" if has[LAG] else "turning"), notes


def _turning(fitted: float, written: float) -> str:
    whole = "all" if written > 0.5 else "none"
    return (
        f"Rotary inertia was fitted as {number(fitted, 2)} of what sections have; this file has "
        f"{whole} of it, so its error is larger than the diagnosis says."
    )
