"""What beams on centre lines and sheets clamped along a line leave out, as nuisance parameters of a
sound model.

Every beam deforms in shear a little, and every member is stiff where it overlaps another. Where
that is small, an analyst is right to leave it out, and a diagnosis must not take it for missing
physics; nor may it be taken for granted, for the structure may be a model of centre lines itself,
or hinge at plates that are welded on. So each has a size between nothing and what theory says,
common to all beams. Where shear shifts frequencies by more than a sound model may miss, its absence
is a finding (`shear_deformation`), and it is no nuisance parameter. Sections resist turning, which
some programs leave out: the share of rotary inertia goes from what the file says to the other.

Sheets are solids here (`cvxupdate.fe.analysis.solid`): they turn, lag behind in shear and twist
easily at free rims, which is one thing, the closing of shear stresses. Kirchhoff's plates have none
of it, or turn alone; so each of the two goes from all to nothing. A sheet that is clamped is so
from a line that is known within a part of its thickness: a face that is held is stiffer than
Kirchhoff's line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.nominal.mesh import shearing
from cvxupdate.diagnose.settings import EXPLAINED, OPEN
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.analysis.solid import LAG, TURNING
from cvxupdate.fe.block import Block
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import has_property, property_names
from cvxupdate.physics.compliance import RIGID
from cvxupdate.physics.given import is_given
from cvxupdate.physics.growth import Wanted
from cvxupdate.physics.units import number

SHEAR, ROTARY, CORNER, CLAMP, BODY = "shear", "rotary", "corner", "clamp", "inertia"
POINT = "a"  # the compliance of `cvxupdate.diagnose.nominal.points`
GROUP = "theory"  # to which these parameters belong, in place of a group of the file
ASIDE = "aside"  # the same, of what forces and sensors are beside their places
# of what theory says of each: most, and prior deviation. Shear: the coefficient of a section
# is known within a fifth. Rotary inertia: all or nothing, a switch of the program, so the file's
# word is no evidence. Corners: overlapping members bend somewhere between as they do elsewhere
# and hardly at all. Clamps, in thicknesses: a face that is held is 0.1 to 0.3 stiffer; one that
# gives way is a finding. Points: ln(R/r₀), of holds from as wide as the sheet is thick to needles.
# Bodies: a cube of steel of a lump's mass turns about itself, or about its foot with two and a half
# times that; flat ones, or of lighter stuff, with more.
SIZES = {
    SHEAR: (1.2, 1.0),
    ROTARY: (1.0, 1.0),
    CORNER: (2.0, 0.5),
    CLAMP: (1.5, 0.5),
    POINT: (8.0, 3.0),
    BODY: (6.0, 2.0),
    LAG: (1.0, 1.0),
    TURNING: (1.0, 1.0),
}
STEEL = 7850.0  # kg/m³
LUMPS = 6  # heaviest lumps, each of which may be a body of its own
FITTED = "fitted along with the usual scatter of the groups, and is no finding."
OF = {SHEAR: "beams", CORNER: "beams", CLAMP: "sheets"}
SWITCHES = {
    ROTARY: "rotary inertia of beams",
    TURNING: "rotary inertia of sheets",
    LAG: "shear of sheets",
}


def lines_of(model: Model, word: str) -> tuple[int, ...]:
    """Numbers of the elements that lack it today."""
    return tuple(
        int(i)
        for b in model.blocks
        if _may(b, word)
        for i, v in zip(b.ids, np.real(b.properties[word]), strict=True)
        if v == 0.0
    )


def switched(model: Model, word: str) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Numbers of the elements that lack it, and of those that have it."""
    out: tuple[list[int], list[int]] = ([], [])
    for block in model.blocks:
        if _may(block, word):
            for i, v in zip(block.ids.tolist(), np.real(block.properties[word]), strict=True):
                out[int(v > 0.0)].append(i)
    return tuple(out[0]), tuple(out[1])


def other(model: Model, word: str) -> Model:
    """The model with it where it has none, and without where it has."""
    return _with(model, word, lambda v: 1.0 - v)


def _with(model: Model, word: str, change: Callable[[Real], Real]) -> Model:
    return replace(
        model,
        blocks=tuple(
            replace(b, properties={**b.properties, word: change(b.properties[word])})
            if _may(b, word)
            else b
            for b in model.blocks
        ),
    )


def lumps_of(model: Model) -> list[tuple[int, float]]:
    """(element, rotary inertia in kg·m² of a cube of steel of its mass) of the heaviest lumps that
    the file takes for points, where something turns."""
    found = [
        (float(np.real(m)), int(i))
        for b in model.blocks
        if has_property(b, BODY)
        for i, m, *own in zip(
            b.ids, b.properties["m"], *(b.properties[k] for k in property_names(BODY)), strict=True
        )
        if np.real(m) > 0.0 and not np.any(own)
    ]
    heaviest = sorted(found, reverse=True)[:LUMPS]
    return [(i, m * (m / STEEL) ** (2.0 / 3.0) / 6.0) for m, i in heaviest]


def with_bodies(model: Model) -> Model:
    """The model with bodies for lumps, as large as they usually are."""
    sizes = dict(lumps_of(model))
    usual = SIZES[BODY][1]

    def own(block: Block) -> Block:
        if not sizes or not has_property(block, BODY):
            return block
        more = np.array([usual * sizes.get(int(i), 0.0) for i in block.ids])
        turned = {k: block.properties[k] + more for k in property_names(BODY)}
        return replace(block, properties={**block.properties, **turned})

    return replace(model, blocks=tuple(own(b) for b in model.blocks))


def _may(block: Block, word: str) -> bool:
    own = {CORNER, CLAMP} & set(block.kind.properties)
    if word == ROTARY and block.exact is not None:
        return False  # the law of an exact member has it or not
    return bool(own) and word in block.kind.properties and has_property(block, word)


def with_theory(model: Model, word: str) -> Model:
    """The model with all that theory says of a word: members twice as stiff within half a depth of
    corners, sheets clamped from a thickness before the line on."""
    return _with(model, word, np.ones_like)


def stocky(model: Model, shift: Callable[[Model, Model], float], most: float) -> bool:
    """Whether beams that lack shear are so short that theory wants it of them: it shifts
    (``shift``) frequencies by more than ``most``, relative."""
    return bool(lines_of(model, SHEAR)) and shift(model, shearing(model)) > most


def theory_of(
    model: Model,
    differ: Callable[[Model, Model], float],
    shift: Callable[[Model, Model], float],
    enough: float,
    most: float,
) -> tuple[str, ...]:
    """The words that change more of the responses (``differ``) than is ``enough``; shear of beams
    where it shifts (``shift``) frequencies by ``most``, relative, at most; rotary inertia, and
    shear of sheets, however much, for no finding says it."""
    out = []
    if lines_of(model, SHEAR):
        sheared = shearing(model)
        if shift(model, sheared) <= most and differ(model, sheared) > enough:
            out.append(SHEAR)
    if any(switched(model, ROTARY)) and differ(model, other(model, ROTARY)) > enough:
        out.append(ROTARY)
    bent = _with(model, LAG, np.zeros_like)
    for word, one in ((LAG, model), (TURNING, bent)):  # what lags behind and does not turn is none
        if any(switched(one, word)) and differ(one, other(one, word)) > enough:
            out.append(word)
    if lumps_of(model) and differ(model, with_bodies(model)) > enough:
        out.append(BODY)
    for word in (CORNER, CLAMP):
        if lines_of(model, word) and differ(model, with_theory(model, word)) > enough:
            out.append(word)
    return tuple(out)


def theory_parameters(model: Model, words: tuple[str, ...]) -> list[Wanted]:
    """One for each word, common to all elements that lack it."""
    out = []
    for word in words:
        if word in SWITCHES:
            out += _switch(model, word)
            continue
        if word == POINT:
            out += _giving(model)
            continue
        if word == BODY:
            most = SIZES[word][0]
            each = lumps_of(model)
            out += [Wanted(f"body {i}", word, (i,), GROUP, 0.0, most, unit) for i, unit in each]
            continue
        ids = lines_of(model, word)
        if ids:
            most = SIZES[word][0]
            out.append(Wanted(f"{word} of {OF[word]}", word, ids, GROUP, 0.0, most, 1.0))
    return out


def _switch(model: Model, word: str) -> list[Wanted]:
    """Of the elements that lack it, and of those that have it."""
    without, have = switched(model, word)
    most, name = SIZES[word][0], SWITCHES[word]
    ends = ((without, name, 0.0, most), (have, f"{name} that have it", -most, 0.0))
    return [Wanted(n, word, ids, GROUP, low, high, 1.0) for ids, n, low, high in ends if ids]


def _giving(model: Model) -> list[Wanted]:
    """Of points that hold sheets."""
    return [
        Wanted("give of points", POINT, tuple(b.ids.tolist()), GROUP, 0.0, SIZES[POINT][0], unit)
        for b in model.blocks
        if is_given(b)
        for unit in [RIGID * float(np.real(b.properties["a0"][0]))]
    ]


def _size(value: float, what: str = "of it") -> str:
    """How much of something was fitted, in words; a hundredth is none."""
    return f" ({number(value, 2) if abs(value) >= 0.01 else 'none'} {what})"


def theory_lines(model: Model, base: Fit) -> list[str]:
    """What the nuisance parameters have of the theory, with their sizes where they explain
    (``base``: fitted alone)."""
    p = base.p if base.misfit <= OPEN * EXPLAINED else None
    own = {q.of: j for j, q in enumerate(model.parameters) if q.group == GROUP}
    words = []
    if SHEAR in own:
        size = "" if p is None else _size(p[own[SHEAR]], "of what their sections say")
        words.append(f"deform in shear{size}")
    if CORNER in own:
        size = "" if p is None else f" (by a factor of {number(1.0 + float(p[own[CORNER]]), 2)})"
        words.append(f"be stiffer within half a depth of corners{size}")
    out = []
    if words:
        out = [
            f"Beams may {' and '.join(words)}: what Euler's theory on centre lines leaves out was "
            f"{FITTED}"
        ]
    if ROTARY in own:
        q = model.parameters[own[ROTARY]]
        share = "" if p is None else _size(p[own[ROTARY]] - q.lower)
        out.append(
            f"Sections of beams may resist turning or not{share}: rotary inertia, which programs "
            f"have or leave out, was {FITTED}"
        )
    sheets = [
        f"{does}{size}"
        for word, does in ((LAG, "lag behind in shear"), (TURNING, "resist turning"))
        if word in own
        for q in [model.parameters[own[word]]]
        for size in ["" if p is None else _size(p[own[word]] - q.lower)]
    ]
    if sheets:
        out.append(
            f"Sheets may {' and '.join(sheets)} as solids do, or not, as Kirchhoff's: it was "
            f"{FITTED}"
        )
    if BODY in own:
        out.append(
            "Lumps of the file may be bodies that resist turning, as cubes of steel of their mass "
            f"do or several times that: it was {FITTED}"
        )
    if CLAMP in own:
        size = "" if p is None else _size(p[own[CLAMP]])
        out.append(
            "Clamped edges of sheets may hold from a part of the thickness before their line on"
            f"{size}: it was {FITTED}"
        )
    if any(q.group == ASIDE for q in model.parameters):
        out.append(
            "Forces and sensors may be some millimetres beside their nodes and a degree or two off "
            f"their directions: it was {FITTED}"
        )
    if POINT in own:
        size = "" if p is None else f" (by {number(float(p[own[POINT]]), 2)} / θκGh)"
        out.append(
            "A sheet may give way in shear where a point holds it (θ of the sheet around it)"
            f"{size}: it was {FITTED}"
        )
    return out
