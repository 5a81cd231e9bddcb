"""A finding against placebos: the same procedure on every other word and place, and how often one
of them does as well by luck."""

from __future__ import annotations

from dataclasses import dataclass

from cvxupdate.diagnose.effects import Trial
from cvxupdate.diagnose.engine import Outcome
from cvxupdate.diagnose.judge import Judged, has


@dataclass(frozen=True)
class Placebo:
    """``tried`` words at places elsewhere, ``refitted`` of them and the others to first order;
    ``left``: the least misfit that one of these left, as a share of the ordinary model's; ``mine``:
    the same for the finding; ``chance``: (1 + those as good) / (1 + tried), the rank test's level
    (Phipson and Smyth 2010)."""

    tried: int
    refitted: int
    left: float
    mine: float
    chance: float

    @property
    def says(self) -> str:
        """One line of evidence."""
        return (
            f"Placebo: {self.tried} other words and places went through the same procedure "
            f"({self.refitted} of them refitted); the best leaves {100 * self.left:.2g} % of "
            f"the misfit, this leaves {100 * self.mine:.2g} %. Chance of so large an "
            f"improvement by luck: {self.chance:.2g}."
        )


def placebo(final: Judged, outcome: Outcome) -> Placebo | None:
    """The finding's improvement among those of all else; None where only the pattern of damping was
    at stake, or nothing else was tried."""
    model, base = outcome.bench.ordinary, outcome.base.misfit
    if outcome.pattern or base <= 0.0:
        return None

    def elsewhere(t: Trial) -> bool:
        return not any(has(t, e, model) for e in final.trial.effects)

    full = {t.keys: left for t, left in outcome.entered if elsewhere(t)}
    full |= {t.keys: t.fit.misfit / base for t in (*outcome.trials, *outcome.pairs) if elsewhere(t)}
    places = [e.candidate.place for e in final.trial.effects]
    rest = [
        1.0 - s.share
        for s in outcome.screened
        if s.candidate.place not in places and frozenset((s.candidate.key,)) not in full
    ]
    if not full and not rest:
        return None
    mine = final.misfit / base
    as_good = sum(left <= mine for left in (*full.values(), *rest))
    return Placebo(
        len(full) + len(rest),
        len(full),
        min([*full.values(), *rest]),
        mine,
        (1 + as_good) / (1 + len(full) + len(rest)),
    )
