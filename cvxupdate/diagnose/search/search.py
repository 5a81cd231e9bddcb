"""The search: effects at all places screened, the best refitted, several where one is too few."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, takes_all
from cvxupdate.diagnose.nominal.wanted import nothing_left
from cvxupdate.diagnose.screen.shortlist import best_of
from cvxupdate.diagnose.search.alike import elsewhere
from cvxupdate.diagnose.search.backward import backward
from cvxupdate.diagnose.search.coarse import coarsely
from cvxupdate.diagnose.search.driven import settled, shaken
from cvxupdate.diagnose.search.entries import first_pass, screened
from cvxupdate.diagnose.search.exchange import crowded, exchanged, likeliest
from cvxupdate.diagnose.search.grown import NOTHING, Grown, Seen, far_ahead, grown_from
from cvxupdate.diagnose.search.held import held
from cvxupdate.diagnose.search.neighbours import at_last, neighbours
from cvxupdate.diagnose.search.race import merged, raced
from cvxupdate.diagnose.search.rigs import beside_a_rig
from cvxupdate.diagnose.search.several import busy, further, in_their_place, pairs, simpler
from cvxupdate.diagnose.search.unlike import with_one_unlike
from cvxupdate.diagnose.search.valleys import in_other_valleys
from cvxupdate.diagnose.search.zones import zoned
from cvxupdate.diagnose.settings import (
    BEHIND,
    COARSE,
    DAMPING_GAIN,
    EXPLAINED,
    FEW_PARENTS,
    FINE,
    FINE_SEVERAL,
    HALVED,
    LEAST_CHANGE,
    OPEN,
    PARENTS,
    SPARE,
    STAYING,
    TWICE,
)
from cvxupdate.diagnose.types import Evidence, Key, Progress, Score
from cvxupdate.physics import effect_types
from cvxupdate.physics.effect import MODES, MOTION

Sets = tuple[Hypothesis, ...]


@dataclass(frozen=True)
class Found:
    """All that was tried: first-order ``scores``, hypotheses of one effect and of several, best
    first; how often half of the recordings chooses a candidate (``stable``); of every hypothesis
    that was refitted at least once the fraction of the misfit that it left there (``entries``)."""

    scores: tuple[Score, ...] = ()
    singles: Sets = ()
    several: Sets = ()
    stable: Mapping[Key, float] = field(default_factory=dict)
    entries: tuple[tuple[Hypothesis, float], ...] = ()


def damping_only(evidence: Evidence) -> bool:
    """Whether only the pattern of damping may be at stake: nuisance parameters explain the
    rest, and nothing depends on the level."""
    base = evidence.bases[-1]
    return base.misfit <= EXPLAINED and not evidence.departs(base) and not _by_level(evidence)


def _by_level(evidence: Evidence) -> bool:
    """Whether recordings on which laws are tried depend on their level, be it little, otherwise
    than by laws of the file."""
    change = evidence.level_change() if evidence.told_by == MOTION else None
    return change is not None and change.exceeds(LEAST_CHANGE) and not evidence.foretold


def names_tried(evidence: Evidence) -> tuple[str, ...]:
    """Effects worth trying: all; where nuisance parameters explain the rest, those of damping if
    the pattern of damping departs from the file's."""
    if not damping_only(evidence):
        return evidence.names
    if evidence.bases[-1].damping_strain <= DAMPING_GAIN:
        return ()
    damping = {e.name for e in effect_types() if e.damping}
    return tuple(n for n in evidence.names if n in damping)


def search(evidence: Evidence, progress: Progress, seen: Seen = NOTHING) -> Found:
    """Screen at every level, refit the short list; several effects where no single one is
    enough, from what another look at the recordings has ``seen``."""
    progress("fitting the nuisance parameters")
    bases, names = evidence.bases, names_tried(evidence)
    if not names:
        return Found()
    rankings, stable = screened(evidence, names, progress)
    pattern = damping_only(evidence)
    entries = first_pass(evidence, rankings, stable, pattern, progress)
    coarse, sharper, alone = coarsely(evidence, entries, pattern, progress)
    grown = Grown([]) if pattern else grown_from(evidence, coarse, alone, seen, progress)
    if grown.ended:
        singles = merged(raced(evidence, coarse[:STAYING], FINE, progress), _alone(grown.sets))
        several = [h for h in grown.sets if len(h.effects) > 1]
    else:
        smooth = Smooth(coarse, sharper, alone, grown, pattern)
        singles, several = _sharpened(evidence, smooth, progress)
    several = merged(several, with_one_unlike(evidence, [*singles, *several], progress))
    several = merged(several, at_last(evidence, several, progress))
    return Found(
        tuple(best_of(*rankings)),
        *by_count(settled(evidence, [*singles, *several], progress)),
        {s.effect.key: part for s, part in stable},
        tuple((h, h.fit.misfit / bases[0].misfit) for h in entries),
    )


@dataclass(frozen=True)
class Smooth:
    """Of smooth recordings: single effects (``coarse``), those that show on ``sharper`` ones only,
    what a rig does ``alone``, sets that are ``grown``; ``pattern``: only that of damping is at
    stake."""

    coarse: list[Hypothesis]
    sharper: list[Hypothesis]
    alone: list[Hypothesis]
    grown: Grown
    pattern: bool

    @property
    def reached(self) -> bool:
        """Whether the sets leave single effects far behind, or little at all."""
        if not self.grown.ahead:
            return False
        best = self.grown.sets[0]
        near = best.fit.misfit <= OPEN * EXPLAINED
        return near or far_ahead(best, self.coarse)


def _sharpened(
    evidence: Evidence, smooth: Smooth, progress: Progress
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Single effects and sets of them, to the end."""
    coarse, grown = smooth.coarse, smooth.grown.sets
    reached, pattern = smooth.reached, smooth.pattern
    if reached:
        coarse = coarse[:STAYING]  # no single effect comes near
    elif not pattern and coarse and coarse[0].penalised > OPEN * EXPLAINED:
        coarse = in_their_place(evidence, coarse, progress)
        coarse = merged(coarse, zoned(evidence, coarse, progress, COARSE[-1][0]))
    singles = merged(raced(evidence, coarse, FINE, progress), _alone(grown))
    own = {s.keys for s in singles}
    others = [] if reached else [h for h in smooth.sharper if h.keys not in own]
    singles = merged(singles, raced(evidence, others, FINE_SEVERAL, progress))
    if pattern:
        singles.sort(key=lambda h: h.fit.damping_strain)
    if not reached:
        singles = _stretches(evidence, elsewhere(evidence, singles, progress), progress)
    several, known, single = list[Hypothesis](), None, False
    if not (pattern or _enough(evidence, singles)):
        several = _pairs(evidence, [] if reached else coarse, singles, progress)
        known = likeliest(several)
        singles = merged(singles, simpler(evidence, several[0], progress) if several else [])
        single = _told_alone(evidence, singles, merged(several, grown))
        known_ways = [several] if smooth.grown.ahead else [several, grown]  # each has its own end
        ways = [] if single else _open(evidence, known_ways)
        several = merged(several, grown, *(further(evidence, way, progress) for way in ways))
    elif smooth.grown.ahead:
        several = grown
    several = _stretches(evidence, elsewhere(evidence, several, progress), progress)
    several = merged(several, shaken(evidence, several, progress))
    lighter = [] if smooth.grown.freed else _lighter(evidence, several, smooth.alone, progress)
    if not single:
        sets = merged(several, lighter)
        firsts = coarse if reached and crowded(evidence, sets) else []
        lighter += _instead(evidence, sets, firsts, known, progress)
    singles = merged(singles, _alone(lighter))
    several = [h for h in merged(several, lighter, grown) if len(h.effects) > 1]
    if not pattern:
        singles, several = _last(evidence, singles, several, progress)
    return singles, several


def _stretches(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """With what stretches within elements do in place of the best; where that leaves nothing, or
    only the pattern of damping is at stake, as they are."""
    if not known or damping_only(evidence) or evidence.clear(known[0].fit):
        return list(known)
    return merged(known, zoned(evidence, known, progress, evidence.levels - 1))


def _lighter(
    evidence: Evidence,
    several: Sequence[Hypothesis],
    alone: Sequence[Hypothesis],
    progress: Progress,
) -> list[Hypothesis]:
    """The best sets freed of what does little in them, and with all that a rig does beside; what it
    does ``alone`` was tried."""
    lighter = busy(evidence, several, progress)
    if several and len(several[0].effects) > 2:
        lighter += backward(evidence, several[0], progress)[1]
    return [*lighter, *beside_a_rig(evidence, merged(several, lighter), alone, progress)]


def by_count(sets: Sequence[Hypothesis]) -> tuple[Sets, Sets]:
    """Those of one effect, and of several."""
    return tuple(_alone(sets)), tuple(h for h in sets if len(h.effects) > 1)


def _alone(sets: Sequence[Hypothesis]) -> list[Hypothesis]:
    return [h for h in sets if len(h.effects) == 1]


def _pairs(
    evidence: Evidence,
    firsts: Sequence[Hypothesis],
    singles: Sequence[Hypothesis],
    progress: Progress,
) -> list[Hypothesis]:
    """Pairs with the best of ``firsts``, exchanged; fewer where what the best single effect leaves
    may be the mesh's, and as they are where that will be told alone."""
    if not firsts:
        return []
    few = bool(singles) and _mesh_may(evidence, singles[0])
    found = pairs(evidence, firsts, FEW_PARENTS if few else PARENTS, progress)
    if _told_alone(evidence, singles, found):
        return found
    return exchanged(evidence, found, progress)


def _last(
    evidence: Evidence,
    singles: Sequence[Hypothesis],
    several: Sequence[Hypothesis],
    progress: Progress,
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Single effects at other places, too; sets with supports that give way in more directions."""
    by_modes = evidence.told_by == MODES
    sets = list(several)
    if by_modes:
        sets = merged(several, held(evidence, (*singles, *several), progress))
        sets = merged(sets, in_other_valleys(evidence, sets, progress))
    return neighbours(evidence, singles, sets, progress), sets


def _open(evidence: Evidence, ways: Sequence[Sequence[Hypothesis]]) -> list[Sequence[Hypothesis]]:
    """Sets to go on from, best first each: where one leaves nothing, only those that have not
    fallen behind it, for further effects would be sought beside what is not true."""
    known = [way for way in ways if way]
    best = min((way[0] for way in known), key=lambda h: h.penalised, default=None)
    if best is None or not evidence.clear(best.fit):
        return known
    return [way for way in known if way[0].penalised <= BEHIND * best.penalised]


def _instead(
    evidence: Evidence,
    sets: Sequence[Hypothesis],
    firsts: Sequence[Hypothesis],
    known: Hypothesis | None,
    progress: Progress,
) -> list[Hypothesis]:
    """What may stand in place of the likeliest of ``sets``: a pair with one of ``firsts``; others
    for one of its own, but if it is ``known`` that none does."""
    found = [h for h in sets if len(h.effects) > 1]
    far = likeliest(found)
    several = pairs(evidence, firsts, FEW_PARENTS, progress, far) if firsts else []
    found = merged(found, several)
    best = likeliest(found)
    return several if best is known else exchanged(evidence, found, progress)


def _enough(evidence: Evidence, singles: Sequence[Hypothesis]) -> bool:
    """Whether one effect is enough, or more than one could not be told."""
    base = evidence.bases[-1]
    spare = base.spare(len(evidence.model.parameters))
    clear = bool(singles) and nothing_left(evidence, singles[0].fit)
    return base.misfit <= OPEN * EXPLAINED or clear or spare < SPARE


def _mesh_may(evidence: Evidence, h: Hypothesis, times: float = 1.0) -> bool:
    """Whether what is left may be the mesh's, or so many times that."""
    return evidence.errors(h.fit).fit <= times * evidence.allowance(h.fit.setting.model)


def _told_alone(
    evidence: Evidence, singles: Sequence[Hypothesis], sets: Sequence[Hypothesis]
) -> bool:
    """Whether the best single effect will be told beside which none of ``sets`` is accepted, for
    what is left may be the mesh's: larger ones would be sought for nothing; pairs are rivals."""
    if not (singles and sets) or any(takes_all(evidence, s, singles[0]) for s in sets):
        return False
    h, base = singles[0], evidence.bases[-1]
    errors, halves = evidence.errors(h.fit), h.fit.excess <= HALVED * base.excess
    heard = not np.isfinite(errors.hold_out) or (
        errors.hold_out <= HALVED * evidence.nominal.hold_out
    )
    return halves and heard and _mesh_may(evidence, h, TWICE)
