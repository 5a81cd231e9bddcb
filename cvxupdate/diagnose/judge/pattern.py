"""Findings of what the evidence says beside its search: laws and patterns of damping ratios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.judge.acceptance import explained
from cvxupdate.diagnose.judge.alternatives import overlapping
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.results import Damper, Finding, Further
from cvxupdate.diagnose.settings import AS_LIKELY, AS_ONE, MOST_SURE, STATED, STRONG
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.physics import told
from cvxupdate.physics.place import Place, listed

MOST = 12  # equivalents listed
RESONATOR = "attached_resonator"
NAMED = 4  # of them in a sentence


@dataclass(frozen=True)
class Pattern:
    """Findings, evidence, and the effect of damping with its size, for the updated model; what may
    be said where none is likely enough (``unsure``)."""

    findings: tuple[Finding, ...] = ()
    lines: tuple[str, ...] = ()
    damped: tuple[Model, float] | None = None
    unsure: str = ""


def pattern_of(further: Further) -> Pattern:
    """One rate of decay where there is one, else the likeliest effect of damping."""
    if further.alpha is not None:
        return Pattern((_law(*further.alpha, further.sure),), further.lines)
    return _damper(further)


def told_beside(pattern: Pattern, judgement: Judgement) -> Pattern:
    """Without a damper where the model that the search ended with does not explain natural
    frequencies and shapes (which modes a damper moves is read from these), or where an oscillator
    hangs that was found: what takes out energy there is its own dashpot."""
    if pattern.damped is None:
        return pattern
    last = judgement.last
    hung = {n for e in last.hypothesis.effects if e.physics == RESONATOR for n in e.place.nodes}
    own = any(hung.intersection(f.place.nodes) for f in pattern.findings)
    if own or not explained(last, judgement.case):
        return replace(pattern, findings=(), damped=None)
    return pattern


def _law(alpha: float, deviation: float, sure: float) -> Finding:
    effect = told("mass_proportional_damping", Place())
    values, spread = {"alpha": alpha}, {"alpha": deviation}
    return Finding.of(effect, values, spread, min(sure, MOST_SURE))


def _damper(further: Further) -> Pattern:
    """The likeliest effect of damping, where its place is likelier than not. Types of effect are as
    likely before, and so are the places of one type: a law of the whole structure is not drowned by
    the many nodes at which a dashpot does nearly as well."""
    dampers = [d for d in further.dampers if d.effect.change is not None]
    if not dampers:
        return Pattern((), further.lines, unsure=_unexplained(further))
    least = min(d.strain for d in dampers)
    figures = further.modes + further.turned[0]
    wide = max(1.0, least / figures)  # what the best leaves beyond chance, all of them may
    likely = np.array(
        [np.exp(-0.5 * (d.strain - least) / wide) / max(1, d.places) for d in dampers]
    )
    nothing = float(np.sqrt(figures) * np.exp(-0.5 * (further.strain - least) / wide))
    best = dampers[int(np.argmax(likely))]
    grown = _model_of(best)
    place = best.effect.place
    places = [d.effect.place for d in dampers]
    near_by = [p == place or overlapping(p, place, grown) for p in places]
    same = [
        h and d.effect.physics == best.effect.physics for h, d in zip(near_by, dampers, strict=True)
    ]
    # what moves as one is one place, though no recording tells where on it
    here = [h or d.acts_like(best, AS_ONE) for h, d in zip(near_by, dampers, strict=True)]
    whole = float(likely.sum() + nothing)
    line = (
        f"{_what(further)} depart from {further.known} (sum of squares {further.strain:.3g} "
        f"in units of their usual scatter, {further.modes} modes); {best.effect.title} brings it "
        f"to {best.strain:.3g}."
    )
    lines = (*further.lines, line)
    near = [d for d in dampers if d is not best and d.strain <= best.strain + STRONG * wide]
    if _untold(best, dampers, here, wide) or float(likely[here].sum()) < STATED * whole:
        unsure = _unsure(further, [best, *near], nothing / whole) or _unexplained(further)
        return Pattern((), lines, unsure=unsure)
    (values, spread) = best.effect.reported(
        grown, grown.parameters[-1:], [best.size], [best.deviation]
    )
    finding = Finding.of(
        best.effect,
        values,
        spread,
        min(float(likely[same].sum()) / whole, MOST_SURE),
        explains=1.0 - best.strain / max(further.strain, 1e-300),
        equivalent=tuple(d.effect for d in near[:MOST]),
        behind=tuple(float(np.exp(0.5 * (d.strain - best.strain) / wide)) for d in near[:MOST]),
    )
    return Pattern((finding,), lines, (grown, best.size))


def _what(further: Further) -> str:
    shapes = " and the imaginary parts of the shapes" if further.turned[0] else ""
    return f"The damping ratios{shapes}"


def _untold(best: Damper, dampers: Sequence[Damper], here: Sequence[bool], wide: float) -> bool:
    """Whether another type of effect elsewhere does as well, so that what was as likely before
    decides alone: a dashpot at the free end of a beam takes from every mode alike, as air does."""
    return any(
        d.strain <= best.strain + 2.0 * AS_LIKELY * wide and d.effect.physics != best.effect.physics
        for d, own in zip(dampers, here, strict=True)
        if not own
    )


def _model_of(damper: Damper) -> Model:
    change = damper.effect.change
    if change is None:
        raise ModelError(f"{damper.effect.title} is no change of the model.")
    return change.model


def _unsure(further: Further, alike: Sequence[Damper], nothing: float) -> str:
    """What may be said where no place is likelier than not; empty where nothing may be missing
    either."""
    if nothing >= STATED:
        return ""
    names = listed([d.effect.title for d in alike], NAMED)
    return (
        f"{_what(further)} say that something takes out energy which the model has not, but not "
        f"what or where: {names} would each do."
    )


def _unexplained(further: Further) -> str:
    """What may be said where the ratios scatter by more than chance and nothing explains them."""
    strain = further.strain - further.turned[1]
    if strain <= further.most:
        return ""
    times = float(np.sqrt(strain / further.modes))
    return (
        "The model explains the natural frequencies and shapes, but not the damping ratios: they "
        f"depart from {further.known} by {times:.2g} times the usual scatter, r.m.s. of "
        f"{further.modes} modes, and no damper at one place explains that."
    )
