"""A finding against placebos: the same procedure on every other effect and place, and how often one
of them does as well by luck."""

from __future__ import annotations

from dataclasses import dataclass

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.alternatives import has
from cvxupdate.diagnose.search.search import Found
from cvxupdate.physics.units import number


@dataclass(frozen=True)
class Placebo:
    """``tried`` effects at places elsewhere, ``refitted`` of them and the others to first order;
    ``left``: the least misfit that one of these left, as a fraction of the nuisance parameters'
    alone; ``mine``: the same of the finding; ``as_good``: how many leave no more; ``asked``: of
    what, in words, where it is not of the recordings themselves."""

    tried: int
    refitted: int
    left: float
    mine: float
    as_good: int
    asked: str = ""

    @property
    def chance(self) -> float:
        """The rank test's level (Phipson and Smyth 2010)."""
        return (1 + self.as_good) / (1 + self.tried)

    @property
    def says(self) -> str:
        """One line of evidence."""
        good = self.as_good
        left, mine = (number(100.0 * part, 2) for part in (self.left, self.mine))
        rank = (
            "none of these does as well"
            if good == 0
            else f"{good} of these {'does' if good == 1 else 'do'} as well or better"
        )
        return (
            f"Check against luck{self.asked}: {self.tried} other effects and places were tried "
            f"in the same way ({self.refitted} of them fitted in full). "
            f"In mean square the best of them leaves "
            f"{left} % of the mismatch, what was found {mine} %: "
            f"{rank} (luck alone would come so far once in {1.0 / self.chance:.0f} times)."
        )


def placebo(final: Weighed, found: Found, case: Case, asked: str = "") -> Placebo | None:
    """The finding's improvement among those of all else; None where only the pattern of damping was
    at stake, or nothing else was tried."""
    model, base = case.evidence.model, case.base.fit.misfit
    effects = final.hypothesis.effects
    if case.damping_only or base <= 0.0 or not effects:
        return None

    def elsewhere(h: Hypothesis) -> bool:
        return not any(has(h, e, model) for e in effects)

    full = {h.keys: left for h, left in found.entries if elsewhere(h)}
    full |= {h.keys: h.fit.misfit / base for h in (*found.singles, *found.several) if elsewhere(h)}
    places = [e.place for e in effects]
    rest = [
        1.0 - s.fraction
        for s in found.scores
        if s.effect.place not in places and frozenset((s.effect.key,)) not in full
    ]
    if not full and not rest:
        return None
    mine = final.fit.misfit / base
    as_good = sum(left <= mine for left in (*full.values(), *rest))
    tried = len(full) + len(rest)
    return Placebo(tried, len(full), min([*full.values(), *rest]), mine, as_good, asked)
