"""What does not happen to the material of a structure between two tests of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.alternatives import nodes_of
from cvxupdate.diagnose.settings import HEAVIEST, LEAST_SIZE
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import has_property

GROWS = {"stiffness_change": 1.0, "thickness_change": 1.0, "mass_change": -1.0}  # of material: sign
GROWN = {"stiffness": 1.0, "mass": -1.0}  # likewise, of a group's parameters
LUMP = "added_mass"


def unheard_of(h: Hypothesis, file: Model) -> int:
    """How many effects of a hypothesis are against nature where the structure is the one that was
    tested before: parts crack, wear thin and come loose, and masses are put on and taken off; but
    elements that are made of something grow neither stiffer nor thicker by themselves, nor lighter
    without getting softer, nor several times as heavy, and no more mass can be taken off a node
    than is drawn there (``file``: the model as it came; elements without mass, as springs, may be
    tightened). What is told by natural frequencies alone asks for it: in a slender cantilever a
    mass that is taken off near the clamp and a part that is stiffer as far from the tip shift them
    alike."""
    if not h.effects:
        return int(_grown(h, file))
    return sum(_is(h, k, file) for k in range(len(h.effects)))


def _made(file: Model, elements: Sequence[int]) -> bool:
    """Whether one of the elements is made of something."""
    return any(has_property(b, "rho") and np.isin(b.ids, elements).any() for b in file.blocks)


def _grown(h: Hypothesis, file: Model) -> bool:
    """Whether groups that are let go do: one supposition, however many there are."""
    return any(
        GROWN[q.of] * float(h.fit.p[k]) >= LEAST_SIZE * float(h.fit.deviations[k])
        for k, q in enumerate(h.fit.setting.model.parameters)
        if q.of in GROWN and q.group is not None and _made(file, q.elements)
    )


def _is(h: Hypothesis, k: int, file: Model) -> bool:
    effect = h.effects[k]
    if effect.physics in GROWS and effect.columns:
        grows = GROWS[effect.physics] * float(h.sizes(k)[0]) > 0.0
        if effect.physics == "mass_change":
            grows |= h.figures[k].values["factor"] > HEAVIEST
        return grows and _made(file, effect.place.elements)
    if effect.physics != LUMP or not effect.columns or h.sizes(k)[0] >= 0.0:
        return False
    values, deviations = h.figures[k].values, h.figures[k].deviations
    off, sure = -values["m"], LEAST_SIZE * deviations["m"]
    return off - sure > drawn(file, effect.place.nodes)


def drawn(file: Model, nodes: tuple[int, ...]) -> float:
    """Mass (kg) of the lumps that a model has at nodes."""
    whole = 0.0
    for block in file.blocks:
        if block.kind.name == "mass":
            here = [bool(nodes_of(file, (int(i),)) & set(nodes)) for i in block.ids]
            whole += float(np.sum((block.properties["mass"] * block.properties["m"])[here]))
    return whole
