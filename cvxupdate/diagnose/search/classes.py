"""What a rig does alike everywhere, sought before anything that stands somewhere.

Of a reference state nothing is to be claimed: the model is brought to it. Supports that all turn,
joints that are all soft, sensors that all weigh, the fixture: there are few of these, so sets of
them are soon grown, where every effect at every place takes most of the time that a diagnosis has.
"""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig
from cvxupdate.diagnose.search.backward import backward, merit
from cvxupdate.diagnose.search.beside import beside
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.search.several import room
from cvxupdate.diagnose.settings import PARTNERS
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.effect import Effect


def alike_everywhere(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """Sets of what a rig does, each of its parts alike wherever it may stand, grown as long as the
    evidence grows; best first, the best freed of what it is better without."""
    best = Hypothesis((), evidence.bases[-1])
    found: list[Hypothesis] = []
    last = evidence.levels - 1
    while room(evidence, best) and not (evidence.clear(best.fit) or evidence.hurried):
        progress(f"seeking what a rig does everywhere beside {best.name}")
        seeds = beside(evidence, best, level=last, wanted=of_classes)
        near = raced(evidence, entered(evidence, seeds, progress), ((last, PARTNERS),), progress)
        likeliest = max(near, key=merit, default=best)
        if merit(likeliest) <= merit(best):
            break
        found, best = merged(found, near), likeliest
    if len(best.effects) > 1:
        found = merged(found, backward(evidence, best, progress)[1])
    return [h for h in found if h.effects]


def of_classes(effects: Sequence[Effect]) -> list[Effect]:
    """Those that a rig does at all places of a kind, or at the only one that there is."""
    own = [e for e in effects if of_a_rig(e)]
    classes = {e.physics for e in own if _many(e)}
    return [e for e in own if _many(e) or e.physics not in classes]


def _many(e: Effect) -> bool:
    return len(e.place.nodes) > 1 or len(e.place.elements) > 1
