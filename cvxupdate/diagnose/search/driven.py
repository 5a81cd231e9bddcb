"""What goes with the drive: of recordings from one place nothing tells, of what is held out from
another it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search.approach import Approach
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.race import entered, raced
from cvxupdate.diagnose.settings import HALVED, STAYING, TWICE
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.shaker import at_drive, parts_of


def settled(evidence: Evidence, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses in which what stands at the drive stays there or goes with it, whichever tells
    better what was held out: what was fitted, driven from one place, is the same."""
    approach = evidence.approach
    if approach is None:
        return list(found)
    return [_settled(evidence, approach, h) for h in found if not _said_lighter(h, found)]


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
    """The same, told without the shaker: driven from elsewhere, the structure has it too. What a
    shaker is made of keeps its name."""
    own = [replace(e, spot="") if at_drive(e) and not parts_of(e) else e for e in h.effects]
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
