"""What beams on centre lines and sheets clamped along a line leave out, as nuisance parameters of a
sound model.

Every beam deforms in shear a little, and every member is stiff where it overlaps another. Where
that is small, an analyst is right to leave it out, and a diagnosis must not take it for missing
physics; nor may it be taken for granted, for the structure may be a model of centre lines itself,
or hinge at plates that are welded on. So each has a size between nothing and what theory says,
common to all beams. Where shear shifts frequencies by more than a sound model may miss, its absence
is a finding (`shear_deformation`), and it is no nuisance parameter. A sheet that is clamped is so
from a line that is known within a part of its thickness: a face that is held is stiffer than
Kirchhoff's line (`cvxupdate.fe.analysis.solid`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.nominal.mesh import shearing
from cvxupdate.diagnose.settings import EXPLAINED, OPEN
from cvxupdate.fe.block import Block
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import has_property
from cvxupdate.physics.growth import Wanted
from cvxupdate.physics.units import number

SHEAR, CORNER, CLAMP = "shear", "corner", "clamp"
GROUP = "theory"  # to which these parameters belong, in place of a group of the file
# of what theory says of each: most, and prior deviation. Shear: the coefficient of a section
# is known within a fifth. Corners: overlapping members bend somewhere between as they do elsewhere
# and hardly at all. Clamps, in thicknesses: a face that is held is 0.1 to 0.3 stiffer; one that
# gives way is a finding.
SIZES = {SHEAR: (1.2, 1.0), CORNER: (2.0, 0.5), CLAMP: (1.5, 0.5)}
OF = {SHEAR: "beams", CORNER: "beams", CLAMP: "sheets"}


def lines_of(model: Model, word: str) -> tuple[int, ...]:
    """Numbers of the elements that lack it today."""
    return tuple(
        int(i)
        for b in model.blocks
        if _may(b, word)
        for i, v in zip(b.ids, np.real(b.properties[word]), strict=True)
        if v == 0.0
    )


def _may(block: Block, word: str) -> bool:
    own = {CORNER, CLAMP} & set(block.kind.properties)
    return bool(own) and word in block.kind.properties and has_property(block, word)


def with_theory(model: Model, word: str) -> Model:
    """The model with all that theory says of a word: members twice as stiff within half a depth of
    corners, sheets clamped from a thickness before the line on."""
    return replace(
        model,
        blocks=tuple(
            replace(b, properties={**b.properties, word: np.ones_like(b.properties[word])})
            if _may(b, word)
            else b
            for b in model.blocks
        ),
    )


def theory_of(
    model: Model,
    differ: Callable[[Model, Model], float],
    shift: Callable[[Model, Model], float],
    enough: float,
    most: float,
) -> tuple[str, ...]:
    """The words that change more of the responses (``differ``) than is ``enough``; shear where it
    shifts (``shift``) frequencies by ``most``, relative, at most."""
    out = []
    if lines_of(model, SHEAR):
        sheared = shearing(model)
        if shift(model, sheared) <= most and differ(model, sheared) > enough:
            out.append(SHEAR)
    for word in (CORNER, CLAMP):
        if lines_of(model, word) and differ(model, with_theory(model, word)) > enough:
            out.append(word)
    return tuple(out)


def theory_parameters(model: Model, words: tuple[str, ...]) -> list[Wanted]:
    """One for each word, common to all elements that lack it."""
    out = []
    for word in words:
        ids = lines_of(model, word)
        if ids:
            most = SIZES[word][0]
            out.append(Wanted(f"{word} of {OF[word]}", word, ids, GROUP, 0.0, most, 1.0))
    return out


def theory_lines(model: Model, base: Fit) -> list[str]:
    """What the nuisance parameters have of the theory, with their sizes where they explain
    (``base``: fitted alone)."""
    p = base.p if base.misfit <= OPEN * EXPLAINED else None
    own = {q.of: j for j, q in enumerate(model.parameters) if q.group == GROUP}
    words = []
    if SHEAR in own:
        size = "" if p is None else f" ({number(float(p[own[SHEAR]]), 2)} of what sections say)"
        words.append(f"deform in shear{size}")
    if CORNER in own:
        size = "" if p is None else f" (by a factor of {number(1.0 + float(p[own[CORNER]]), 2)})"
        words.append(f"be stiffer within half a depth of corners{size}")
    out = []
    if words:
        out = [
            f"Beams may {' and '.join(words)}: what Euler's theory on centre lines leaves out was "
            "fitted beside the scatter of the groups, and is no finding."
        ]
    if CLAMP in own:
        size = "" if p is None else f" ({number(float(p[own[CLAMP]]), 2)} of it)"
        out.append(
            "Clamped edges of sheets may hold from a part of the thickness before their line on"
            f"{size}: it was fitted beside the scatter of the groups, and is no finding."
        )
    return out
