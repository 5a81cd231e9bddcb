"""What other evidence told, on these recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.nominal.theory import ASIDE
from cvxupdate.diagnose.search.exchange import as_fitted
from cvxupdate.diagnose.types import Evidence, Real
from cvxupdate.physics.effect import Effect, HiddenOscillator
from cvxupdate.physics.shaker import at_drive, parts_of


def carried(evidence: Evidence, told: Hypothesis) -> Hypothesis | None:
    """What other evidence told, at its sizes on this one, at the first level, with its nuisance
    parameters: those of this one alone are bent by what is missing. Where forces and sensors are
    modes do not tell: at their places, or where nuisance parameters alone have them, whichever is
    nearer. None where an effect cannot stand here."""
    base, last = evidence.bases[0], evidence.bases[-1]
    names = [q.name for q in told.fit.setting.model.parameters]
    own = np.zeros(len(base.p))
    aside = own.copy()
    for j, q in enumerate(evidence.model.parameters):
        if q.name in names:
            own[j] = told.fit.p[names.index(q.name)]
        elif q.group == ASIDE:
            aside[j] = last.p[j]
    starts = [own, own + aside] if np.any(aside) else [own]
    found = [h for p in starts if (h := _at(evidence, told, p)) is not None]
    return min(found, key=lambda h: h.fit.cost, default=None)


def _at(evidence: Evidence, told: Hypothesis, nuisance: Real) -> Hypothesis | None:
    h = Hypothesis((), evidence.evaluated(evidence.bases[0].setting, nuisance))
    shaker, sizes = _as_shaker(evidence, told, h)
    for number, effect in enumerate(told.effects):
        if shaker is not None and _part_of(effect, shaker):
            continue
        grown = together(evidence, h, *_as_here(evidence, told, number))
        if grown is h:
            return None
        h = grown
    return h if shaker is None else together(evidence, h, [shaker], sizes)


def _as_shaker(
    evidence: Evidence, told: Hypothesis, here: Hypothesis
) -> tuple[Effect | None, Real]:
    """The shaker of these recordings, and its sizes, for what was told at the drive: of modes a
    mass and a spring are all that there is of it."""
    shaker = None if evidence.approach is None else evidence.approach.shaker(here)
    if shaker is None:
        return None, np.zeros(0)
    named = {
        e.physics: float(told.sizes(k)[0])
        for k, e in enumerate(told.effects)
        if _part_of(e, shaker)
    }
    sizes = np.array([named.get(name, 0.0) for name in parts_of(shaker)])
    return (shaker if named else None), sizes


def _part_of(effect: Effect, shaker: Effect) -> bool:
    """Whether it stands where the shaker acts, and is one of its parts."""
    own = effect.physics in parts_of(shaker) and effect.place.nodes == shaker.place.nodes
    return own and at_drive(effect) and effect.place.dof in (None, shaker.place.dof)


def _as_here(evidence: Evidence, told: Hypothesis, number: int) -> tuple[list[Effect], Real]:
    """An effect as other evidence told it, and its unknowns: a hidden oscillator with its fitted
    mass and tuning, from which its parameters begin, and with a dashpot if those have one that
    these recordings ask for; others as they are."""
    effect, sizes = told.effects[number], told.sizes(number)
    if not isinstance(effect.action, HiddenOscillator):
        return [effect], sizes
    asked = evidence.candidates(evidence.model, (effect.physics,))
    here = next((c for c in asked if c.key == effect.key), effect)
    if not isinstance(here.action, HiddenOscillator):
        return [effect], sizes
    values = told.values[number]
    action = replace(as_fitted(here.action, values), row=effect.action.row, mass=values["m"])
    return [replace(effect, action=action, figures=here.figures)], np.zeros(action.count)
