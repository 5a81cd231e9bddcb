"""Hypotheses: effects placed on the nominal model, fitted; placing a further one, taking one out,
and the figures that were found. The same for every kind of evidence."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.fit import Fit, Setting
from cvxupdate.diagnose.settings import CLEARLY, MOST_EFFECTS, OF_A_RIG, PENALTY
from cvxupdate.diagnose.types import Evidence, Key, Real, Score, Seed
from cvxupdate.errors import CvxupdateError, ModelError
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import all_together
from cvxupdate.physics.shaker import at_drive

FIXTURE, SPRINGS = "flexible_support", "grounding_spring"  # what a rig stands on
GROUPS = "stiffness and mass of whole groups far beyond their usual scatter"
PARTS = ("added_mass", SPRINGS)  # what supports, shakers and fixtures are made of


@dataclass(frozen=True)
class Figures:
    """An effect's parameters as the contract names them: values, deviations with what the model
    leaves open, deviations by noise alone."""

    values: dict[str, float]
    deviations: dict[str, float]
    noise: dict[str, float]


@dataclass(frozen=True)
class Hypothesis:
    """Effects on a model, fitted (none: nuisance parameters alone)."""

    effects: tuple[Effect, ...]
    fit: Fit

    @property
    def keys(self) -> frozenset[Key]:
        """The set of what is supposed."""
        return frozenset(e.key for e in self.effects)

    @property
    def unknowns(self) -> int:
        """Those of the effects."""
        return sum(e.count for e in self.effects)

    @property
    def full(self) -> bool:
        """Whether it has as many effects as there may be, one that is sought among them: what
        theory wants is none of them, and of a rig the first few count."""
        own = [e for e in self.effects if not e.type.theory]
        rig = sum(map(of_a_rig, own))
        return len(own) > rig and len(own) - rig + min(rig, OF_A_RIG) >= MOST_EFFECTS

    @property
    def name(self) -> str:
        """For progress and tables."""
        return " and ".join(e.name for e in self.effects) or "nuisance parameters"

    @property
    def title(self) -> str:
        """In words."""
        return all_together([e.title for e in self.effects]) or GROUPS

    @property
    def penalised(self) -> float:
        """Misfit with a penalty for each unknown beyond the first of each effect. Six digits:
        mirror images of a symmetric structure are a tie, on every machine the same."""
        whole = self.fit.misfit * (1.0 + PENALTY * (self.unknowns - len(self.effects)))
        return float(f"{whole:.5e}")

    @property
    def onward(self) -> Seed:
        """To fit it on from where it is."""
        return Seed(self.effects, self.fit.setting, self.fit.p)

    def sizes(self, number: int) -> Real:
        """The unknowns of an effect that are parameters of the model, (columns,)."""
        before = sum(e.columns for e in self.effects[number:])
        first = len(self.fit.setting.model.parameters) - before
        return self.fit.p[first : first + self.effects[number].columns]

    @cached_property
    def figures(self) -> tuple[Figures, ...]:
        """Of every effect; worked out once, for they need a linearisation."""
        each = (_stated(self, s) for s in (self.fit.deviations, self.fit.noise_deviations))
        return tuple(Figures(v, wide, narrow) for (v, wide), (_, narrow) in zip(*each, strict=True))

    @cached_property
    def values(self) -> tuple[dict[str, float], ...]:
        """Those of `figures` without deviations, which need no linearisation."""
        return tuple(v for v, _ in _stated(self, np.zeros(len(self.fit.p))))


def _stated(h: Hypothesis, spread: Real) -> list[tuple[dict[str, float], dict[str, float]]]:
    """Of every effect its figures and deviations, the unknowns having the deviations ``spread``."""
    setting, p = h.fit.setting, h.fit.p
    at = len(setting.model.parameters) - sum(e.columns for e in h.effects)
    fault = len(p) - len(setting.faults)
    out = []
    for e in h.effects:
        here = slice(at, at + e.columns) if e.columns else slice(fault, fault + 1)
        own = setting.model.parameters[here] if e.columns else ()
        unit = 1.0 if e.columns else setting.faults[fault - len(p)].unit
        out.append(e.reported(setting.model, own, p[here], spread[here], unit))
        at += e.columns
        fault += not e.columns
    return out


def of_a_rig(effect: Effect) -> bool:
    """Whether a rig does it, rather than the structure."""
    return effect.type.rig or effect.type.mount


def further(candidates: Sequence[Effect], parent: Hypothesis) -> list[Effect]:
    """Candidates that may be sought beside a parent: not what it has already, and no lump and no
    spring where a fixture stands, whose mass and springs these are."""
    fixed = {n for e in parent.effects if e.physics == FIXTURE for n in e.place.nodes}
    own = [c for c in candidates if c.key not in parent.keys]
    return [c for c in own if c.physics not in PARTS or fixed.isdisjoint(c.place.nodes)]


def only_a_rig(h: Hypothesis) -> bool:
    """Whether a rig does all that is supposed, what stands at the drive being the shaker's."""
    return all(of_a_rig(e) or at_drive(e) for e in h.effects)


def takes_all(evidence: Evidence, several: Hypothesis, single: Hypothesis) -> bool:
    """Whether one effect more leaves nothing, and a tenth at most of what a single one leaves that
    does not explain: mesh and theory err in many small ways, of which no one effect takes away so
    much, though several may."""
    left, one_more = several.fit, len(several.effects) == len(single.effects) + 1
    takes = one_more and left.misfit <= CLEARLY * single.fit.misfit and evidence.clear(left)
    return takes and not evidence.explained(single.fit, evidence.errors(single.fit))


def seed_from(
    evidence: Evidence, parent: Hypothesis, score: Score, level: int, nominal: bool = False
) -> Seed | None:
    """A further effect beside those of a fitted parent, from the size of its score; None where it
    cannot stand there. ``nominal``: nuisance parameters begin as the parent has them at a finite
    size, to which modes are followed."""
    fit, effect = parent.fit, score.effect
    try:
        planted = effect.action.plant(effect, fit.setting.model, score.p, evidence.delay_unit)
        fresh = () if planted.fault is None else (planted.fault,)
        setting = evidence.setting(planted.model, (*fit.setting.faults, *fresh), fit.setting)
        setting = evidence.at_level(setting, level)
    except ModelError:
        return None
    n, known = len(fit.setting.model.parameters), len(fit.setting.faults)
    start = np.zeros(len(setting.columns))
    start[:n] = fit.p[:n]
    added = planted.model.parameters[n:]
    lower, upper = (np.array([getattr(q, side) for q in added]) for side in ("lower", "upper"))
    if not score.exact:
        lower, upper = np.maximum(lower, -0.5), np.minimum(upper, 5.0)
    if planted.fault is None:
        start[n : n + len(added)] = np.clip(planted.start, lower, upper)
    tail = start[len(start) - len(setting.faults) :]
    tail[:known] = fit.p[len(fit.p) - known :]
    if planted.fault is not None:
        tail[known:] = planted.fault_start
    return Seed((*parent.effects, planted.effect), setting, start, nominal and score.exact)


def together(
    evidence: Evidence, parent: Hypothesis, effects: Sequence[Effect], size: float | Real = 0.0
) -> Hypothesis:
    """A parent as it is with further effects at once, unknowns of one ``size`` (or so many sizes),
    without those that cannot stand there; itself where none can, or all are no structure."""
    fit, model = parent.fit, parent.fit.setting.model
    n, known = len(model.parameters), len(fit.setting.faults)
    placed, sizes = list(parent.effects), [fit.p[:n]]
    faults, ends = list(fit.setting.faults), [fit.p[len(fit.p) - known :]]
    for effect in effects:
        moved = effect.on(evidence.context(model))
        if moved is None:
            continue
        own = np.full(moved.count, size) if np.ndim(size) == 0 else np.asarray(size)
        try:
            planted = moved.action.plant(moved, model, own, evidence.delay_unit)
        except ModelError:
            continue
        added = planted.model.parameters[len(model.parameters) :]
        model = planted.model
        placed.append(planted.effect)
        if planted.fault is None:
            lower, upper = (np.array([getattr(q, x) for q in added]) for x in ("lower", "upper"))
            sizes.append(np.clip(planted.start, lower, upper))
        else:
            faults.append(planted.fault)
            ends.append(np.array([planted.fault_start]))
    if len(placed) == len(parent.effects):
        return parent
    setting = evidence.at_level(evidence.setting(model, faults, fit.setting), fit.setting.level)
    free = np.zeros(len(setting.columns) - len(model.parameters) - len(faults))
    p = np.concatenate([*sizes, free, *ends])
    with suppress(ModelError):
        return Hypothesis(tuple(placed), evidence.evaluated(setting, p))
    return parent


def seeds_from(
    evidence: Evidence,
    parent: Hypothesis,
    scores: Collection[Score],
    level: int,
    nominal: bool = False,
) -> list[Seed]:
    """`seed_from` of those that can stand there."""
    found = (seed_from(evidence, parent, s, level, nominal) for s in scores)
    return [s for s in found if s is not None]


def nominal_unknowns(evidence: Evidence, setting: Setting, p: Real) -> Real:
    """Unknowns with the effects' as they are, the nuisance ones and damping nominal: what is
    missing bends these, and where they truly lie, near nominal, a fit finds its way and the next
    effect shows more clearly."""
    out = p.copy()
    out[: len(evidence.model.parameters)] = 0.0
    out[len(setting.model.parameters) : len(p) - len(setting.faults)] = 0.0
    return out


def at_nominal(evidence: Evidence, h: Hypothesis, level: int = 0) -> Hypothesis:
    """The hypothesis with `nominal_unknowns` at a level; as fitted where that is no structure."""
    setting = evidence.at_level(h.fit.setting, level)
    p = nominal_unknowns(evidence, setting, h.fit.p)
    with suppress(ModelError):
        return Hypothesis(h.effects, evidence.evaluated(setting, p))
    return Hypothesis(h.effects, evidence.evaluated(setting, h.fit.p))


def silenced(evidence: Evidence, h: Hypothesis, indices: Collection[int]) -> Fit | None:
    """The fitted hypothesis with some effects at no size and everything else left where it was;
    None where one has no size at which it does nothing, or that is no structure."""
    p = h.fit.p.copy()
    at, fault = len(evidence.model.parameters), len(p) - len(h.fit.setting.faults)
    for k, e in enumerate(h.effects):
        if k in indices:
            if e.change is None and e.fault is None:
                return None
            p[at : at + e.columns] = 0.0
            p[fault : fault + (not e.columns)] = 0.0
        at += e.columns
        fault += not e.columns
    with suppress(ModelError):
        return evidence.evaluated(h.fit.setting, p)
    return None


def without(evidence: Evidence, h: Hypothesis, *indices: int) -> Hypothesis | None:
    """The fitted hypothesis with one effect (or several) taken out and everything else left where
    it was: what the rest alone leaves unexplained."""
    setting, p = h.fit.setting, h.fit.p
    at, fault = len(evidence.model.parameters), len(p) - len(setting.faults)
    model, values = evidence.model, list(p[:at])
    effects: list[Effect] = []
    faults: list[tuple[Fault, float]] = []
    for k, effect in enumerate(h.effects):
        if not effect.columns:
            if k not in indices:
                faults.append((setting.faults[fault - len(p)], float(p[fault])))
                effects.append(effect)
            fault += 1
            continue
        own = p[at : at + effect.columns]
        at += effect.columns
        if k in indices:
            continue
        moved = effect.on(evidence.context(model))
        if moved is None:
            return None
        planted = moved.action.plant(moved, model, np.zeros(effect.count), evidence.delay_unit)
        effects.append(planted.effect)
        model = planted.model
        values += list(own)
    again = evidence.setting(model, [f for f, _ in faults], setting)
    q = np.zeros(len(again.columns))
    q[: len(values)] = values
    damping = p[len(setting.model.parameters) : len(p) - len(setting.faults)]
    room = len(q) - len(values) - len(faults)
    q[len(values) : len(values) + min(room, len(damping))] = damping[:room]
    q[len(q) - len(faults) :] = [value for _, value in faults]
    try:
        return Hypothesis(tuple(effects), evidence.evaluated(again, q))
    except CvxupdateError:
        return None
