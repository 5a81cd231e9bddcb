"""What enters a search: candidates screened at every level, the short list refitted once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from
from cvxupdate.diagnose.screen.shortlist import best_of, shortlist
from cvxupdate.diagnose.screen.stability import stability
from cvxupdate.diagnose.search.beside import beside
from cvxupdate.diagnose.search.guided import nearest_alone
from cvxupdate.diagnose.search.race import entered
from cvxupdate.diagnose.settings import STABLE
from cvxupdate.diagnose.types import Evidence, Progress, Score


def screened(
    evidence: Evidence, names: Sequence[str], progress: Progress
) -> tuple[list[list[Score]], list[tuple[Score, float]]]:
    """First-order scores at every level but the last, and how often half of the recordings chooses
    each, where most is explained."""
    bases, rankings = evidence.bases, list[list[Score]]()
    candidates = evidence.candidates(evidence.model, names)
    for fit in bases[: max(1, evidence.levels - 1)]:
        progress(f"screening {len(candidates)} candidates")
        rankings.append(evidence.first_order(fit, candidates))
    clearest = int(np.argmax([max((s.fraction for s in r), default=0.0) for r in rankings]))
    progress("resampling the recordings")
    return rankings, stability(evidence, bases[clearest], rankings[clearest])


def first_pass(
    evidence: Evidence,
    rankings: Sequence[Sequence[Score]],
    stable: Sequence[tuple[Score, float]],
    pattern: bool,
    progress: Progress,
) -> list[Hypothesis]:
    """The first pass of the short list and, unless only the ``pattern`` of damping is at stake, of
    effects at finite sizes and of what brings the whole nearer by itself."""
    often = [s for s, part in stable if part >= STABLE]
    listed = best_of(*(shortlist(r) for r in rankings), often)
    start = Hypothesis((), evidence.bases[0])
    seeds = seeds_from(evidence, start, listed, 0)
    if not pattern:
        seeds += beside(evidence, start, level=0, scores=rankings[0])
        seeds += nearest_alone(evidence, progress)
    return entered(evidence, seeds, progress)
