"""What else a rig may do beside what brought a model to the tables of its reference.

A search ends with the first set that leaves no more than noise and tolerance, and what a rig does
in small measure (sensors that weigh, a fixture's mass, soft joints) stays in the shapes: a change
is then sized by shapes that are not the structure's. Of a reference nothing is claimed, so the
likeliest model is wanted, and all of it at once is a fit or two.
"""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import PARTS, Hypothesis, further, together, without
from cvxupdate.diagnose.search.beside import beside
from cvxupdate.diagnose.search.classes import BEGUN, lightened, widest
from cvxupdate.diagnose.search.race import entered, merged, raced, refitted
from cvxupdate.diagnose.settings import PARTNERS
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.effect import Effect

REST = "what else a rig does, beside what brings the model near"


def completed(
    evidence: Evidence, near: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Each of ``near``, and the first of them on mounts in place of its springs, with all else that
    a rig does everywhere, freed of what the evidence is better without."""
    out: list[Hypothesis] = []
    ways = [*near, *(_mounted(evidence, near[0], progress) if near else ())]
    for h in ways:
        if evidence.hurried:
            evidence.leave(REST)
            break
        progress(f"fitting what else a rig does beside {h.name}")
        others = further(widest(evidence.candidates(h.fit.setting.model)), h)
        whole = together(evidence, h, others, BEGUN)
        found = refitted(evidence, whole.onward, "sharp")
        if whole.effects and found is not None:
            out += [found, *lightened(evidence, found)]
    return merged(out, [h for h in ways if h.effects])


def _mounted(evidence: Evidence, h: Hypothesis, progress: Progress) -> list[Hypothesis]:
    """A set on the mounts that do most in place of its springs and lumps there; nothing where it
    stands on one, or a rig has none."""
    found = mounts(evidence.candidates(evidence.model))
    if not found or mounts(h.effects):
        return []
    nodes = {n for e in found for n in e.place.nodes}
    own = [
        k
        for k, e in enumerate(h.effects)
        if e.physics in PARTS and not nodes.isdisjoint(e.place.nodes)
    ]
    rest = without(evidence, h, *own) if own else h
    if rest is None:
        return []
    last = evidence.levels - 1
    near = entered(evidence, beside(evidence, rest, level=last, wanted=mounts), progress)
    return raced(evidence, near, ((last, PARTNERS),), progress)


def mounts(effects: Sequence[Effect]) -> list[Effect]:
    """What a structure stands on or hangs from."""
    return [e for e in effects if e.type.mount]
