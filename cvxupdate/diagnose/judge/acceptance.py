"""When a hypothesis is accepted: it halves what its rival of less freedom leaves, shows on what was
held out, and leaves what noise and the model's discrepancy may be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig, takes_all
from cvxupdate.diagnose.modes.kinds import bulk
from cvxupdate.diagnose.nominal.wanted import by_tables_alone
from cvxupdate.diagnose.settings import (
    CLEARLY,
    DAMPING_COST,
    DAMPING_GAIN,
    EXPLAINED,
    HALVED,
    LARGE,
    LOWER,
    MET,
    OPEN,
    STRONG,
    TWICE,
    UNEXPLAINED,
)
from cvxupdate.diagnose.types import Errors, Evidence
from cvxupdate.physics.effect import MODES, MOTION


@dataclass(frozen=True)
class Weighed:
    """A hypothesis with its errors; ``freed``: nuisance parameters that it lets go beyond their
    scatter, which count as unknowns; ``held_out``: log-likelihood of what was held out."""

    hypothesis: Hypothesis
    errors: Errors
    freed: int = 0
    held_out: float = 0.0

    @property
    def fit(self) -> Fit:
        """Its fit."""
        return self.hypothesis.fit

    @property
    def unknowns(self) -> int:
        """Beyond the nuisance parameters within their scatter."""
        return self.hypothesis.unknowns + self.freed


def weighed(evidence: Evidence, h: Hypothesis, freed: int = 0) -> Weighed:
    """A hypothesis with its errors."""
    return Weighed(h, evidence.errors(h.fit), freed, evidence.held_out(h.fit))


@dataclass(frozen=True)
class Case:
    """What every judgement compares with: the evidence, the nuisance parameters alone (``base``),
    and whether only the pattern of damping is at stake."""

    evidence: Evidence
    base: Weighed
    damping_only: bool

    def weighed(self, h: Hypothesis, freed: int = 0) -> Weighed:
        """A hypothesis with its errors."""
        return weighed(self.evidence, h, freed)

    @cached_property
    def places(self) -> int:
        """Where what is sought may stand, beside what a rig does."""
        found = self.evidence.candidates(self.evidence.model)
        return max(1, len({e.place for e in found if not of_a_rig(e)}))

    @cached_property
    def free(self) -> float:
        """Figures that tell of effects, counted without these, for what they put in the band tells
        nothing; of responses by the modes that are seen there, if the model has fewer in the band:
        a heavy fixture brings its own."""
        fit = self.base.fit
        damped = fit.independent - fit.free
        return fit.free + max(0.0, self.evidence.resonances - damped)

    def scale(self, w: Weighed) -> float:
        """What is compared: misfit beyond noise, or the strain on damping ratios."""
        return w.fit.damping_strain if self.damping_only else w.fit.excess


def beyond(error: float, noise: float) -> float:
    """The part of an error that is not noise."""
    return float(np.sqrt(max(error**2 - noise**2, 0.0)))


def shown(hold_out: float, before: float, nominal: float, noise: float) -> bool:
    """Whether a held-out error is no more than noise (where that is known), or half of the nominal
    model's, noise apart, and either clearly below ``before`` or at the noise; true where nothing
    was held out (NaN)."""
    if not np.isfinite(hold_out) or hold_out <= noise:
        return True
    floor = MET * noise if np.isfinite(noise) else 0.0
    lower = hold_out <= max(LOWER * before, floor)
    lower = lower or beyond(hold_out, noise) <= LOWER * beyond(before, noise)
    half = hold_out <= HALVED * nominal or beyond(hold_out, noise) <= HALVED * beyond(
        nominal, noise
    )
    return bool(half and lower)


def refuted(w: Weighed, case: Case) -> bool:
    """Whether what was held out says no to a hypothesis: it tells that hardly better than the
    nuisance parameters alone, however near it comes to what was fitted."""
    if case.damping_only:
        return False
    evidence, held = case.evidence, (w.errors.hold_out, case.base.errors.hold_out)
    return not shown(*held, evidence.nominal.hold_out, evidence.noise.hold_out)


def information(after: Fit, before: Fit, further: int) -> float:
    """Change of Bayes' information criterion (Kass and Raftery 1995) for ``further`` unknowns."""
    n = after.rows
    ratio = max(after.misfit, 1e-300) / max(before.misfit, 1e-300)
    return float(n * np.log(ratio) + further * np.log(n))


def better(w: Weighed, before: Weighed, case: Case, further: int = 1) -> bool:
    """Whether a hypothesis halves the misfit beyond noise of one with less freedom, once for each
    effect that it has ``further``, for more than its unknowns are worth, and shows on what was held
    out. What a sound model may leave is made of one or two patterns that some effect or other
    resembles: there each must take away nearly all; not where something was fitted to tables
    without a reference already, for in the tolerance of any model much explains them."""
    evidence = case.evidence
    if case.damping_only:
        return _damps(w, before)
    if _bent(w) and within_mesh(before, case):
        return False
    fitted = before.hypothesis.effects and by_tables_alone(evidence)
    least = HALVED if fitted or not explained(before, case) else 1.0 / LARGE
    once = w.fit.excess <= least**further * before.fit.excess
    if evidence.told_by == MOTION and not explained(before, case):
        once |= halved(w, before, case)
    enough = information(w.fit, before.fit, w.unknowns - before.unknowns) < -STRONG
    return once and enough and _shows(w, before, case)


def _shows(w: Weighed, before: Weighed, case: Case) -> bool:
    """On what was held out; where a law is sought in what a sound model may miss anyhow, on what
    changes between levels."""
    if case.evidence.told_by == MOTION and explained(before, case):
        told = _foretells(w, before, case)
        if told is not None:
            return told
    held, evidence = (w.errors.hold_out, before.errors.hold_out), case.evidence
    return shown(*held, evidence.nominal.hold_out, evidence.noise.hold_out)


def _foretells(w: Weighed, before: Weighed, case: Case) -> bool | None:
    """Whether a law foretells most of what changes between levels, of those fitted and from these
    to what was held out: the error of the responses is mostly what a model misses at every level
    alike, which says nothing of a law. None where no levels compare."""
    after, other = (case.evidence.between_levels(x.fit) for x in (w, before))
    pairs = ((after.fit, other.fit), (after.hold_out, other.hold_out))
    told = [a <= HALVED * b for a, b in pairs if np.isfinite(a)]
    return all(told) if told else None


def halved(w: Weighed, before: Weighed, case: Case) -> bool:
    """Whether the error beyond noise is half, of what was fitted and of what was held out. The
    misfit of motion also has lines where nothing was forced, whose noise is only known to within a
    bound, that of responses those of light resonances: they may keep it up whatever is found."""
    noise = case.evidence.noise
    pairs = [(w.errors.fit, before.errors.fit, noise.fit)]
    if np.isfinite(w.errors.hold_out):
        pairs.append((w.errors.hold_out, before.errors.hold_out, noise.hold_out))
    return all(beyond(a, n) <= HALVED * beyond(b, n) for a, b, n in pairs)


def _damps(w: Weighed, before: Weighed) -> bool:
    drop = before.fit.damping_strain - w.fit.damping_strain
    return (
        all(e.type.damping for e in w.hypothesis.effects)
        and drop > max(DAMPING_GAIN, HALVED * before.fit.damping_strain)
        and w.fit.misfit <= DAMPING_COST * before.fit.misfit
    )


def explained(w: Weighed, case: Case) -> bool:
    """Whether what a hypothesis leaves is within noise and the allowances for the model."""
    return case.evidence.explained(w.fit, w.errors)


def credible(w: Weighed, case: Case) -> bool:
    """The same; or one clear effect may stand although the model is not exact: a tenth of the
    responses is left, and a tenth of the misfit; of modes without the one that was farthest off,
    for beside one that is none of the model's anything is clear. Nor is it beside a model that is
    far off: there what takes away nine tenths may imitate several things, and of tables little is
    left (`OPEN`), that one mode apart."""
    near = case.evidence.relative(w.errors) <= UNEXPLAINED
    if case.evidence.told_by == MODES:
        near &= bulk(w.fit) <= OPEN * EXPLAINED
    clear = case.damping_only or w.fit.misfit <= CLEARLY * bulk(case.base.fit)
    return explained(w, case) or (near and clear)


def within_mesh(w: Weighed, case: Case, times: float = 1.0) -> bool:
    """Whether what a hypothesis leaves may be the mesh's, and that of the theory of sheets, or so
    many times that: nothing is taken out of it."""
    return w.errors.fit <= times * case.evidence.allowance(w.fit.setting.model)


def meshed(w: Weighed, case: Case) -> bool:
    """The same of twice that, beside what was found already."""
    return within_mesh(w, case, TWICE)


def _bent(w: Weighed) -> bool:
    """Whether it changes frequencies and shapes, as a mesh does: not faults of sensors alone, nor
    damping."""
    effects = w.hypothesis.effects
    return not effects or any(e.change is not None and not e.type.damping for e in effects)


def saturated(w: Weighed, case: Case) -> bool:
    """Whether several effects have as many unknowns as there are figures to tell them by: another
    way to write these down."""
    many = len(w.hypothesis.effects) > 1 and w.unknowns >= case.base.fit.free
    return many and w.unknowns >= case.free


def needs_several(several: Weighed, single: Weighed | None, case: Case) -> bool:
    """Whether several effects are needed: they are credible, as a single one must be, and each
    beyond the best accepted set of fewer (``single``; by modes, if that is credible) halves what
    that leaves, which is more than the mesh's; or one takes away next to all of it (`takes_all`).
    """
    if saturated(several, case):
        return False
    few_held_out = case.evidence.told_by == MODES  # a mode may be told by chance
    if single is None or (few_held_out and not credible(single, case)):
        return credible(several, case) and better(several, case.base, case)
    if meshed(single, case) and not takes_all(case.evidence, several.hypothesis, single.hypothesis):
        return False
    further = len(several.hypothesis.effects) - len(single.hypothesis.effects)
    return credible(several, case) and better(several, single, case, max(1, further))
