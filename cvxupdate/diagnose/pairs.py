"""Two effects at once: a second one beside each of the best first ones, then each of the two
exchanged in turn.

The best single effect need not be one of the true two, so none is kept for good: several are tried
as the first, and each half of the best pair is sought again with the other half in place
(backfitting; Hastie, Tibshirani and Friedman 2009, 9.1).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from cvxupdate.diagnose.effects import (
    Bench,
    Hypothesis,
    Trial,
    planted,
    unbent,
    without,
)
from cvxupdate.diagnose.fit import at_level
from cvxupdate.diagnose.refit import CLEAR, Tell, charged, entered, raced
from cvxupdate.diagnose.screen import Score, left_over, screen
from cvxupdate.diagnose.shortlist import Key, best_of, members, shortlist, unsized
from cvxupdate.diagnose.signals import Signal
from cvxupdate.diagnose.sized import sized, sized_sets, sized_whole
from cvxupdate.errors import ModelError
from cvxupdate.physics import Effect

ROUNDS = 6  # halves exchanged at most
# times the best single effect's misfit: a half that leaves more as it stands is nothing without the
# other
ALONE = 100.0
SECONDS, EACH = (
    12,
    4,
)  # of each list beside a first, and of a word in it: neighbours of the true place look alike
PARTNERS = 6  # of those that are refitted: carried on
WHOLES, WHOLE = (
    6,
    3,
)  # words on whole members that are tried at several sizes, and refitted beside a first
MOVES = 2  # best single effects in whose stead others are sought
# times the best single effect's misfit: further behind, none is tried as a first, or in its stead
CLOSE = 4.0
COARSE, FINE = 1, (2, 3)  # levels of the search, and of the race of the best
KIN = 6  # that may stand in an effect's stead
FINAL = (4, 3)


def beside(
    bench: Bench, parent: Trial, also: Collection[Key] = (), level: int = COARSE
) -> list[Hypothesis]:
    """What is worth a refit beside a fitted parent: what shows there to first order; and what shows
    at several sizes beside its effects alone, with ordinary parameters as in the drawing (``also``:
    these too, however little they show). The refits are to begin at ``level``."""
    candidates = bench.candidates(parent.fit.setting.model)
    near = shortlist(screen(parent.fit.point, candidates), SECONDS)
    fresh = unbent(bench, parent, bench.data.levels[0])
    point = fresh.fit.point
    left = left_over(point)
    first = screen(point, candidates, left)
    exact = best_of((sized(point, first, left), sized_sets(point, first, left)))
    signals = bench.data.levels[level]
    whole = [
        planted_or_none(bench, fresh, score, bench.data.levels[0])
        for score in unsized(members(first), exact)[:WHOLES]
    ]
    ranked = sorted(
        (sized_whole(point, h, left) for h in whole if h is not None), key=lambda pair: -pair[1]
    )
    chosen = [*shortlist(exact, SECONDS, EACH), *(s for s in exact if s.candidate.key in also)]
    some = [
        *(planted_or_none(bench, fresh, s, signals) for s in chosen),
        *(planted_or_none(bench, parent, s, signals) for s in near),
    ]
    return [
        h
        for h in (
            *some,
            *(replace(h, setting=at_level(h.setting, signals)) for h, _ in ranked[:WHOLE]),
        )
        if h is not None
    ]


def planted_or_none(
    bench: Bench, parent: Trial, score: Score, signals: Sequence[Signal]
) -> Hypothesis | None:
    """A further effect on a fitted parent, to be refitted against ``signals``; None where it cannot
    stand there."""
    try:
        return planted(bench, parent, score, signals)
    except ModelError:
        return None


def moved(bench: Bench, singles: Sequence[Trial], tell: Tell) -> list[Trial]:
    """Single effects sought again where the best ones stand: at their fits, with ordinary
    parameters no longer bent by the mismatch.

    Each of the best is taken out and sought again, or left free to shrink, and what would explain
    the rest beside it is refitted in its stead. Returns all, best first.
    """
    pool = {t.keys: t for t in singles}
    tried = set(pool)
    for parent in [t for t in singles if charged(t) <= CLOSE * charged(singles[0])][:MOVES]:
        rest = without(bench, parent, 0)
        if rest is not None:
            tell(f"seeking in place of {parent.name}")
            _refit(bench, beside(bench, rest, kin(bench, parent)), pool, tried, tell)
    return sorted(pool.values(), key=charged)[: len(singles) + PARTNERS]


def kin(bench: Bench, parent: Trial) -> list[Key]:
    """What would explain more beside a fitted trial, to first order: it may stand in the stead of
    one of its effects."""
    ranked = screen(parent.fit.point, bench.candidates(parent.fit.setting.model))
    return [s.candidate.key for s in shortlist(ranked, KIN, KIN)]


def _refit(
    bench: Bench,
    hypotheses: Sequence[Hypothesis],
    pool: dict[frozenset[Key], Trial],
    tried: set[frozenset[Key]],
    tell: Tell,
) -> None:
    """Enter what was not tried yet; the best go on to the level of the search, into the pool."""
    fresh = [h for h in hypotheses if h.keys not in tried and len(h.keys) == len(h.effects)]
    tried.update(h.keys for h in fresh)
    for t in raced(bench, entered(bench, fresh, tell), (COARSE,), (PARTNERS,), tell):
        pool[t.keys] = t


def pairs(bench: Bench, singles: Sequence[Trial], tell: Tell, parents: int) -> list[Trial]:
    """The best pairs of effects, sharpened, best first; ``singles`` are fitted trials of one
    effect, best first, of which ``parents`` are firsts."""
    pool: dict[frozenset[Key], Trial] = {}
    tried: set[frozenset[Key]] = set()
    halves: set[frozenset[Key]] = set()
    for parent in [t for t in singles if charged(t) <= CLOSE * charged(singles[0])][:parents]:
        tell(f"seeking beside {parent.name}")
        _refit(bench, beside(bench, parent), pool, tried, tell)
        if pool and min(t.fit.excess for t in pool.values()) <= CLEAR:
            break  # others that would do as well are found by the exchange of halves
    for _ in range(ROUNDS):
        found = _half_to_try(bench, pool, halves, ALONE * charged(singles[0]))
        if found is None:
            break
        whole, half = found
        tell(f"seeking beside {half.name} again")
        _refit(bench, beside(bench, half, kin(bench, whole)), pool, tried, tell)
    return raced(bench, list(pool.values()), FINE, FINAL, tell)


def simpler(bench: Bench, pair: Trial, tell: Tell) -> list[Trial]:
    """What one effect does from where two ended, sharpened: each of them alone, and the same word
    twice as once on both sets together."""
    rests = [without(bench, pair, index) for index in range(len(pair.effects))]
    begun = [
        Hypothesis(r.effects, at_level(r.fit.setting, bench.data.levels[COARSE]), r.fit.p)
        for r in rests
        if r is not None
    ]
    together = _together(bench, pair, rests[-1])
    found = entered(bench, [*begun, *([] if together is None else [together])], tell)
    return raced(bench, found, (COARSE, *FINE), (len(found), *FINAL), tell)


def _together(bench: Bench, pair: Trial, first: Trial | None) -> Hypothesis | None:
    """Both sets of elements of one word as one place (a run, a patch, a group), where the catalogue
    has it."""
    a, b = (e.candidate for e in pair.effects)
    bare = (
        None
        if first is None or a.physics != b.physics or not (_members(a) and _members(b))
        else without(bench, first, 0)
    )
    if bare is None:
        return None
    union = sorted({*_members(a), *_members(b)})
    whole = next(
        (
            c
            for c in bench.candidates(bare.fit.setting.model, (a.physics,))
            if sorted(_members(c)) == union
        ),
        None,
    )
    sizes = pair.fit.p[len(bench.ordinary.parameters) :][: a.count]
    return (
        None
        if whole is None
        else planted(bench, bare, Score(whole, 1.0, sizes), bench.data.levels[COARSE])
    )


def _members(e: Effect) -> tuple[int, ...]:
    return () if e.change is None else e.change.members


def _half_to_try(
    bench: Bench, pool: dict[frozenset[Key], Trial], tried: set[frozenset[Key]], most: float
) -> tuple[Trial, Trial] | None:
    """The best pair and a half of it that has not been tried yet, the other half taken out; None
    where there is none.

    A half that alone leaves more than ``most`` is not: the other one carries all.
    """
    if not pool:
        return None
    best = min(pool.values(), key=charged)
    for index in range(len(best.effects)):
        rest = frozenset(e.key for k, e in enumerate(best.effects) if k != index)
        if rest not in tried:
            tried.add(rest)
            half = without(bench, best, index)
            if half is not None and charged(half) <= most:
                return best, half
    return None
