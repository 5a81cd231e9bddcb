"""What can be said where no single hypothesis can be claimed: what nearly all likely ones have in
common, a kind of change at a place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.hypothesis import Figures
from cvxupdate.diagnose.judge.acceptance import Case, Weighed, better
from cvxupdate.diagnose.judge.alternatives import extent, nodes_at
from cvxupdate.diagnose.judge.posterior import field_of, weights
from cvxupdate.diagnose.judge.soundness import sound
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
LEADS = 4  # likely places around which a region is grown


@dataclass(frozen=True)
class Graded:
    """A kind of change (empty: of any kind) at a place (without nodes and elements: anywhere), how
    likely it is part of the truth, what part of the misfit the likeliest hypothesis that has it
    explains; where all that have it are of one effect, its first figure with deviation."""

    kind: str
    place: Place
    probability: float
    explains: float
    figure: tuple[str, str, float, float] | None = None

    @property
    def says(self) -> str:
        """One sentence."""
        spot = self.place if self.place.nodes or self.place.elements else None
        there = "" if spot is None else f" {at(spot)}" if spot.elements else f" at {where(spot)}"
        much = ""
        if self.figure is not None:
            _, unit, value, std = self.figure
            much = f", {quantity(value, unit)} (± {quantity(std, unit)})"
        return (
            f"What can be said: {SAYS[self.kind]}{there}{much} (probability "
            f"{100 * self.probability:.0f} %, whatever else is wrong); the likeliest such change "
            f"explains {100 * self.explains:.0f} % of the mismatch."
        )

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
    """An effect of a hypothesis: whose (its number in the field), its kind, its nodes."""

    owner: int
    effect: Effect
    figures: Figures
    kind: str
    nodes: frozenset[int]


def graded(tried: Sequence[Weighed], case: Case) -> Graded | None:
    """The most that is likely: a kind at a place, else a place, else a kind; None where nothing
    reaches `GRADED`. Hypotheses that are unsound, or no better than nothing, count against all.

    Probabilities are those of the posterior times the part of the misfit that the likeliest
    hypothesis explains: what makes the rest may stand for this, too.
    """
    if case.damping_only or not tried:
        return None
    field = field_of(tried[0], tried[1:], case)
    likely = weights(field, case)
    good = [k for k, w in enumerate(field) if w.unknowns and likely[k] > 0.0 and _good(w, case)]
    if not good:
        return None
    model, whole = case.evidence.model, max(case.scale(case.base), 1e-300)
    members = [m for k in good for m in _members(k, field[k], model)]
    explains = [float(np.clip(1.0 - case.scale(w) / whole, 0.0, 1.0)) for w in field]
    for claim in _claims(members, likely, model):
        owners = {m.owner for m in claim}
        best = max(owners, key=lambda k: likely[k])
        sure = min(MOST_SURE, float(likely[sorted(owners)].sum()) * explains[best])
        if sure >= GRADED:
            return _said(claim, likely, sure, explains[best], model)
    return None


def _good(w: Weighed, case: Case) -> bool:
    return sound(w.hypothesis, case.evidence) and better(w, case.base, case)


def _members(owner: int, w: Weighed, model: Model) -> Iterator[_Member]:
    for effect, figures in zip(w.hypothesis.effects, w.hypothesis.figures, strict=True):
        kind = next((k for k, names in KINDS.items() if effect.physics in names), "")
        yield _Member(owner, effect, figures, kind, nodes_at(effect, model))


def _claims(
    members: Sequence[_Member], likely: np.ndarray, model: Model
) -> Iterator[Sequence[_Member]]:
    """What may be said, most first: one effect, of one kind at a place, of any kind at a place, of
    one kind anywhere; of each the likeliest first."""
    kinds = [k for k in dict.fromkeys(m.kind for m in members) if k]
    by_kind = [[m for m in members if m.kind == k] for k in kinds]

    def weight(claim: Sequence[_Member]) -> float:
        return -float(likely[sorted({m.owner for m in claim})].sum())

    ones = dict.fromkeys(m.effect.key for m in members if m.effect.place.elements)
    yield from sorted(([m for m in members if m.effect.key == k] for k in ones), key=weight)
    yield from sorted((r for ms in by_kind for r in _regions(ms, likely, model)), key=weight)
    yield from sorted(_regions(members, likely, model), key=weight)
    yield from sorted(by_kind, key=weight)


def _regions(
    members: Sequence[_Member], likely: np.ndarray, model: Model
) -> Iterator[Sequence[_Member]]:
    """Members near one another, around each of the likeliest: next ones join, likeliest first, as
    long as the whole is small beside the structure."""
    ranked = sorted((m for m in members if m.nodes), key=lambda m: -likely[m.owner])
    for lead in ranked[:LEADS]:
        near, nodes = [lead], lead.nodes
        for other in ranked:
            if other is not lead and extent(nodes | other.nodes, model) <= REGION:
                near, nodes = [*near, other], nodes | other.nodes
        if extent(nodes, model) <= REGION:
            yield near


def _said(
    claim: Sequence[_Member], likely: np.ndarray, sure: float, explains: float, model: Model
) -> Graded:
    kinds, nodes = {m.kind for m in claim}, sorted(set().union(*(m.nodes for m in claim)))
    if len({m.effect.key for m in claim}) == 1 and claim[0].effect.place.elements:
        place = claim[0].effect.place
        return Graded(kinds.pop(), place, sure, explains, _figure(claim, likely))
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
    have no unit of their own (a factor of one element is none of another)."""
    q = claim[0].effect.figures[0] if claim[0].effect.figures else None
    if q is None or len({m.effect.physics for m in claim}) > 1 or not q.unit or q.unit == "1":
        return None
    share = np.array([likely[m.owner] for m in claim])
    share = share / share.sum()
    values = np.array([m.figures.values[q.name] for m in claim])
    std = np.array([m.figures.deviations[q.name] for m in claim])
    mean = float(share @ values)
    return q.name, q.unit, mean, float(np.sqrt(share @ (std**2 + (values - mean) ** 2)))
