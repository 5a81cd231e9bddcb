"""What responses leave open, once more by the modes in them.

A light resonance is narrower than a real structure is off from its model (a sensor beside its node,
a lump off the axis): with all that is missing found, responses still differ by a third. Natural
frequencies and shapes do not care. What they tell the search goes on from; where it ends with
nothing, that is claimed if it halves what nuisance parameters leave, fitted and held out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from cvxupdate.diagnose.budget import most_sure
from cvxupdate.diagnose.hypothesis import Hypothesis, without
from cvxupdate.diagnose.judge.acceptance import (
    Case,
    Weighed,
    better,
    explained,
    halved,
    refuted,
    weighed,
)
from cvxupdate.diagnose.judge.agreement import as_large, both, needed, same
from cvxupdate.diagnose.judge.channels import apart, beside, with_gains
from cvxupdate.diagnose.judge.confidence import standing
from cvxupdate.diagnose.judge.judge import Judgement, judge
from cvxupdate.diagnose.judge.pattern import pattern_of
from cvxupdate.diagnose.judge.placebo import Placebo, placebo
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.judge.soundness import sound
from cvxupdate.diagnose.results import Finding, Further
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.search.search import Found, search
from cvxupdate.diagnose.settings import EXPLAINED, STAYING
from cvxupdate.diagnose.types import Evidence, Progress

LOOKED = "the natural frequencies and mode shapes identified from the responses"


@dataclass(frozen=True)
class ByModes:
    """The modes in the recordings of ``evidence``, looked into when they are first asked for."""

    evidence: Evidence
    progress: Progress

    @cached_property
    def _searched(self) -> tuple[Judgement, Found] | None:
        seen = None if self.evidence.hurried else self.evidence.by_modes()
        if seen is None:
            return None
        found = search(seen, lambda text: self.progress(f"by the modes: {text}"))
        return judge(seen, found), found

    @cached_property
    def told(self) -> Judgement | None:
        """The judgement of them; None where recordings are not to be seen so, or time is over
        before anybody asks."""
        searched = self._searched
        return None if searched is None else searched[0]

    @property
    def _looked(self) -> Judgement | None:
        """What they `told`, if that was asked for."""
        told = self.__dict__.get("told")
        return told if isinstance(told, Judgement) else None

    @property
    def sham(self) -> Placebo | None:
        """What they tell among all else that was tried on them; None where they tell nothing."""
        told, found = self._searched or (None, Found())
        if told is None or told.final is None or not told.findings:
            return None
        return placebo(told.final, found, told.case, " (by the modes in the responses)")

    @property
    def sure(self) -> bool:
        """Whether they tell something, time having ended nothing."""
        told = self.told
        return told is not None and bool(told.findings) and not told.case.evidence.unfinished

    @cached_property
    def calm(self) -> bool:
        """Whether the usual scatter explains them, gains of channels aside, and nothing speaks
        against that, time having ended nothing."""
        return self._scatter and self._undisputed

    @property
    def met(self) -> bool:
        """Whether modal constants, held out too, are then those of the model as well."""
        return self.calm and self.further.met and not self.further.gains

    @cached_property
    def damper(self) -> Finding | None:
        """The damper that damping ratios and imaginary parts of the shapes tell where the usual
        scatter explains the modes else; None where there is none."""
        if not self._scatter or self.further.gains:
            return None
        return next(iter(pattern_of(self.further).findings), None)

    @property
    def _scatter(self) -> bool:
        """Whether the usual scatter explains their frequencies and shapes, time having ended
        nothing."""
        told = self.told
        if told is None or told.findings or told.case.evidence.unfinished:
            return False
        return explained(told.case.base, told.case)

    @property
    def settled(self) -> bool:
        """Whether modal constants, fitted and held out, bear out what they tell, and nothing speaks
        for more."""
        return self.sure and self.further.borne_out and self._undisputed

    @property
    def _undisputed(self) -> bool:
        """Whether their shapes are real and their damping ratios as they usually scatter."""
        pattern = pattern_of(self.further)
        return not (self.further.against or pattern.findings or pattern.unsure)

    @cached_property
    def likely(self) -> list[Hypothesis]:
        """The likeliest sets of effects, the one that is told first."""
        told = self.told
        if told is None:
            return []
        evidence = told.case.evidence
        tried = [w for w in (*told.several, *told.singles) if sound(w.hypothesis, evidence)]
        ranked = sorted(tried, key=lambda w: -log_odds(w, told.case))
        first = [] if told.final is None else [told.final]
        return [w.hypothesis for w in [*first, *(w for w in ranked if w not in first)][:STAYING]]

    def tells(self, h: Hypothesis) -> bool:
        """Whether a set has all that they tell, in whatever form."""
        told = self.told
        if told is None or not told.findings:
            return False
        return all(any(same(e, f) for e in h.effects) for f in told.findings)

    def instead(self, judgement: Judgement) -> Judgement:
        """Of a judgement that claims nothing what they tell and its hypotheses confirm; else what
        all that is likely by them has in common. Where they lack nothing (`met`), what responses
        claim has to explain all that these have: sensors beside their nodes are like an effect."""
        if judgement.findings and judgement.last.fit.misfit > EXPLAINED and self.met:
            judgement = judgement.claiming(None, (), ())
        told = None if judgement.findings else self.told
        if told is None or explained(judgement.case.base, judgement.case):
            return judgement
        gains = self.further.gains if explained(told.last, told.case) else ()
        damped = self._damped(judgement)
        if damped is not None:
            return damped
        found = with_gains(self._claimed(judgement, told), told.last.hypothesis, gains)
        return found if found.findings else replace(found, sound=self._sound(judgement))

    @cached_property
    def further(self) -> Further:
        """What they say beside their search."""
        told = self.told
        return Further() if told is None else told.case.evidence.further(told.last.fit)

    def _sound(self, judgement: Judgement) -> bool:
        """Whether nothing is missing by the modes, and the responses know nothing better, or modal
        constants, held out too, are the model's: better is then what sensors off nodes bend."""
        if not self.calm or self.further.gains:
            return False
        case = judgement.case
        tried = (*judgement.several, *judgement.singles)
        return self.met or not any(better(w, case.base, case) for w in tried)

    def _damped(self, judgement: Judgement) -> Judgement | None:
        """With their `damper`, if the responses confirm it."""
        case = judgement.case
        for w in judgement.singles if self.damper else ():
            found = None if refuted(w, case) else self._as_damper(w, case)
            if found is not None:
                return judgement.claiming(w, [found], [standing(0, w, judgement.field, case)])
        return None

    def damps(self, singles: Sequence[Hypothesis]) -> bool:
        """Whether one of the ``singles`` on the responses is their `damper`, and confirmed."""
        if self.damper is None:
            return False
        base = weighed(self.evidence, Hypothesis((), self.evidence.bases[-1]))
        case = Case(self.evidence, base, False)
        return any(self._as_damper(case.weighed(h), case) for h in singles)

    def _as_damper(self, w: Weighed, case: Case) -> Finding | None:
        """A single effect as their `damper`: what is beyond noise is halved by it alone, fitted and
        held out, and it is about as large; else None."""
        (effect,), (figures,), told = w.hypothesis.effects, w.hypothesis.figures, self.damper
        if told is None or not (same(effect, told) and as_large(told, effect, figures)):
            return None
        return both(told, effect, figures) if halved(w, case.base, case) else None

    def _claimed(self, judgement: Judgement, told: Judgement) -> Judgement:
        """With what they tell and the responses confirm."""
        final = self._confirmed(judgement)
        here = () if final is None else self._here(final)
        if final is None or not here:
            by_constants = self._borne_out(judgement, told) if self.further.borne_out else None
            return by_constants or replace(judgement, graded=judgement.graded or told.graded)
        own = () if told.final is None else told.final.hypothesis.effects
        known = {(e.physics, e.place): s for e, s in zip(own, told.standings, strict=True)}
        stands = [
            known.get((e.physics, e.place)) or standing(k, final, judgement.field, judgement.case)
            for k, e in enumerate(final.hypothesis.effects)
        ]
        most = most_sure(self.evidence.unfinished)
        claimed = [replace(f, confidence=min(f.confidence, most)) for f in here]
        return judgement.claiming(final, claimed, stands)

    def _borne_out(self, judgement: Judgement, told: Judgement) -> Judgement | None:
        """What they tell and modal constants bear out, as they tell it; None where nothing was held
        out and the responses differ by more with it, nuisance parameters being those of the modes.

        Near light resonances that says little: which model's are nearest is chance.
        """
        case = judgement.case
        bare = carried(case.evidence, told.case.base.hypothesis)
        h = carried(case.evidence, told.last.hypothesis)
        if h is None or bare is None or not told.findings:
            return None
        if not self.further.foretold:
            pair = (beside(case, x, self.further.gains) for x in (h, bare))
            with_it, without_it = (apart(case.evidence, x) for x in pair)
            if with_it >= without_it:
                return None
        return judgement.claiming(case.weighed(h), told.findings, told.standings)

    def _confirmed(self, judgement: Judgement) -> Weighed | None:
        """The nearest hypothesis on the responses that has all that the modes tell, and that what
        was fitted and what was held out speak for; None where there is none."""
        case = judgement.case
        tried = (*judgement.several, *judgement.singles)
        whole = [w for w in tried if self.tells(w.hypothesis) and better(w, case.base, case)]
        return min(whole, key=lambda w: w.hypothesis.penalised, default=None)

    def _here(self, final: Weighed) -> tuple[Finding, ...]:
        """What the modes tell that the responses have as well, about as large, and cannot do
        without: with it taken out, twice as much is left, fitted or held out."""
        told, h = self.told, final.hypothesis
        out = []
        for finding in () if told is None else told.findings:
            k = next(k for k, e in enumerate(h.effects) if same(e, finding))
            rest = without(self.evidence, h, k)
            if needed(self.evidence, rest, final) and as_large(finding, h.effects[k], h.figures[k]):
                out.append(both(finding, h.effects[k], h.figures[k]))
        return tuple(out)

    def lines(self, first: Judgement, judgement: Judgement) -> list[str]:
        """What they say, for the reader, where the ``first`` judgement became another."""
        told = self._looked
        if told is None:
            return []
        seen, base = told.case.evidence, told.case.base
        claimed = bool(judgement.findings) and not first.findings
        if claimed and self.damper is not None:
            return [
                f"This is told by {LOOKED}: the usual scatter leaves {seen.left(base.errors)}, and "
                "damping ratios and imaginary parts of the shapes, which damping at a place turns "
                "against the rest, are those that it makes; the responses confirm it, and its size "
                "is halfway between what both say."
            ]
        if claimed and not told.findings:
            return [
                f"This is told by the modal constants that were identified from the responses: "
                "they are off by one factor in all modes, and without it the usual scatter "
                f"explains them and {LOOKED}."
            ]
        if claimed and self._as_told(judgement):
            return [
                f"This is told by {LOOKED}, of which it leaves {seen.left(told.last.errors)}; "
                "their modal constants, fitted and held out, to which nothing was fitted, bear it "
                "out. The responses themselves do not tell it: a light resonance is narrower than "
                "a real structure is near its model."
            ]
        if claimed:
            return [
                f"This is told by {LOOKED}, of which it leaves {seen.left(told.last.errors)}; the "
                "responses confirm it, and its size is halfway between what both say. What they "
                "still differ by may be no more than a sensor beside its node: a real structure is "
                "further from its model than a light resonance is wide."
            ]
        if not judgement.findings and explained(base, told.case):
            return [
                f"{LOOKED.capitalize()} are explained by the usual scatter alone, which leaves "
                f"{seen.left(base.errors)}: whatever else the responses have moves neither of them."
                f" {self.further.against}".rstrip()
            ]
        return []

    def _as_told(self, judgement: Judgement) -> bool:
        """Whether what is claimed is what they tell, as they tell it."""
        said = [] if self.told is None else [f.says for f in self.told.findings]
        return self.further.borne_out and any(f.says in said for f in judgement.findings)
