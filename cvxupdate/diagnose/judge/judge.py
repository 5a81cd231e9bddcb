"""The decision: what is claimed of all that was tried, against whom, and how surely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, only_a_rig, without
from cvxupdate.diagnose.judge.acceptance import (
    Case,
    Weighed,
    better,
    credible,
    explained,
    needs_several,
    refuted,
    saturated,
    weighed,
)
from cvxupdate.diagnose.judge.alternatives import equivalents, of_a_change, spread_over
from cvxupdate.diagnose.judge.confidence import Standing, certainty_of_groups, standing
from cvxupdate.diagnose.judge.graded import Graded, graded
from cvxupdate.diagnose.judge.groups import group_findings, loose_groups
from cvxupdate.diagnose.judge.jumble import jumbled
from cvxupdate.diagnose.judge.larger import needed
from cvxupdate.diagnose.judge.median import in_common, likelier_part, median
from cvxupdate.diagnose.judge.middle import in_the_middle
from cvxupdate.diagnose.judge.parts import in_time, parts_of
from cvxupdate.diagnose.judge.posterior import log_odds, rivals
from cvxupdate.diagnose.judge.sounder import sounder
from cvxupdate.diagnose.judge.soundness import said_plainly, sound
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.search.race import refitted
from cvxupdate.diagnose.search.search import Found, by_count, damping_only
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS, STATED, STRONG
from cvxupdate.diagnose.types import Evidence, Key, Seed
from cvxupdate.errors import CvxupdateError


@dataclass(frozen=True)
class Judgement:
    """What was decided: the hypothesis that convinces (``final``, None where none does), whom it
    was judged against (``field``), what is claimed of it, how each of its effects stands; what
    can be said though nothing is (``graded``); whether nothing is missing by the modes in the
    responses, though these differ (``sound``)."""

    case: Case
    singles: tuple[Weighed, ...]
    several: tuple[Weighed, ...]
    single: Weighed | None = None
    final: Weighed | None = None
    field: tuple[Weighed, ...] = ()
    findings: tuple[Finding, ...] = ()
    standings: tuple[Standing, ...] = ()
    graded: Graded | None = None
    sound: bool = False

    def claiming(
        self, final: Weighed | None, findings: Sequence[Finding], standings: Sequence[Standing]
    ) -> Judgement:
        """The same search with another end, which was judged elsewhere."""
        return replace(
            self,
            single=None,
            final=final,
            field=(),
            findings=tuple(findings),
            standings=tuple(standings),
            graded=None,
        )

    @property
    def last(self) -> Weighed:
        """What the model is updated to: the final hypothesis where something is claimed of it,
        else the nuisance parameters alone."""
        return self.final if self.final is not None and self.findings else self.case.base

    @property
    def nearest(self) -> Weighed | None:
        """The hypothesis that leaves least of all that were tried."""
        tried = (*self.singles, *self.several)
        return min(tried, key=lambda w: w.hypothesis.penalised, default=None)

    @property
    def tied(self) -> tuple[Weighed, ...]:
        """Where so many hypotheses explain the recordings that none is claimed: the final one and
        its rivals."""
        if self.final is None or self.findings or not credible(self.final, self.case):
            return ()
        near = rivals(self.final, self.field, self.case)
        return (self.final, *near) if near else ()


def judge(evidence: Evidence, found: Found) -> Judgement:
    """Accept one effect, several, the nuisance parameters far off, or nothing; where nothing can be
    claimed, what all that is likely has in common."""
    decided = _decided(evidence, found, Hypothesis((), evidence.bases[-1]))
    common = median(decided.field, decided.case)
    more = [*sounder(decided.field, decided.case), *([] if common is None else [common])]
    if more:
        found = _with(found, *more)
        decided = _decided(evidence, found, decided.case.base.hypothesis)
    lower = _fitted_from(decided)
    if lower is not None:
        decided = _decided(evidence, found, lower)
    decided = _against_lighter(evidence, found, decided)
    if decided.findings or explained(decided.case.base, decided.case):
        return decided
    tried = (*decided.several, *decided.singles)
    return replace(decided, graded=graded(tried, decided.case))


def _with(found: Found, *sets: Hypothesis) -> Found:
    alone, several = by_count(sets)
    return replace(found, singles=(*found.singles, *alone), several=(*found.several, *several))


def _fitted_from(decided: Judgement) -> Hypothesis | None:
    """The nuisance parameters fitted from where they are beside what is claimed, if that leaves
    less than their own fit did: it had ended in another valley, and an effect is not to be had for
    leading out of it."""
    case, final = decided.case, decided.final
    if final is None or not decided.findings:
        return None
    rest = without(case.evidence, final.hypothesis, *range(len(final.hypothesis.effects)))
    if rest is None:
        return None
    found = refitted(case.evidence, Seed((), rest.fit.setting, rest.fit.p), "sharp")
    return found if found is not None and found.fit.misfit < case.base.fit.misfit else None


def _against_lighter(evidence: Evidence, found: Found, decided: Judgement) -> Judgement:
    """Decided anew, with those that lack one of the claimed effects, fitted from where they are
    beside it and likelier than the whole, until what is claimed stays: those of them that were
    fitted from elsewhere had ended in another valley, and no effect is to be had for leading out
    of it."""
    before: frozenset[Key] | None = None
    while decided.final is not None and decided.final.hypothesis.keys != before:
        before = decided.final.hypothesis.keys
        lighter = _lighter(decided)
        if lighter:
            found = _with(found, *lighter)
            decided = _decided(evidence, found, decided.case.base.hypothesis)
    return decided


def _lighter(decided: Judgement) -> list[Hypothesis]:
    case, final = decided.case, decided.final
    if final is None or not decided.findings or len(final.hypothesis.effects) < 2:
        return []
    every = range(len(final.hypothesis.effects))
    rests = [without(case.evidence, final.hypothesis, k) for k in every]
    near = [h for h in rests if h is not None and h.fit.misfit <= HOPELESS * EXPLAINED]
    again = [refitted(case.evidence, h.onward, "sharp") for h in near]
    most = log_odds(final, case)
    return [h for h in again if h is not None and log_odds(case.weighed(h), case) > most]


def _decided(evidence: Evidence, found: Found, base: Hypothesis) -> Judgement:
    case = Case(evidence, weighed(evidence, base), damping_only(evidence))
    singles, several = (
        tuple(case.weighed(h) for h in tried if not said_plainly(h))
        for tried in (found.singles, found.several)
    )
    clean = tuple(w for w in several if not jumbled(w.hypothesis, evidence.model))
    one = _likeliest(singles, case)
    single = one if one is not None and better(one, case.base, case) else None
    every = (*several, *singles)
    field = tuple(w for w in every if not (refuted(w, case) or saturated(w, case)))
    final = single
    for count in sorted({len(w.hypothesis.effects) for w in clean}):
        more = _likeliest([w for w in clean if len(w.hypothesis.effects) == count], case)
        if more is not None and needed(more, final, case):
            final = more
    bare = Judgement(case, singles, several, single)
    bare_of_all = final is None and not case.damping_only  # explained, yet it may be a group's
    if bare_of_all or not explained(case.base, case):
        wide = _wide(case)
        field = field if wide is None else (*field, wide)
        if wide is not None and _groups_instead(wide, final, case):
            sure = certainty_of_groups(wide, field, case)
            claimed = group_findings(wide.hypothesis, sure) if sure >= STATED else ()
            return replace(bare, final=wide, field=field, findings=claimed)
    if final is None:
        return bare
    tried = (*clean, *singles)
    final = in_common(_a_rig_instead(several, final, case), tried, field, case)
    final = in_the_middle(likelier_part(final, tried, case), tried, case)
    field = (*field, *_foretelling(every, final, case))
    standings = tuple(standing(k, final, field, case) for k in range(len(final.hypothesis.effects)))
    findings: tuple[Finding, ...] = ()
    if credible(final, case):
        findings = _findings(case, final, field, standings)
    return Judgement(case, singles, several, single, final, field, findings, standings)


def _foretelling(every: Sequence[Weighed], final: Weighed, case: Case) -> list[Weighed]:
    """Sets with as many unknowns as figures, whose fit says nothing, by which what was held out is
    strongly likelier than by the final hypothesis: nothing of that was fitted."""
    most = final.held_out + STRONG / 2.0
    full = (w for w in every if saturated(w, case) and not refuted(w, case))
    return [w for w in full if w.held_out > most]


def _likeliest(candidates: Sequence[Weighed], case: Case) -> Weighed | None:
    """Of those that rest on sizes that are there, and that what was held out does not refute as
    long as there are such; where two are as likely the one that adds less to the file's elements,
    then in the order of the search."""
    there = [w for w in candidates if sound(w.hypothesis, case.evidence)]
    held = [w for w in there if not refuted(w, case)]

    def rank(w: Weighed) -> tuple[float, int]:
        added = sum(e.change is not None and not e.change.members for e in w.hypothesis.effects)
        return round(log_odds(w, case), 3), -added

    return max(held or there, key=rank, default=None)


def _wide(case: Case) -> Weighed | None:
    """Nuisance parameters far beyond their scatter, where they explain."""
    if not {"stiffness_change", "mass_change"} & set(case.evidence.names):
        return None
    try:
        h = Hypothesis((), case.evidence.wide())
    except CvxupdateError:
        return None
    wide = case.weighed(h, len(loose_groups(h)))
    good = wide.freed > 0 and explained(wide, case) and better(wide, case.base, case)
    return wide if good else None


def _a_rig_instead(several: Sequence[Weighed], final: Weighed, case: Case) -> Weighed:
    """Several things that a rig does, where they alone are likelier than what was decided with
    something sought among it."""
    if only_a_rig(final.hypothesis):
        return final
    alone = _likeliest([w for w in several if only_a_rig(w.hypothesis)], case)
    if alone is None or not needs_several(alone, None, case):
        return final
    return alone if log_odds(alone, case) > log_odds(final, case) else final


def _groups_instead(wide: Weighed, final: Weighed | None, case: Case) -> bool:
    """Whether wrong numbers of groups are likelier than the effects found."""
    if final is None or not credible(final, case):
        return True
    return log_odds(wide, case) > log_odds(final, case)


def _findings(
    case: Case, final: Weighed, field: Sequence[Weighed], standings: Sequence[Standing]
) -> tuple[Finding, ...]:
    """The effects whose place is likelier than not, strongest first."""
    h = final.hypothesis
    near = rivals(final, field, case)
    behind = [float(np.exp(log_odds(final, case) - log_odds(w, case))) for w in near]
    parts = parts_of(case, final)
    out = []
    told = in_time(case, final, [k for k, s in enumerate(standings) if s.told], parts)
    for k in sorted(told, key=lambda k: -parts[k]):
        effect, figures = h.effects[k], h.figures[k]
        same = equivalents(effect, h, [w.hypothesis for w in near])
        alike = case.evidence.alike(final.fit, effect)
        untold = standings[k].untold
        pairs = [(w.hypothesis, b) for w, b in zip(near, behind, strict=True)]
        spread = spread_over(k, h, alike, pairs)
        if case.evidence.file is not None:
            spread = of_a_change(effect, figures, spread)
        finding = Finding.of(
            effect,
            figures.values,
            spread,
            standings[k].confidence,
            noise=figures.noise,
            explains=parts[k],
            equivalent=(*(e for e, _ in same), *untold),
            behind=(*(behind[i] for _, i in same), *(1.0 for _ in untold)),
        )
        out.append(finding)
    return tuple(out)
