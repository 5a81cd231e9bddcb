"""Two effects at once: a second one beside each of the best first ones, then each of the two exchanged in turn.

The best single effect need not be one of the true two, so none is kept for good: several are tried as the first, and each half of the best pair
is sought again with the other half in place (backfitting; Hastie, Tibshirani and Friedman 2009, 9.1).
"""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.effects import Bench, Key, Trial, planted, without
from cvxupdate.diagnose.refit import Tell, charged, entered, raced
from cvxupdate.diagnose.screen import screen
from cvxupdate.diagnose.shortlist import shortlist
from cvxupdate.errors import ModelError

PARENTS, PARTNERS, ROUNDS = 5, 5, 6  # firsts tried, seconds refitted beside each, halves exchanged at most
CLOSE = 4.0  # times the best single effect's misfit: further behind, none is tried as a first
COARSE, FINE = 1, (2, 3)  # levels of the search, and of the race of the best
FINAL = (4, 3)


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
