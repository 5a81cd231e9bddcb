"""Hypotheses race from smooth recordings to sharp ones, and who falls far behind does not go on."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis, nominal_unknowns
from cvxupdate.diagnose.settings import (
    ABREAST,
    AGAIN,
    BEHIND,
    CLEAR,
    EXPLAINED,
    OPEN,
    STAYING,
    TRIAGED,
)
from cvxupdate.diagnose.types import Evidence, Key, Progress, Seed
from cvxupdate.errors import CvxupdateError

Legs = Sequence[tuple[int, int]]
REFITS, SHARPENED = (
    "explanations of the short lists",
    "explanations carried on to the last level of smoothing",
)


def entered(evidence: Evidence, seeds: Sequence[Seed], progress: Progress) -> list[Hypothesis]:
    """The first pass of seeds, at the level their settings have, best first. A hypothesis begun in
    several places stays in each: after a few iterations the better one is not known yet. Seeds that
    lead to no structure are left out."""
    found: list[Hypothesis] = []
    for number, seed in enumerate(seeds):
        if found and evidence.hurried:
            evidence.leave(REFITS, len(seeds) - number)
            progress("the time is over: what is left is not refitted")
            break
        progress(f"refitting {number + 1} of {len(seeds)}: {seed.name}")
        try:
            h = Hypothesis(seed.effects, evidence.fitted(seed, "first pass"))
        except CvxupdateError:
            continue
        found += [h] if tenable(evidence, h) else []
    ranked = sorted(found, key=lambda h: h.penalised)
    return ranked if evidence.levels > 1 else merged(ranked)


def raced(
    evidence: Evidence, hypotheses: Sequence[Hypothesis], legs: Legs, progress: Progress
) -> list[Hypothesis]:
    """Fitted hypotheses carried on through the levels of ``legs`` (those that the evidence has);
    at most so many (or twice that of near equals) enter each. Best first."""
    runners = sorted(hypotheses, key=lambda h: h.penalised)
    for level, most in legs:
        if level >= evidence.levels or not runners:
            break
        arrived: list[Hypothesis] = []
        refitted = level > 0 or evidence.levels == 1  # the only level: fitted to the end already
        field = _field(runners, most, BEHIND if refitted else TRIAGED)
        for number, h in enumerate(field):
            if len(arrived) >= STAYING and evidence.hurried:
                evidence.leave(SHARPENED, len(field) - number)
                progress("the time is over: what stands further back is not sharpened")
                break
            progress(f"sharpening {number + 1} of {len(field)}: {h.name}")
            try:
                best = min((other.fit.misfit for other in arrived), default=np.inf)
                carried = Hypothesis(h.effects, _sharper(evidence, h, level, best))
            except CvxupdateError:
                continue
            if tenable(evidence, carried):
                arrived.append(carried)
        runners = merged(arrived)
    return runners


def _field(runners: Sequence[Hypothesis], most: int, behind: float) -> list[Hypothesis]:
    """Who enters a level: the best, as far as they have not fallen ``behind``."""
    best = runners[0].penalised
    return [
        h
        for k, h in enumerate(runners)
        if h.penalised <= behind * best
        and (k < most or (k < 2 * most and h.penalised <= ABREAST * best))
    ]


def _sharper(evidence: Evidence, h: Hypothesis, level: int, best: float) -> Fit:
    """Fitted on from where it is; what leaves much at an early level is begun a second time, from
    nominal nuisance parameters, and the better one counts. What falls far behind a misfit that is
    as good as explained (``best`` so far) is not."""
    effort = "sharp" if level == evidence.levels - 1 else "coarse"
    setting = evidence.at_level(h.fit.setting, level)
    found = evidence.fitted(Seed(h.effects, setting, h.fit.p), effort)
    behind = best <= OPEN * EXPLAINED and found.misfit > BEHIND * best
    if level != AGAIN or found.excess <= CLEAR or behind:
        return found
    start = nominal_unknowns(evidence, found.setting, found.p)
    try:
        other = evidence.fitted(Seed(h.effects, found.setting, start), "coarse")
    except CvxupdateError:
        return found
    return min(found, other, key=lambda f: f.misfit)


def tenable(evidence: Evidence, h: Hypothesis) -> bool:
    """False where another effect says it better: a hidden oscillator tuned beyond the recordings
    (a mass or a spring), an exchange of channels in part."""
    wary = [k for k, e in enumerate(h.effects) if e.change is None]
    return all(h.effects[k].tenable(h.values[k], *evidence.band) for k in wary)


def merged(*lists: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of the same hypothesis the best, best first."""
    best: dict[frozenset[Key], Hypothesis] = {}
    for h in sorted(chain(*lists), key=lambda h: h.penalised):
        best.setdefault(h.keys, h)
    return list(best.values())
