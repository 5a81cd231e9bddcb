"""What goes with the drive: of recordings from one place nothing tells, of what is held out from
another it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, together, without
from cvxupdate.diagnose.search.approach import Approach
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.race import entered, raced
from cvxupdate.diagnose.settings import HALVED, STAYING, TWICE
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.shaker import at_drive, goes, parts_of


def settled(
    evidence: Evidence, found: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Hypotheses in which what stands at the drive stays there or goes with it, whichever tells
    better what was held out: what was fitted, driven from one place, is the same. What stays is no
    shaker: of the best, the parts of one in its place."""
    approach = evidence.approach
    if approach is None:
        return list(found)
    told = [_settled(evidence, approach, h) for h in found if not _said_lighter(h, found)]
    shakers = sorted((h for h in told if _staying(h)), key=merit, reverse=True)
    parts = list(chain.from_iterable(_in_parts(evidence, h) for h in shakers[:STAYING]))
    last = evidence.levels - 1
    sharp = raced(evidence, parts, ((last, len(parts)),), progress, behind=np.inf)
    told = [h for h in told if not _staying(h)] if sharp else told
    known = {h.keys for h in told}
    return [*told, *(_a_structures(h) for h in sharp if h.keys not in known)]


def _staying(h: Hypothesis) -> bool:
    """Whether it has a shaker that has been told to stay (`_a_structures`)."""
    return any(parts_of(e) and not (e.spot or goes(e)) for e in h.effects)


def _in_parts(evidence: Evidence, h: Hypothesis) -> list[Hypothesis]:
    """A set with what a shaker that stays is made of in its place, of its sizes: both and each
    alone. Nothing where not both may be told."""
    where = next(k for k, e in enumerate(h.effects) if parts_of(e))
    gone, rest = h.effects[where], without(evidence, h, where)
    if rest is None or not {*parts_of(gone)} <= {*evidence.names}:
        return []
    sizes = dict(zip(parts_of(gone), h.sizes(where), strict=True))
    near = evidence.candidates(rest.fit.setting.model, list(sizes))
    here = [c for c in near if c.place.nodes == gone.place.nodes]
    here = [c for c in here if c.place.dof in (None, gone.place.dof)]
    lumps, springs = ([c for c in here if c.physics == name] for name in sizes)
    if not (lumps and springs):
        return []
    m, k = sizes.values()
    heavy = together(evidence, rest, lumps[:1], m)
    return [
        together(evidence, heavy, springs[:1], k),
        heavy,
        together(evidence, rest, springs[:1], k),
    ]


def _said_lighter(h: Hypothesis, found: Sequence[Hypothesis]) -> bool:
    """Whether another set with the mass or the spring of its shaker alone is likelier: it would
    count twice among the rivals of others."""
    for e in h.effects:
        parts, rest = parts_of(e), h.keys - {e.key}
        for other in found if parts else ():
            alone = [x for x in other.effects if x.key not in rest]
            same = rest <= other.keys and len(alone) == 1 and alone[0].physics in parts
            if same and alone[0].place.nodes == e.place.nodes and merit(other) >= merit(h):
                return True
    return False


def _settled(evidence: Evidence, approach: Approach, stays: Hypothesis) -> Hypothesis:
    goes = approach.with_drive(stays)
    if goes is None:
        return stays
    here, there = (evidence.errors(h.fit).hold_out for h in (stays, goes))
    if here > there:
        return goes
    return _a_structures(stays) if here <= HALVED * there else stays


def _a_structures(h: Hypothesis) -> Hypothesis:
    """The same, told without the shaker: driven from elsewhere, the structure has it too."""
    own = [replace(e, spot="") if at_drive(e) else e for e in h.effects]
    return Hypothesis(tuple(own), h.fit)


def shaken(evidence: Evidence, sets: Sequence[Hypothesis], progress: Progress) -> list[Hypothesis]:
    """The best sets with a shaker where they drive, sharpened, as far as they tell much worse what
    was held out from another place than what was fitted."""
    approach = evidence.approach
    if approach is None:
        return []
    errors = [(h, evidence.errors(h.fit)) for h in sets[:STAYING]]
    apart = [h for h, e in errors if e.hold_out > TWICE * e.fit]
    seeds = [seed for h in apart if (seed := approach.shaken(h)) is not None]
    found = entered(evidence, seeds, progress)
    return raced(evidence, found, ((evidence.levels - 1, len(found)),), progress)
