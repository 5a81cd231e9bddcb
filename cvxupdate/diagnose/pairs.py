"""Two effects at once: a second one beside each of the best first ones, then each of the two exchanged in turn.

The best single effect need not be one of the true two, so none is kept for good: several are tried as the first, and each half of the best pair
is sought again with the other half in place (backfitting; Hastie, Tibshirani and Friedman 2009, 9.1).
"""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.effects import Bench, Hypothesis, Key, Trial, on_model, planted, without
from cvxupdate.diagnose.fit import at_level
from cvxupdate.diagnose.refit import Tell, charged, entered, raced
from cvxupdate.diagnose.screen import Score, screen
from cvxupdate.diagnose.shortlist import shortlist
from cvxupdate.errors import ModelError

PARENTS, PARTNERS, ROUNDS = 5, 5, 6  # firsts tried, seconds refitted beside each, halves exchanged at most
MOVES = 3  # best single effects in whose stead others are sought
CLOSE = 4.0  # times the best single effect's misfit: further behind, none is tried as a first
COARSE, FINE = 1, (2, 3)  # levels of the search, and of the race of the best
FINAL = (4, 3)


def moved(bench: Bench, singles: Sequence[Trial], tell: Tell) -> list[Trial]:
    """Single effects sought again where the best ones stand: at their fits, with ordinary parameters no longer bent by the mismatch.

    Each of the best is left free to shrink, and what would explain the rest beside it is refitted in its stead. Returns all, best first.
    """
    pool = {t.keys: t for t in singles}
    for parent in list(singles[:MOVES]):
        rest = without(bench, parent, 0)
        if rest is None:
            continue
        tell(f"screening in place of {parent.name}")
        kin = screen(parent.fit.point, bench.candidates(parent.fit.setting.model))
        for score in shortlist(kin, PARTNERS, PARTNERS):
            again = stand_in(bench, rest, score)
            if again is None or again.keys in pool:
                continue
            found = entered(bench, again, tell)
            if found is not None:
                pool[found.keys] = found
    return sorted(pool.values(), key=charged)[: len(singles) + PARTNERS]


def stand_in(bench: Bench, rest: Trial, score: Score) -> Hypothesis | None:
    """A candidate of another model planted on ``rest`` (no effects) instead, at the size it would have beside the other."""
    c = on_model(bench, rest.fit.setting.model, score.candidate)
    if c is None:
        return None
    try:
        return planted(bench, rest, Score(c, score.share, score.p), bench.data.levels[COARSE])
    except ModelError:
        return None


def pairs(bench: Bench, singles: Sequence[Trial], tell: Tell) -> list[Trial]:
    """The best pairs of effects, sharpened, best first; ``singles`` are fitted trials of one effect, best first."""
    pool: dict[frozenset[Key], Trial] = {}
    halves: set[frozenset[Key]] = set()
    for parent in [t for t in singles if charged(t) <= CLOSE * charged(singles[0])][:PARENTS]:
        _expand(bench, parent, pool, tell)
    for _ in range(ROUNDS):
        half = _half_to_try(bench, pool, halves)
        if half is None:
            break
        _expand(bench, half, pool, tell)
    return raced(bench, list(pool.values()), FINE, FINAL, tell)


def simpler(bench: Bench, pair: Trial, tell: Tell) -> list[Trial]:
    """What one effect does from where two ended, sharpened: each of them alone, and the same word twice as once on both sets together."""
    rests = [without(bench, pair, index) for index in range(len(pair.effects))]
    begun = [Hypothesis(r.effects, at_level(r.fit.setting, bench.data.levels[COARSE]), r.fit.p) for r in rests if r is not None]
    together = _together(bench, pair, rests[-1])
    found = [entered(bench, h, tell) for h in (*begun, *([] if together is None else [together]))]
    return raced(bench, [t for t in found if t is not None], FINE, FINAL, tell)


def _together(bench: Bench, pair: Trial, first: Trial | None) -> Hypothesis | None:
    """Both sets of elements of one word as one place (a run, a patch, a group), where the catalogue has it."""
    a, b = (e.candidate for e in pair.effects)
    bare = None if first is None or a.physics != b.physics or not (a.members and b.members) else without(bench, first, 0)
    if bare is None:
        return None
    union = sorted({*a.members, *b.members})
    whole = next((c for c in bench.candidates(bare.fit.setting.model, (a.physics,)) if sorted(c.members) == union and c.model is not None), None)
    sizes = pair.fit.p[len(bench.ordinary.parameters) :][: a.extra]
    return None if whole is None else planted(bench, bare, Score(whole, 1.0, sizes), bench.data.levels[COARSE])


def _expand(bench: Bench, parent: Trial, pool: dict[frozenset[Key], Trial], tell: Tell) -> None:
    """Refit the most promising seconds beside ``parent`` into the pool."""
    tell(f"screening beside {parent.name}")
    ranked = screen(parent.fit.point, bench.candidates(parent.fit.setting.model))
    for score in shortlist(ranked, PARTNERS, 2):
        try:
            hypothesis = planted(bench, parent, score, bench.data.levels[COARSE])
        except ModelError:
            continue
        if hypothesis.keys in pool or len(hypothesis.keys) < len(hypothesis.effects):
            continue
        found = entered(bench, hypothesis, tell)
        if found is not None:
            pool[found.keys] = found


def _half_to_try(bench: Bench, pool: dict[frozenset[Key], Trial], tried: set[frozenset[Key]]) -> Trial | None:
    """A half of the best pair that has not been tried yet, the other half taken out."""
    if not pool:
        return None
    best = min(pool.values(), key=charged)
    for index in range(len(best.effects)):
        rest = frozenset(e.key for k, e in enumerate(best.effects) if k != index)
        if rest not in tried:
            tried.add(rest)
            half = without(bench, best, index)
            if half is not None:
                return half
    return None
