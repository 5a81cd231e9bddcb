"""Sets of effects where no single one comes near: what a rig does alone, what another look at the
recordings tells (the modes in responses), what grows from a model that is far off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, only_a_rig
from cvxupdate.diagnose.modes.identified import FEW
from cvxupdate.diagnose.nominal.wanted import by_tables_alone
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.search.coarse import enough_alone, far_off, follows
from cvxupdate.diagnose.search.completed import on_rigs
from cvxupdate.diagnose.search.guided import grown_near, guided
from cvxupdate.diagnose.search.met import met
from cvxupdate.diagnose.search.race import merged, raced
from cvxupdate.diagnose.search.several import further
from cvxupdate.diagnose.settings import (
    CHANCE,
    EXPLAINED,
    FINE_SEVERAL,
    HALVED,
    HOPELESS,
    LOWER,
    OPEN,
    SEVERAL_LEVEL,
    STAYING,
    STRONG,
    UNEXPLAINED,
)
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.recordings.quantiles import chi_square_above


class Seen(Protocol):
    """Another look at the same recordings."""

    @property
    def sure(self) -> bool:
        """Whether it tells something for sure."""

    @property
    def calm(self) -> bool:
        """Whether the nuisance parameters alone explain all that it sees, for sure: effects that
        need one another are not to be sought in what is left."""

    @property
    def met(self) -> bool:
        """Whether what nothing was fitted to is, besides, as it would be with nothing missing."""

    def damps(self, singles: Sequence[Hypothesis]) -> bool:
        """Whether it tells of what takes out energy at a place, nothing else being missing, and one
        of the ``singles`` on these recordings is that and halves what they leave."""

    @property
    def settled(self) -> bool:
        """Whether what it tells is all of what it sees, borne out by what nothing was fitted to:
        what these recordings would tell beside is not to be sought in what is left."""

    @property
    def likely(self) -> Sequence[Hypothesis]:
        """The likeliest sets of effects, likeliest first."""

    def tells(self, h: Hypothesis) -> bool:
        """Whether a set has all that is told."""


class _Nothing:
    sure = calm = settled = met = False
    likely: Sequence[Hypothesis] = ()

    def tells(self, h: Hypothesis) -> bool:
        return False

    def damps(self, singles: Sequence[Hypothesis]) -> bool:
        return False


NOTHING: Seen = _Nothing()


@dataclass(frozen=True)
class Grown:
    """``sets`` of effects, best first; whether they are ``ahead`` of all single ones (then the
    search has gone on from there, for pairs of those begin further off); whether they have been
    tried beside a rig and freed of all that they do not need (``freed``); whether nothing nearer is
    to be sought (``ended``)."""

    sets: list[Hypothesis]
    ahead: bool = False
    freed: bool = False
    ended: bool = False


def grown_from(
    evidence: Evidence,
    coarse: Sequence[Hypothesis],
    alone: Sequence[Hypothesis],
    seen: Seen,
    progress: Progress,
) -> Grown:
    """Sets that grow where no single effect comes near, what a rig does ``alone``, and where that
    is not enough what was ``seen``: another look takes as long, and has nothing to add to what
    explains. What a rig does beside something else is one of them, and no end of the search. A rig
    that is met by the modes, with what stands beside it, comes first: it takes seconds. What grows
    has its turn before another look where something follows the recordings already, or the modes
    are as far off."""
    if by_tables_alone(evidence):
        return _of_tables(evidence, coarse, alone, progress)
    left = leaves_much(evidence, coarse, alone)
    far = left and far_off(coarse)
    found = [h for h in met(evidence, progress).sets if len(h.effects) > 1] if left else []
    if any(within_chance(h) for h in found):
        return Grown(merged(found, alone), True, freed=True)
    if found and far and follows(evidence, found[0]) and far_ahead(found[0], coarse):
        return Grown(merged(further(evidence, found, progress), found, alone), True)
    near_by = any(follows(evidence, h) for h in (*alone, *coarse[:1]))
    first = grown_near(evidence, progress) if far and (near_by or modes_far_off(evidence)) else []
    there, near = list[Hypothesis](), False
    if not any(within_chance(h) for h in first):
        open_ = bool(coarse) and coarse[0].fit.misfit > EXPLAINED
        if (left and (seen.calm or seen.damps(coarse))) or (open_ and seen.met):
            return Grown(list(alone), ended=True)
        there = on_these(evidence, seen, progress) if left else []
        if there and seen.settled:
            return Grown(merged(alone, there), ended=True)
        near = seen.sure if there else False
        near |= bool(there) and there[0].fit.misfit <= HOPELESS * EXPLAINED
    rig = [h for h in alone if only_a_rig(h)]
    grown = merged(rig, there, found, guided(evidence, progress) if far and not near else [])
    if not grown or any(h.penalised <= grown[0].penalised for h in coarse[:1]):
        return Grown(merged(grown, alone))
    grown = merged(grown, further(evidence, grown, progress))
    return Grown(merged(grown, alone), True, ended=confirmed(evidence, grown[0], seen))


def _of_tables(
    evidence: Evidence,
    coarse: Sequence[Hypothesis],
    alone: Sequence[Hypothesis],
    progress: Progress,
) -> Grown:
    """Of tables of modes without a reference, whose fits are short, whole rigs compete with
    whatever comes near, for in the tolerance of a model much explains them that has nothing to do
    with what is missing. Nothing is sought where no more than noise is left; pairs of other effects
    are, unless a rig explains all but noise: by what a model may leave a fixture and a lump passed
    for a loose joint and a foot that turns (the laboratory's 3329)."""
    known = (*coarse, *alone)
    likeliest = max(known, key=merit, default=None)
    if likeliest is not None and likeliest.fit.spent:
        return Grown(list(alone))
    sets = merged(on_rigs(evidence, known, progress), alone)
    best = max(sets, key=merit, default=None)
    if best is None:
        return Grown([])
    ahead = all(merit(best) > merit(h) + STRONG / 2.0 for h in coarse)
    return Grown(sets, ahead and best.fit.spent)


def within_chance(h: Hypothesis) -> bool:
    """Whether a hypothesis leaves no more than chance would, of as many figures as there are."""
    figures = max(1.0, h.fit.free)
    return h.fit.misfit * figures <= chi_square_above(1.0 - CHANCE, figures)


def far_ahead(h: Hypothesis, coarse: Sequence[Hypothesis]) -> bool:
    """Whether a set leaves a tenth of what any single effect does."""
    return all(HOPELESS * h.penalised <= c.penalised for c in coarse[:1])


def modes_far_off(evidence: Evidence) -> bool:
    """Whether the modes in the recordings are as far from the model with its usual scatter as these
    are: then all is to be sought in them, too, which takes half of the time, and among some forty
    figures much explains a frame on a fixture."""
    modes = evidence.by_modes(FEW)
    return modes is not None and far_off([Hypothesis((), modes.bases[-1])])


def leaves_much(
    evidence: Evidence, coarse: Sequence[Hypothesis], alone: Sequence[Hypothesis]
) -> bool:
    """Whether neither a single effect comes near nor what a rig does ``alone``."""
    left = bool(coarse) and coarse[0].penalised > OPEN * EXPLAINED
    return left and not enough_alone(evidence, alone)


def confirmed(evidence: Evidence, h: Hypothesis, seen: Seen) -> bool:
    """Whether a set has what another look tells for sure, these recordings say yes to it, and yet
    it leaves much: then the structure is further from its model than these recordings forgive, and
    nothing nearer is to be sought in them."""
    errors, base = evidence.errors(h.fit), evidence.bases[-1]
    much = h.fit.misfit > OPEN * EXPLAINED and evidence.relative(errors) > UNEXPLAINED
    if not (much and seen.sure and seen.tells(h)):
        return False
    held, before = errors.hold_out, evidence.errors(base).hold_out
    heard = not np.isfinite(held) or held <= LOWER * before
    return heard and h.fit.excess <= HALVED * base.excess


def on_these(evidence: Evidence, seen: Seen, progress: Progress) -> list[Hypothesis]:
    """The likeliest sets as these recordings have them, from the sizes of the other look,
    sharpened; best first, without those that cannot stand here."""
    found = [h for told in seen.likely if (h := carried(evidence, told)) is not None]
    legs = tuple((level, STAYING) for level in range(SEVERAL_LEVEL + 1))
    return raced(evidence, found, (*legs, *FINE_SEVERAL), progress)
