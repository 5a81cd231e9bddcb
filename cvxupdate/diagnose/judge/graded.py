"""What can be said where no single hypothesis can be claimed: what nearly all likely ones have in
common, a kind of change at a place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from cvxupdate.diagnose.budget import most_sure
from cvxupdate.diagnose.hypothesis import Figures
from cvxupdate.diagnose.judge.acceptance import Case, Weighed, better, refuted, saturated
from cvxupdate.diagnose.judge.alternatives import extent, nodes_at
from cvxupdate.diagnose.judge.left_over import left_over
from cvxupdate.diagnose.judge.parts import parts_of
from cvxupdate.diagnose.judge.posterior import field_of, weights
from cvxupdate.diagnose.judge.soundness import unsound
from cvxupdate.diagnose.settings import GRADED, MOST_SURE, REGION
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.place import Place, at, where
from cvxupdate.physics.units import quantity

KINDS = {
    "mass": ("added_mass", "mass_change", "sensor_mass"),
    "stiffness": (
        "stiffness_change",
        "grounding_spring",
        "joint_flexibility",
        "axial_preload",
        "shear_deformation",
        "orthotropy",
    ),
    "damping": ("viscous_damper", "structural_damping", "mass_proportional_damping"),
    "measurement": ("sensor_fault",),
}
SAYS = {
    "mass": "a mass differs",
    "stiffness": "a stiffness differs",
    "damping": "damping differs",
    "measurement": "a channel of the measurement is wrong",
    "": "something differs",
}
MASS = "kg"
LEADS = 4  # likely places around which a region is grown


@dataclass(frozen=True)
class Graded:
    """A kind of change (empty: of any kind) at a place (without nodes and elements: anywhere), how
    likely it is part of the truth, what part of the misfit the likeliest hypothesis that has it
    explains; where all that have it are of one effect, its first figure with deviation, and what it
    is in words where its place does not say it (``title``); what that hypothesis leaves (``rest``).
    """

    kind: str
    place: Place
    probability: float
    explains: float
    figure: tuple[str, str, float, float] | None = None
    title: str = ""
    rest: str = ""
    having: tuple[tuple[Weighed, int, float], ...] = ()

    @property
    def says(self) -> str:
        """One sentence."""
        spot = self.place if self.place.nodes or self.place.elements else None
        there = "" if spot is None else at(spot) if spot.elements else f"at {where(spot)}"
        there = f": {self.title}" if self.title else f" {there}".rstrip()
        much = ""
        if self.figure is not None:
            _, unit, value, std = self.figure
            much = f", {quantity(value, unit)} (± {quantity(std, unit)})"
        return (
            f"What can be said: {SAYS[self.kind]}{there}{much} (probability "
            f"{100 * self.probability:.0f} %, whatever else is wrong); the likeliest such change "
            f"{self.part}"
        )

    @property
    def part(self) -> str:
        """What part of the mismatch it explains, and what is left."""
        return f"explains {100 * self.explains:.0f} % of the mismatch. {self.rest}".rstrip()

    def to_json(self) -> dict[str, object]:
        """The entry ``graded`` of diagnosis.json."""
        out: dict[str, object] = {
            "kind": self.kind or "any",
            "location": self.place.to_json(),
            "probability": self.probability,
            "explains": self.explains,
            "says": self.says,
        }
        if self.figure is not None:
            name, _, value, std = self.figure
            out |= {"parameters": {name: value}, "standard_deviation": {name: std}}
        return out


@dataclass(frozen=True)
class _Member:
    """An effect of a hypothesis: whose (its number in the field), which of its effects, its
    kind, its nodes."""

    owner: int
    number: int
    effect: Effect
    figures: Figures
    kind: str
    nodes: frozenset[int]


def graded(tried: Sequence[Weighed], case: Case) -> Graded | None:
    """The most that is likely: a kind at a place, else a place, else a kind; None where nothing
    reaches `GRADED`. Hypotheses that say nothing (`_says`), or have no sound effect, count against
    all, and what was not tried for want of time might; what a hypothesis has beside, too small to
    be told, says nothing, nor does one of which a part alone is likelier (Occam's window; Madigan
    and Raftery 1994).

    Probabilities are those of the posterior times the part of the misfit that it explains in the
    likeliest hypothesis: what makes the rest may stand for this, too.
    """
    if case.damping_only or not tried:
        return None
    field = field_of(tried[0], tried[1:], case)
    likely = _windowed(field, weights(field, case))
    most = most_sure(case.evidence.unfinished)
    good = [k for k, w in enumerate(field) if likely[k] > 0.0 and _says(w, case)]
    model = case.evidence.model
    members = [m for k in good for m in _members(k, field[k], case)]
    if not members:
        return None
    parts = cache(lambda k: parts_of(case, field[k]))
    for claim in _claims(members, likely, model):
        owners = {m.owner for m in claim}
        best = max(owners, key=lambda k: likely[k])
        there = float(likely[sorted(owners)].sum())
        if there < GRADED:
            continue
        explains = sum(parts(best)[j] for j in {m.number for m in claim if m.owner == best})
        sure = min(most, there * explains)
        if sure >= GRADED:
            said = _said(claim, likely, sure, explains, model)
            ranked = sorted(claim, key=lambda m: -likely[m.owner])
            having = tuple((field[m.owner], m.number, float(likely[m.owner])) for m in ranked)
            return replace(said, rest=left_over(field[best], field, case), having=having)
    return None


def _says(w: Weighed, case: Case) -> bool:
    """Whether a hypothesis says something: better than nothing, not another way to write down as
    many figures as it has unknowns, nor refuted by what was held out."""
    return better(w, case.base, case) and not (saturated(w, case) or refuted(w, case))


def _windowed(field: Sequence[Weighed], likely: np.ndarray) -> np.ndarray:
    """Probabilities of a field without those of which another is a part that is likelier."""
    keys = [w.hypothesis.keys for w in field]
    kept = [
        not any(keys[j] < own and likely[j] > likely[k] for j in range(len(field)))
        for k, own in enumerate(keys)
    ]
    out = np.where(kept, likely, 0.0)
    return np.asarray(out / out.sum())


def _members(owner: int, w: Weighed, case: Case) -> Iterator[_Member]:
    """The sound effects of a hypothesis."""
    h, model = w.hypothesis, case.evidence.model
    small = unsound(h, case.evidence)
    for j, (effect, figures) in enumerate(zip(h.effects, h.figures, strict=True)):
        kind = next((k for k, names in KINDS.items() if effect.physics in names), "")
        if j not in small:
            yield _Member(owner, j, effect, figures, kind, nodes_at(effect, model))


def _claims(
    members: Sequence[_Member], likely: np.ndarray, model: Model
) -> Iterator[Sequence[_Member]]:
    """What may be said, most first: one effect, of one kind at a place, of any kind at a place, of
    one kind anywhere; of each the likeliest first."""
    kinds = [k for k in dict.fromkeys(m.kind for m in members) if k]
    by_kind = [[m for m in members if m.kind == k] for k in kinds]

    def weight(claim: Sequence[_Member]) -> float:
        return -float(likely[sorted({m.owner for m in claim})].sum())

    ones = dict.fromkeys(m.effect.key for m in members if _spread(m, model))
    yield from sorted(([m for m in members if m.effect.key == k] for k in ones), key=weight)
    yield from sorted((r for ms in by_kind for r in _regions(ms, likely, model)), key=weight)
    yield from sorted(_regions(members, likely, model), key=weight)
    yield from sorted(by_kind, key=weight)


def _spread(m: _Member, model: Model) -> bool:
    """Whether an effect is a claim by itself: of elements, or of nodes all over the structure."""
    return bool(m.effect.place.elements) or REGION < extent(m.nodes, model) < np.inf


def _regions(
    members: Sequence[_Member], likely: np.ndarray, model: Model
) -> Iterator[Sequence[_Member]]:
    """Members near one another, around each of the likeliest: next ones join, likeliest first, as
    long as the whole is small beside the structure, and are needed for next to all of it."""
    ranked = sorted((m for m in members if m.nodes), key=lambda m: -likely[m.owner])
    for lead in ranked[:LEADS]:
        near, nodes = [lead], lead.nodes
        for other in ranked:
            if other is not lead and extent(nodes | other.nodes, model) <= REGION:
                near, nodes = [*near, other], nodes | other.nodes
        if extent(nodes, model) <= REGION:
            yield _needed(near, likely)


def _needed(near: Sequence[_Member], likely: np.ndarray) -> Sequence[_Member]:
    """The likeliest of some members, which make `MOST_SURE` of the probability of them all."""
    owners = sorted({m.owner for m in near}, key=lambda k: -likely[k])
    share = np.cumsum(likely[owners]) / max(float(likely[owners].sum()), 1e-300)
    most = owners[: int(np.searchsorted(share, MOST_SURE)) + 1]
    return [m for m in near if m.owner in most]


def _said(
    claim: Sequence[_Member], likely: np.ndarray, sure: float, explains: float, model: Model
) -> Graded:
    kinds, nodes = {m.kind for m in claim}, sorted(set().union(*(m.nodes for m in claim)))
    if len({m.effect.key for m in claim}) == 1 and _spread(claim[0], model):
        one = claim[0].effect
        title = one.title if one.spot or one.place == Place() else ""
        return Graded(kinds.pop(), one.place, sure, explains, _figure(claim, likely), title)
    regional = extent(frozenset(nodes), model) <= REGION
    dofs = {m.effect.place.dof for m in claim}
    place = Place(nodes=tuple(nodes), dof=dofs.pop() if len(dofs) == 1 else None)
    return Graded(
        kinds.pop() if len(kinds) == 1 else "",
        place if regional else Place(),
        sure,
        explains,
        _figure(claim, likely),
    )


def _figure(claim: Sequence[_Member], likely: np.ndarray) -> tuple[str, str, float, float] | None:
    """Mean over all that have it, with their scatter; None where they are of several effects, or
    have no unit of their own (a factor of one element is none of another). Masses add up."""
    q = claim[0].effect.figures[0] if claim[0].effect.figures else None
    if q is None or not q.unit or q.unit == "1":
        return None
    alike = {tuple((f.name, f.unit) for f in m.effect.figures[:1]) for m in claim}
    if len(alike) > 1 or (len({m.effect.physics for m in claim}) > 1 and q.unit != MASS):
        return None
    owners = list(dict.fromkeys(m.owner for m in claim))
    own = [[m.figures for m in claim if m.owner == k] for k in owners]
    if q.unit != MASS:
        own = [some[:1] for some in own]
    share = likely[owners] / likely[owners].sum()
    values = np.array([sum(f.values[q.name] for f in some) for some in own])
    squares = np.array([sum(f.deviations[q.name] ** 2 for f in some) for some in own])
    mean = float(share @ values)
    return q.name, q.unit, mean, float(np.sqrt(share @ (squares + (values - mean) ** 2)))
