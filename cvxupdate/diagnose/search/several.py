"""Several effects at once: a further one beside each of the best first ones, then each exchanged
in turn.

The best single effect need not be one of the true two, so none is kept for good: several are tried
as the first, and each of the best set is sought again with the others in place (backfitting;
Hastie, Tibshirani and Friedman 2009, 9.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from cvxupdate.diagnose.hypothesis import Hypothesis, only_a_rig, seed_from, without
from cvxupdate.diagnose.search.beside import alternatives_to, beside
from cvxupdate.diagnose.search.race import entered, raced
from cvxupdate.diagnose.settings import (
    ALONE,
    CLOSE,
    EXPLAINED,
    FINE,
    FINE_SEVERAL,
    HALVED,
    HOPELESS,
    MOVES,
    PARTNERS,
    PENALTY,
    RIG_PARENTS,
    ROUNDS,
    SEVERAL_LEVEL,
    SPARE,
    STAYING,
)
from cvxupdate.diagnose.types import Evidence, Key, Progress, Score, Seed
from cvxupdate.physics.effect import MODES, MOTION

INSTEAD = "other effects at the places of the best single ones"
SETS, MORE = "pairs of effects (some or all)", "sets of three effects and more"


@dataclass
class Pool:
    """Hypotheses that were refitted together, of each the best fit; ``settled`` are not begun
    again, nor anything where it was ``begun`` before."""

    evidence: Evidence
    progress: Progress
    found: dict[frozenset[Key], Hypothesis] = field(default_factory=dict)
    settled: set[frozenset[Key]] = field(default_factory=set)
    begun: set[tuple[frozenset[Key], bytes]] = field(default_factory=set)

    def refit(self, seeds: Sequence[Seed]) -> None:
        """Enter them; the best go on to the level of the search. What was entered before is once
        more: beside another fit it begins elsewhere, and where it got stuck says nothing of it."""
        own = [s for s in seeds if s.keys not in self.settled and len(s.keys) == len(s.effects)]
        own = [s for s in own if (s.keys, s.start.tobytes()) not in self.begun]
        self.begun.update((s.keys, s.start.tobytes()) for s in own)
        entries = entered(self.evidence, own, self.progress)
        for h in raced(self.evidence, entries, ((SEVERAL_LEVEL, PARTNERS),), self.progress):
            known = self.found.get(h.keys)
            if known is None or h.penalised < known.penalised:
                self.found[h.keys] = h

    @property
    def clear(self) -> bool:
        """Whether one of them leaves nothing."""
        return any(self.evidence.clear(h.fit) for h in self.found.values())

    @property
    def best(self) -> Hypothesis | None:
        """The best so far."""
        return min(self.found.values(), key=lambda h: h.penalised, default=None)


def in_their_place(
    evidence: Evidence, singles: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Single effects sought again where the best ones stand: at their fits, with nuisance
    parameters no longer bent by the mismatch. All, best first. Not in motions, where each look
    takes as long as all pairs with a law, of which none comes near alone."""
    if evidence.told_by == MOTION:
        return list(singles)
    known = {h.keys: h for h in singles}
    pool = Pool(evidence, progress, known, set(known))
    for parent in _close(singles)[:MOVES]:
        if evidence.hurried:
            evidence.leave(INSTEAD)
            break
        rest = without(evidence, parent, 0)
        if rest is not None:
            progress(f"seeking in place of {parent.name}")
            pool.refit(beside(evidence, rest, alternatives_to(evidence, parent)))
    ranked = sorted(pool.found.values(), key=lambda h: h.penalised)
    return ranked[: len(singles) + PARTNERS]


def _close(singles: Sequence[Hypothesis]) -> list[Hypothesis]:
    return [h for h in singles if h.penalised <= CLOSE * singles[0].penalised]


def pairs(
    evidence: Evidence,
    singles: Sequence[Hypothesis],
    parents: int,
    progress: Progress,
    instead: Hypothesis | None = None,
) -> list[Hypothesis]:
    """The best pairs of effects, sharpened, best first; ``singles`` are fitted, best first, of
    which ``parents`` are firsts. One that leaves nothing is as it is: others that do as well are
    found by the exchange at its fit (`cvxupdate.diagnose.search.exchange`); nor are they where all
    are left far behind a set ``instead`` of which they may stand. Tables of modes are
    also sought beside what a rig may do, whatever came first: hardly a test is without, and by
    itself it explains little."""
    pool, near = Pool(evidence, progress), _close(singles)[:parents]
    for parent in (*near, *_of_rigs(evidence, singles, near)):
        if evidence.hurried:
            evidence.leave(SETS)
            break
        if pool.clear and parent in near:
            continue
        progress(f"seeking beside {parent.name}")
        pool.refit(beside(evidence, parent))
    exchanged: set[frozenset[Key]] = set()
    for _ in range(0 if _left_behind(evidence, pool.best, instead) else ROUNDS):
        if pool.clear and evidence.told_by != MOTION:  # there nothing is exchanged
            break
        if evidence.hurried:
            evidence.leave(SETS)
            break
        found = _to_exchange(pool, exchanged, ALONE * singles[0].penalised)
        if found is None:
            break
        whole, rest = found
        progress(f"seeking beside {rest.name} again")
        pool.refit(beside(evidence, rest, alternatives_to(evidence, whole)))
    return raced(evidence, list(pool.found.values()), FINE_SEVERAL, progress)


def _left_behind(evidence: Evidence, best: Hypothesis | None, instead: Hypothesis | None) -> bool:
    """Whether the best pair leaves ten times what another set does as it is, at the same level."""
    if best is None or instead is None:
        return False
    there = at_level(evidence, instead, SEVERAL_LEVEL)
    return best.penalised > HOPELESS * max(there.penalised, EXPLAINED)


def _of_rigs(
    evidence: Evidence, singles: Sequence[Hypothesis], known: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """The best of what rigs do, beyond those that are ``known``; nothing of responses, which are
    brought near with all of it at once."""
    if evidence.told_by != MODES:
        return []
    return [h for h in singles if only_a_rig(h) and h not in known][:RIG_PARENTS]


def _to_exchange(
    pool: Pool, tried: set[frozenset[Key]], most: float
) -> tuple[Hypothesis, Hypothesis] | None:
    """The best set, and what is left of it without an effect that was not exchanged yet; None
    where there is none. A rest that leaves more than ``most`` is nothing: the other one carries
    all."""
    best = pool.best
    if best is None:
        return None
    for index in range(len(best.effects)):
        rest = frozenset(e.key for k, e in enumerate(best.effects) if k != index)
        if rest not in tried:
            tried.add(rest)
            left = without(pool.evidence, best, index)
            if left is not None and left.penalised <= most:
                return best, left
    return None


def further(
    evidence: Evidence, pairs: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Sets of three effects and more, sharpened, as long as each further one halves what is left
    beyond noise: forward beside the best set, then the one that does least sought again beside the
    rest (backward). Rigs bring several things at once, and what is sought stands beside them."""
    out: list[Hypothesis] = []
    best = pairs[0]
    while room(evidence, best) and not evidence.clear(best.fit):
        if evidence.hurried:
            evidence.leave(MORE)
            break
        progress(f"seeking beside {best.name}")
        pool = Pool(evidence, progress)
        pool.refit(beside(evidence, at_level(evidence, best, SEVERAL_LEVEL)))
        if pool.best is not None:
            _weakest_again(pool, pool.best)
        found = raced(evidence, list(pool.found.values()), FINE_SEVERAL, progress)
        if not found or found[0].fit.excess > HALVED * best.fit.excess:
            break
        out += found
        best = found[0]
    return out


def room(evidence: Evidence, h: Hypothesis) -> bool:
    """Whether a further effect may be told beside those of a set."""
    spare = h.fit.spare(len(evidence.model.parameters)) - h.unknowns
    return not h.full and spare >= SPARE


def at_level(evidence: Evidence, h: Hypothesis, level: int) -> Hypothesis:
    """As it is, beside the recordings of another level."""
    setting = evidence.at_level(h.fit.setting, level)
    return Hypothesis(h.effects, evidence.evaluated(setting, h.fit.p))


def _weakest_again(pool: Pool, whole: Hypothesis) -> None:
    """The effect without which a set leaves least, sought again with the others in place."""
    rests = [without(pool.evidence, whole, k) for k in range(len(whole.effects))]
    known = [r for r in rests if r is not None]
    if known:
        rest = min(known, key=lambda r: r.penalised)
        pool.progress(f"seeking beside {rest.name} again")
        pool.refit(beside(pool.evidence, rest, alternatives_to(pool.evidence, whole)))


def busy(evidence: Evidence, sets: Sequence[Hypothesis], progress: Progress) -> list[Hypothesis]:
    """The best sets without what does nothing in them, sharpened: what led to an effect may have
    nothing left to do once that is there, and none would be told for company. Only those that
    lost something."""
    lighter = [rest for whole in sets[:STAYING] if (rest := _spared(evidence, whole)) is not whole]
    return raced(evidence, lighter, ((evidence.levels - 1, len(lighter)),), progress)


def _spared(evidence: Evidence, whole: Hypothesis) -> Hypothesis:
    """A set without the effects whose unknowns bring less than `PENALTY` each, the others as they
    are; one stays."""
    best, idle = whole, list[int]()
    for k in range(len(whole.effects)):
        if len(best.effects) == 1:
            break
        rest = without(evidence, whole, *idle, k)
        if rest is None:
            continue
        most = 1.0 + PENALTY * (whole.unknowns - rest.unknowns)
        if rest.fit.misfit <= most * whole.fit.misfit:
            best, idle = rest, [*idle, k]
    return best


def simpler(evidence: Evidence, pair: Hypothesis, progress: Progress) -> list[Hypothesis]:
    """What one effect does from where two ended, sharpened: each of them alone, and the same effect
    twice as once on both sets together."""
    rests = [without(evidence, pair, index) for index in range(len(pair.effects))]
    seeds = [
        Seed(r.effects, evidence.at_level(r.fit.setting, SEVERAL_LEVEL), r.fit.p)
        for r in rests
        if r is not None
    ]
    together = _together(evidence, pair, rests[-1])
    found = entered(evidence, [*seeds, *([] if together is None else [together])], progress)
    return raced(evidence, found, ((SEVERAL_LEVEL, len(found)), *FINE), progress)


def _together(evidence: Evidence, pair: Hypothesis, first: Hypothesis | None) -> Seed | None:
    """Both sets of elements of one effect type as one place (a run, a patch, a group), where it
    can stand there."""
    a, b = pair.effects[:2]
    if first is None or a.physics != b.physics:
        return None
    sets = [set(c.members) for e in (a, b) if (c := e.change) is not None and c.members]
    bare = without(evidence, first, 0) if len(sets) == 2 else None
    if bare is None:
        return None
    union = set.union(*sets)
    whole = next(
        (
            c
            for c in evidence.candidates(bare.fit.setting.model, (a.physics,))
            if c.change is not None and set(c.change.members) == union
        ),
        None,
    )
    at = len(evidence.model.parameters)
    size = pair.fit.p[at : at + a.count]
    if whole is None:
        return None
    return seed_from(evidence, bare, Score(whole, 1.0, size), SEVERAL_LEVEL)
