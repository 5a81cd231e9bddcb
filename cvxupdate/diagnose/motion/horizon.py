"""How far into its recordings a structure can be followed.

Where parts strike or springs harden, motions that begin nearly alike may part exponentially: a
model that is right to the last digit but one follows a recording up to some instant and then walks
off on its own. What comes later tells it from no other, and a search that compares whole recordings
finds nothing that explains them. Then only their beginnings are compared: the longest that a law
explains from rest on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from
from cvxupdate.diagnose.motion.columns import is_law
from cvxupdate.diagnose.motion.evidence import MotionEvidence
from cvxupdate.diagnose.motion.guided import SHORTER, lengthened
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.diagnose.settings import EXPLAINED, FOLLOWED, OPEN
from cvxupdate.diagnose.types import Evidence, Progress, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.forked import Ahead

Again = Callable[[ResponseEvidence, float], MotionEvidence | None]  # of a part of the recordings
TRIED = 3  # laws: one at the wrong place leaves the recording though another follows it


def foretold(evidence: Evidence, again: Again, progress: Progress) -> tuple[Evidence, str]:
    """Evidence of motion, where a law follows the beginnings of the recordings and no more, made
    ``again`` of these alone, and that in words; any other as it is."""
    if not isinstance(evidence, MotionEvidence):
        return evidence, ""
    progress("following the motion")
    part = followed_part(evidence)
    early = None if part == 1.0 else again(evidence.came, part)
    # what a linear model explains there (a sweep below resonance) any law would follow
    if early is None or not early.depends or early.bases[-1].misfit <= EXPLAINED:
        return evidence, ""
    return early, (
        f"Motions that begin nearly alike part here: a simulation follows the first {part:.0%} of "
        "each recording and no more, so what comes later is neither fitted nor held against it."
    )


def followed_part(evidence: MotionEvidence) -> float:
    """Part of the recordings that one of the likeliest laws follows; 1 where one explains the
    whole, or none any, or nothing depends on the level, or what changes follows the clock."""
    if not evidence.depends or evidence.drift:
        return 1.0
    base = Hypothesis((), evidence.bases[0])
    laws = [e for e in evidence.candidates(evidence.model, evidence.laws) if is_law(e)]
    scores = sorted(evidence.first_order(base.fit, laws), key=lambda s: -s.fraction)
    seeds = seeds_from(evidence, base, [s for s in scores[:TRIED] if s.fraction > 0.0], 0)
    followed = 0.0
    with Ahead(partial(_part, evidence), seeds, evidence.jobs) as parts:
        for part in (parts.take() for _ in seeds):
            if part == 1.0:
                return part
            followed = max(followed, part)
    return followed or 1.0


def _part(evidence: MotionEvidence, seed: Seed) -> float:
    """That of one law; 0 where it follows none."""
    try:
        first = evidence.fitted(seed, "first pass")
        setting = evidence.at_level(first.setting, evidence.levels - 1)
        early = lengthened(setting, (first.p,))
        whole = fitted(setting, early[-1].p, EFFORTS["coarse"])
    except CvxupdateError:
        return 0.0
    if whole.misfit <= OPEN * EXPLAINED:
        return 1.0
    parts = {1.0 / times: f for times, f in zip(SHORTER, early, strict=True)}
    own = [x for x, f in parts.items() if x >= FOLLOWED and f.misfit <= EXPLAINED]
    return max(own, default=0.0)
