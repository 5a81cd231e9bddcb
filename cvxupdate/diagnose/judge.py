"""Judgement on trials: is the mismatch explained, what do the recordings fail to separate, how sure
is a finding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cvxupdate.diagnose.effects import Effect, Trial
from cvxupdate.diagnose.engine import DAMPING_GAIN, EXPLAINED, OPEN, Outcome, mesh_allowance
from cvxupdate.diagnose.finding import Finding
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.shortlist import Key
from cvxupdate.fe.model import Model
from cvxupdate.physics.place import Place

# a finding must halve the misfit beyond noise, and the held-out error of the model as it was
HALVED = 0.5
LOWER = 0.7  # of the held-out error with ordinary parameters, noise apart
# misfit beyond noise within this factor of the best: the recordings do not separate the two
RIVAL = 2.0
UNEXPLAINED = (
    0.1  # response error above which even the best model leaves the recordings unexplained
)
SURE = 0.4  # confidence below which a further effect is not claimed
FAINT = 0.15  # and below which none is
MET = 1.1  # times the noise: a held-out error that cannot become lower
TWICE = 2.0  # times what the mesh may leave: nothing below it is taken for a second effect
# drop of a misfit that already counts as explained, from which on a doubtful finding is told all
# the same
LARGE = 4.0


class Supposed(Protocol):
    """A set of effects that was fitted, to responses or to tables of modes."""

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What is supposed."""

    @property
    def keys(self) -> frozenset[Key]:
        """The same, to compare by."""


@dataclass(frozen=True)
class Judged:
    """A trial with its response errors on what was fitted and on what was held out (NaN: nothing
    was)."""

    trial: Trial
    error: float
    hold_out: float

    @property
    def misfit(self) -> float:
        """Weighted squares per row."""
        return self.trial.fit.misfit

    @property
    def excess(self) -> float:
        """Those beyond noise."""
        return self.trial.fit.excess


def judged(outcome: Outcome, trials: Sequence[Trial]) -> list[Judged]:
    """Errors of every trial, in order."""
    return [Judged(t, *outcome.errors(t)) for t in trials]


def beyond(error: float, noise: float) -> float:
    """The part of a response error that is not noise."""
    return float(np.sqrt(max(error**2 - noise**2, 0.0)))


def halves(t: Judged, outcome: Outcome) -> bool:
    """Whether a single effect halves the misfit that ordinary parameters leave, and shows on what
    was held out."""
    fit = t.trial.fit
    if outcome.pattern:
        drop = outcome.base.damping_strain - fit.damping_strain
        return (
            t.trial.effects[0].candidate.type.damping
            and drop > max(DAMPING_GAIN, HALVED * outcome.base.damping_strain)
            and fit.misfit <= 1.05 * outcome.base.misfit
        )
    return fit.excess <= HALVED * outcome.base.excess and shows(t, outcome.ordinary[1], outcome)


def shows(t: Judged, before: float, outcome: Outcome) -> bool:
    """`shown` of a trial among responses."""
    return shown(t.hold_out, before, outcome.nominal[1], outcome.noise[1])


def shown(hold_out: float, before: float, nominal: float, noise: float) -> bool:
    """Whether the held-out error is half of what it was with the model as it came, and clearly
    below ``before`` or at the noise; true where nothing was held out (NaN)."""
    if not np.isfinite(hold_out):
        return True
    lower = hold_out <= max(LOWER * before, MET * noise) or beyond(
        hold_out, noise
    ) <= LOWER * beyond(before, noise)
    return bool(hold_out <= HALVED * nominal and lower)


def doubles(pair: Judged, single: Judged | None, outcome: Outcome) -> bool:
    """Whether two effects are needed: they explain, and leave at most half of the misfit that the
    best one leaves, which is more than the mesh's."""
    if single is not None and single.error <= TWICE * mesh_allowance(
        outcome, single.trial.fit.setting.model
    ):
        return False
    excess, error = (
        (outcome.base.excess, outcome.ordinary[1])
        if single is None
        else (single.excess, single.hold_out)
    )
    return (
        explained(pair, outcome) and pair.excess <= HALVED * excess and shows(pair, error, outcome)
    )


def explained(t: Judged, outcome: Outcome) -> bool:
    """Whether what a trial leaves is within noise and the allowances for discretisation."""
    left = np.nanmax([t.hold_out, t.error])
    return bool(
        t.misfit <= OPEN * EXPLAINED or left <= mesh_allowance(outcome, t.trial.fit.setting.model)
    )


def credible(t: Judged, outcome: Outcome) -> bool:
    """The same with a tenth of the response allowed: one clear effect may stand although the model
    is not exact."""
    return explained(t, outcome) or bool(np.nanmax([t.hold_out, t.error]) <= UNEXPLAINED)


def rivals(best: Judged, others: Sequence[Judged], outcome: Outcome) -> list[Judged]:
    """Other trials that the recordings do not separate from the best."""
    if outcome.pattern:
        return [
            t
            for t in others
            if t is not best
            and t.trial.fit.damping_strain <= best.trial.fit.damping_strain + DAMPING_GAIN / 2
        ]
    return [
        t
        for t in others
        if t is not best
        and t.excess <= RIVAL * best.excess
        and (not np.isfinite(t.hold_out) or t.hold_out <= RIVAL * best.hold_out)
    ]


def equivalents(effect: Effect, best: Supposed, near: Sequence[Supposed]) -> list[Effect]:
    """What may stand for ``effect``: the odd one out of each rival that shares all other effects
    with the best."""
    rest = best.keys - {effect.key}
    out: dict[object, Effect] = {}
    for rival in near:
        if rest <= rival.keys:
            for other in rival.effects:
                if other.key not in best.keys:
                    out.setdefault(other.key, other)
    return list(out.values())


def overlapping(a: Place, b: Place, model: Model | None = None) -> bool:
    """Whether two places share most of their elements, or a node; with ``model`` also a few
    elements with nodes that are theirs."""
    if a.elements and b.elements:
        common = len(set(a.elements) & set(b.elements))
        return common >= 0.5 * len(set(a.elements) | set(b.elements))
    if model is not None and (a.elements or b.elements) and (a.nodes or b.nodes):
        few, nodes = (a, b) if a.elements else (b, a)
        ends = nodes_of(model, few.elements)
        return bool(nodes.nodes) and len(ends) <= len(nodes.nodes) + 1 and set(nodes.nodes) <= ends
    return bool(set(a.nodes) & set(b.nodes)) and a.dof == b.dof


def nodes_of(model: Model, elements: Sequence[int]) -> set[int]:
    """Numbers of the nodes that elements stand on, wholly held ones left out."""
    wanted = np.array(elements, dtype=np.int64)
    found: set[int] = set()
    for block in model.blocks:
        used = block.dofs[np.isin(block.ids, wanted)]
        found.update(model.node_ids[model.dof_node[used[used >= 0]]].tolist())
    return found


def has(t: Supposed, effect: Effect, model: Model) -> bool:
    """Whether a trial has an effect where ``effect`` stands."""
    place = effect.candidate.place
    return any(
        place == p
        or overlapping(place, p, model)
        or (bool(place.elements) and set(place.elements) <= set(p.elements))
        for p in (other.candidate.place for other in t.effects)
    )


@dataclass(frozen=True)
class Standing:
    """What the confidence in an effect rests on; logarithms are decimal.

    ``lead``: misfit of the next hypothesis without anything at its place, over the best (log);
    ``gain``: misfit of the ordinary model over the best (log); ``left``: the best misfit (log);
    ``weight``: its size in its own deviations (log); ``rivals``: how many hypotheses without it
    come as near as the best; ``alike``: how many have something else at its place.
    """

    lead: float
    gain: float
    left: float
    weight: float
    rivals: int
    alike: int


@dataclass(frozen=True)
class Competitor:
    """Another hypothesis: its misfit, whether it has something at the place in question, whether it
    is among the `rivals`."""

    misfit: float
    there: bool
    rival: bool


def standing(number: int, best: Judged, others: Sequence[Judged], outcome: Outcome) -> Standing:
    """`Standing` of effect ``number`` of the best trial among all that were refitted."""
    effect = best.trial.effects[number]
    near = {id(r) for r in rivals(best, others, outcome)}
    field = [
        Competitor(
            _scale(t.trial.fit, outcome),
            has(t.trial, effect, outcome.bench.ordinary),
            id(t) in near,
        )
        for t in others
        if t is not best
    ]
    return standing_of(
        _scale(best.trial.fit, outcome),
        _scale(outcome.base, outcome),
        field,
        size_of(effect, *best.trial.figures[number]),
    )


def standing_of(mine: float, base: float, field: Sequence[Competitor], size: float) -> Standing:
    """`Standing` from the misfits of the best (``mine``), the ordinary model (``base``) and all
    others; ``size`` in deviations."""
    following = min([t.misfit for t in field if not t.there] + [base])
    near = [t for t in field if t.rival]

    def log(x: float) -> float:
        return float(np.log10(np.clip(x, 1e-3, 1e4)))

    there = sum(t.there for t in near)
    return Standing(
        log(following / max(mine, 1e-9)),
        log(base / max(mine, 1e-9)),
        log(mine),
        log(size),
        len(near) - there,
        there,
    )


def size_of(effect: Effect, values: Mapping[str, float], deviations: Mapping[str, float]) -> float:
    """An effect's size in its own deviations; infinite where no effect is no number (a rigid
    joint)."""
    q = effect.candidate.figures[0]
    if q.nothing is None:
        return float(np.inf)
    return abs(values[q.name] - q.nothing) / max(deviations[q.name], 1e-12)


def _scale(found: Fit, outcome: Outcome) -> float:
    return found.damping_strain if outcome.pattern else found.excess


def confidence(s: Standing) -> float:
    """How far ahead of the next thing that is something else: 1 − (misfit ratio), within 0.3 and
    0.99, shared among rivals elsewhere."""
    return float(np.clip(1.0 - 10.0 ** -max(s.lead, 0.0), 0.3, 0.99)) / (1.0 + 0.5 * s.rivals)


def claimed(findings: Sequence[Finding], base: float, left: float) -> tuple[Finding, ...]:
    """Those told, of findings in order: of two, one whose place the recordings cannot tell is not;
    nor is a doubtful one for a misfit ``base`` that counts as explained already, unless it drops to
    a fraction (``left``)."""
    told = tuple(f for f in findings if f.confidence >= SURE)
    small = base <= OPEN * EXPLAINED and left > base / LARGE
    return told or (() if small else tuple(findings[:1]))


def verdict_of(findings: Sequence[Finding]) -> tuple[str, str]:
    """(verdict, sentence) of what is claimed."""
    whole = all(
        f.physics in ("stiffness_change", "mass_change") and f.place.groups for f in findings
    )
    return "parameter_error" if whole else "missing_physics", " ".join(f.says for f in findings)
