"""Hypotheses race from smooth recordings to sharp ones, and who falls far behind does not go on."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import chain

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, nominal_unknowns
from cvxupdate.diagnose.search.untuned import tenable, untuned
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
from cvxupdate.forked import Ahead

Legs = Sequence[tuple[int, int]]
REFITS, SHARPENED = (
    "explanations fitted for the first time",
    "explanations fitted to the end",
)


def entered(evidence: Evidence, seeds: Sequence[Seed], progress: Progress) -> list[Hypothesis]:
    """The first pass of seeds, at the level their settings have, best first. A hypothesis begun in
    several places stays in each: after a few iterations the better one is not known yet. Seeds that
    lead to no structure are left out."""
    found, lost = list[Hypothesis](), list[Hypothesis]()
    with Ahead(lambda s: refitted(evidence, s, "first pass"), seeds, evidence.jobs) as refits:
        for number, seed in enumerate(seeds):
            if found and evidence.hurried:
                evidence.leave(REFITS, len(seeds) - number)
                progress("the time is over: what is left is not refitted")
                break
            progress(f"refitting {number + 1} of {len(seeds)}: {seed.name}")
            h = refits.take()
            if h is not None:
                (found if tenable(evidence, h) else lost).append(h)
    found += _untuned(evidence, lost, found, "first pass")
    ranked = sorted(found, key=lambda h: h.penalised)
    return ranked if evidence.levels > 1 else merged(ranked)


def refitted(evidence: Evidence, seed: Seed, effort: str) -> Hypothesis | None:
    """A seed fitted; None where that leads to no structure."""
    try:
        return Hypothesis(seed.effects, evidence.fitted(seed, effort))
    except CvxupdateError:
        return None


def raced(
    evidence: Evidence,
    hypotheses: Sequence[Hypothesis],
    legs: Legs,
    progress: Progress,
    behind: float | None = None,
) -> list[Hypothesis]:
    """Fitted hypotheses carried on through the levels of ``legs`` (those that the evidence has);
    at most so many (or twice that of near equals) enter each, none that leaves more than
    ``behind`` times what the best does (None: what that is at the level). Best first."""
    runners = sorted(hypotheses, key=lambda h: h.penalised)
    for level, most in legs:
        if level >= evidence.levels or not runners:
            break
        usual = BEHIND if level > 0 or evidence.levels == 1 else TRIAGED  # 0: not to the end yet
        field = _field(runners, most, usual if behind is None else behind)
        arrived, lost = list[Hypothesis](), list[Hypothesis]()
        work = partial(_sharper, evidence, level, arrived)
        with Ahead(work, field, evidence.jobs) as refits:
            for number, h in enumerate(field):
                if len(arrived) >= STAYING and evidence.hurried:
                    evidence.leave(SHARPENED, len(field) - number)
                    progress("the time is over: what stands further back is not sharpened")
                    break
                progress(f"sharpening {number + 1} of {len(field)}: {h.name}")
                found, again = refits.take()
                carried = _better(found, again, arrived)
                if carried is not None:
                    (arrived if tenable(evidence, carried) else lost).append(carried)
        arrived += _untuned(evidence, lost, arrived, _effort(evidence, level))
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


def _effort(evidence: Evidence, level: int) -> str:
    return "sharp" if level == evidence.levels - 1 else "coarse"


def _sharper(
    evidence: Evidence, level: int, arrived: Sequence[Hypothesis], h: Hypothesis
) -> tuple[Hypothesis | None, Hypothesis | None]:
    """Fitted on from where it is; and what leaves much at an early level begun a second time, from
    nominal nuisance parameters, unless it is far behind those that ``arrived`` so far."""
    effort = _effort(evidence, level)
    setting = evidence.at_level(h.fit.setting, level)
    found = refitted(evidence, Seed(h.effects, setting, h.fit.p), effort)
    if found is None or level != AGAIN or found.fit.excess <= CLEAR or _behind(found, arrived):
        return found, None
    start = nominal_unknowns(evidence, found.fit.setting, found.fit.p)
    return found, refitted(evidence, Seed(h.effects, found.fit.setting, start), "coarse")


def _better(
    found: Hypothesis | None, again: Hypothesis | None, arrived: Sequence[Hypothesis]
) -> Hypothesis | None:
    """Of two fits of a hypothesis; the first where it is far behind those that arrived before it,
    some of which were not known yet when it was fitted ahead."""
    if found is None or again is None or _behind(found, arrived):
        return found
    return min(found, again, key=lambda h: h.fit.misfit)


def _behind(h: Hypothesis, arrived: Sequence[Hypothesis]) -> bool:
    """Whether it has fallen far behind a misfit that is as good as explained."""
    best = min((other.fit.misfit for other in arrived), default=np.inf)
    return bool(best <= OPEN * EXPLAINED and h.fit.misfit > BEHIND * best)


def _untuned(
    evidence: Evidence, lost: Sequence[Hypothesis], kept: Sequence[Hypothesis], effort: str
) -> list[Hypothesis]:
    """What led but is not tenable, with a mass or a spring for its oscillator, fitted."""
    best = min((h.penalised for h in kept), default=np.inf)
    tried, out = {h.keys for h in kept}, list[Hypothesis]()
    for h in sorted(lost, key=lambda h: h.penalised)[:STAYING]:
        if h.penalised >= best or evidence.hurried:
            break
        seeds = [s for s in untuned(evidence, h) if s.keys not in tried]
        tried |= {s.keys for s in seeds}
        found = (refitted(evidence, s, effort) for s in seeds)
        out += [h for h in found if h is not None and tenable(evidence, h)]
    return out


def merged(*lists: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of the same hypothesis the best, best first."""
    best: dict[frozenset[Key], Hypothesis] = {}
    for h in sorted(chain(*lists), key=lambda h: h.penalised):
        best.setdefault(h.keys, h)
    return list(best.values())
