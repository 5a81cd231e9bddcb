"""``stiffness_change`` of a stretch of a member that does not keep to the elements' lines.

What is burnt, corroded or cracked begins and ends within elements. The elements that lie wholly in
the stretch have one factor f. One at its end, a part w of which lies in it, gives way there by
c w, c = 1/f - 1, of its own compliance in bending, and that with its middle at 1 - w/2 of its
length. A factor on all of it (a compliance a in its middle) and a joint at its inner end (b) have
the same sum and the same middle where a = c w², b = c w (1 - w): so a joint alone says it where
little of the element is inside, and both say it where more is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics.chains import Chain, chains
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.draft import node_of
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import Rates, Wanted, append_parameters, limited
from cvxupdate.physics.joint_flexibility import JointFlexibility, ends_of, is_beam
from cvxupdate.physics.place import Place, numbered, where
from cvxupdate.physics.quantity import Figure, Quantity, factor
from cvxupdate.physics.stiffness_change import LIMITS
from cvxupdate.physics.units import number

WHOLE, JOINT, BOTH = 0, 1, 2  # how the element at an end is: all inside, partly (two ways)
Ends = tuple[int, int]
FIRST, LAST = "first", "last"
BEYOND = 2.0  # deviations by which an end may lie beyond what a stretch can have
BENDS = 4.0  # EI/L in the stiffness that an end of a beam turns with, its other end held


@dataclass(frozen=True, eq=False)
class ZoneChange(ModelChange):
    """One factor on the elements that lie wholly in the stretch; of each element at its ends that
    lies partly in it (``ends``) a joint at its inner end, and a factor on it; along ``chain``."""

    ends: Ends = (WHOLE, WHOLE)
    chain: Chain | None = None

    @property
    def detail(self) -> tuple[int, ...]:
        """Which ends are partly inside, and how."""
        return self.ends

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """The same stretch of another model."""
        return zone(context.model, self.members, self.ends)


@final
class SoftZone(EffectType):
    """A factor on K of a stretch that begins and ends within elements."""

    name = "stiffness_change"
    noun = "a change of stiffness"
    sought = False  # the search grows it from what sets of elements bring

    def candidates(self, context: SearchContext) -> list[Effect]:
        """The shortest: one element of a straight member, and a part of each beside it. The search
        makes longer ones, of which there are as many as pairs of elements."""
        model, short = context.model, 3
        runs = [c.elements[k : k + short] for c in chains(model) for k in range(len(c.elements))]
        found = [zone(model, run, (JOINT, JOINT)) for run in runs if len(run) == short]
        return [e for e in found if e is not None]

    def plainly(self, values: Mapping[str, float], deviations: Mapping[str, float]) -> bool:
        """Whether an element at an end gives way more than what lies inside, or less than nothing:
        no stretch does, so there is something else."""
        give = 1.0 / values["factor"] - 1.0
        wide = deviations["factor"] / values["factor"] ** 2
        for end in (FIRST, LAST):
            if f"give_{end}" not in values:
                continue
            part = _end(values, end)
            own = float(np.hypot(deviations[f"give_{end}"], deviations.get(f"soft_{end}", 0.0)))
            more = part - give if give > 0.0 else give - part
            if more > BEYOND * (own + wide) or part * np.sign(give) < -BEYOND * own:
                return True
        return False

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """From where to where, which elements partly, and by how much; of a stretch of which an
        end gives more than what lies inside, by how much on average."""
        average = _average(effect, values)
        change = 100.0 * ((values["factor"] if average is None else average) - 1.0)
        return (
            f"{_between(effect, values)} the real structure is {number(abs(change), 2)} % "
            f"{'stiffer' if change > 0 else 'softer'} than modelled"
            f"{'.' if average is None else ' on average.'}"
        )


def zone(model: Model, elements: Sequence[int], ends: Ends) -> Effect | None:
    """A stretch of a straight member, its first and last element partly inside as ``ends`` say;
    None where the elements are no stretch of beams, or none of them lies wholly inside."""
    wanted = frozenset(elements)
    chain = next((c for c in chains(model) if wanted <= set(c.elements)), None)
    ids: tuple[int, ...] = chain.stretch(wanted) if chain is not None else ()
    inside = ids[ends[0] > WHOLE : len(ids) - (ends[1] > WHOLE)]
    if chain is None or len(ids) != len(wanted) or not inside:
        return None
    at = chain.elements.index(ids[0])
    tips = ((FIRST, ids[0], chain.nodes[at + 1]), (LAST, ids[-1], chain.nodes[at + len(ids) - 1]))
    partly = [tip for tip, end in zip(tips, ends, strict=True) if end > WHOLE]
    both = [tip for tip, end in zip(tips, ends, strict=True) if end == BOTH]
    joints = [_joint(model, tip[1], tip[2]) for tip in partly]
    opened = [j.change for j in joints if j is not None and j.change is not None]
    if len(opened) < len(partly):
        return None
    sets = [inside, *((tip[1],) for tip in both)]
    asked = [limited(f"{SoftZone.name}@{n}", "stiffness", s, LIMITS) for n, s in enumerate(sets)]
    rates, count = Rates.of(model, "stiffness"), len(sets)
    tangent = [*(rates.tangent(s) for s in sets), *(t for c in opened for t in c.tangent)]
    grow = partial(_grown, model, asked, tuple((tip[1], tip[2]) for tip in partly))
    change = ZoneChange(grow, tuple(tangent), ids, ends=ends, chain=chain)
    figures = [factor()]
    figures += [_softer(f"soft_{tip[0]}", 1 + k) for k, tip in enumerate(both)]
    figures += [_turning(f"give_{tip[0]}", count + k) for k, tip in enumerate(partly)]
    place = Place(elements=tuple(sorted(ids)))
    return Effect(SoftZone(), place, change, tuple(figures), 0, LIMITS)


def _grown(model: Model, asked: Sequence[Wanted], joints: Sequence[tuple[int, int]]) -> Model:
    grown = append_parameters(model, asked)
    for element, node in joints:
        joint = _joint(grown, element, node)
        if joint is not None and joint.change is not None:
            grown = joint.change.model
    return grown


def _joint(model: Model, element: int, node: int) -> Effect | None:
    """The joint at the end of a beam at a node; None of other elements."""
    beams = [(n, b) for n, b in enumerate(model.blocks) if is_beam(b) and element in b.ids]
    for at, block in beams:
        for e, columns in ends_of(block):
            here = node_of(model, int(block.dofs[e, columns[0]]))
            if int(block.ids[e]) == element and here == node:
                k = np.asarray(block.combine(block.scalars(block.properties))["K"][e])
                return JointFlexibility().at_end(model, at, e, columns, k)
    return None


def _softer(name: str, index: int) -> Quantity:
    """What an element gives way by, in its own compliances, of a factor on its stiffness."""

    def convert(m: Model, q: Parameter | None, x: float, dx: float, unit: float) -> Figure:
        left = max(1.0 + x, 1e-6)
        return 1.0 / left - 1.0, dx / left**2

    return Quantity(name, index, convert, 0.0)


def _turning(name: str, index: int) -> Quantity:
    """The same of a joint at its end."""
    return Quantity(name, index, lambda m, q, x, dx, unit: (x / BENDS, dx / BENDS), 0.0)


def _end(values: Mapping[str, float], end: str) -> float:
    """What an element at an end gives way by, in its own compliances."""
    return values[f"give_{end}"] + values.get(f"soft_{end}", 0.0)


def _average(effect: Effect, values: Mapping[str, float]) -> float | None:
    """The factor that gives a whole stretch the compliance found, where an element at its end has
    more than what lies inside; else None."""
    change, give = effect.change, 1.0 / values["factor"] - 1.0
    if not isinstance(change, ZoneChange) or change.chain is None:
        return None
    gives = np.full(len(change.members), give)
    for end, k in ((FIRST, 0), (LAST, -1)):
        if f"give_{end}" in values:
            gives[k] = _end(values, end)
    if np.all(gives * np.sign(give) <= abs(give)):
        return None
    lengths = [change.chain.lengths[change.chain.elements.index(i)] for i in change.members]
    return float(1.0 / (1.0 + np.average(gives, weights=lengths)))


def covered(values: Mapping[str, float], end: str) -> float:
    """The part (0 to 1) of the element at an end that lies in the stretch."""
    give = 1.0 / values["factor"] - 1.0
    return min(1.0, max(0.0, _end(values, end) / give)) if give else 0.0


def _between(effect: Effect, values: Mapping[str, float]) -> str:
    change = effect.change
    if not isinstance(change, ZoneChange) or change.chain is None:
        return f"In elements {numbered(effect.place.elements)}"
    chain, ids, partly = change.chain, change.members, list[int]()
    (start, first), (last, stop) = chain.at(ids[0]), chain.at(ids[-1])
    if f"give_{FIRST}" in values:
        start = first - covered(values, FIRST) * (first - start)
        partly.append(ids[0])
    if f"give_{LAST}" in values:
        stop = last + covered(values, LAST) * (stop - last)
        partly.append(ids[-1])
    tip = f"node {chain.nodes[0]}" if chain.nodes[0] else "the held end"
    inside = where(Place(elements=tuple(i for i in ids if i not in partly)))
    return (
        f"Between {number(start)} and {number(stop)} m from {tip} "
        f"({inside}, {where(Place(elements=tuple(partly)))} in part)"
    )
