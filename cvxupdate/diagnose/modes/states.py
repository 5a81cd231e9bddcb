"""What several states of one structure have in common: an effect of one size that moves from state
to state, or that stays where it is and grows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.finite_size import BASIS, QUICK, TOGETHER, local, traced
from cvxupdate.diagnose.modes.scene import Scene, scene
from cvxupdate.diagnose.modes.setting import ModesSetting
from cvxupdate.diagnose.modes.together import Together, fitted_together, together
from cvxupdate.diagnose.types import Real, Score
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.effect import Effect
from cvxupdate.residual.following import followed

SIZES = 25  # that are tried, the same in all states, in geometric progression
LEAST = 1e-3  # the smallest, in the unit of the effect's parameter
STRAIGHT = 1e-6  # departure of a figure from a line in its parameter that is rounding


@dataclass(frozen=True)
class State:
    """A state with what its tables say of the model."""

    name: str
    evidence: ModesEvidence

    @cached_property
    def nominal(self) -> Hypothesis:
        """The nominal model, nothing fitted."""
        evidence = self.evidence
        setting = evidence.bases[0].setting
        return Hypothesis((), evidence.evaluated(setting, evidence.model.zero()))

    @cached_property
    def around(self) -> Scene:
        """Where sizes are tried."""
        point, setting = self.nominal.fit.point, self.nominal.fit.setting
        at, model = point.matrices, setting.model
        count = min(model.size, max(BASIS, len(point.modes.eigenvalues)))
        many = natural_modes(at.K, at.M, count, rigid_body_modes(model, at.K, at.M))
        return scene(point, setting.scales, many)

    def left(self, effects: Sequence[Effect], sizes: Real) -> Real:
        """(n, s): what local effects of one kind leave at ``sizes`` (n, s)."""
        parts = [
            traced(self.around, effects[k : k + TOGETHER], sizes[k : k + TOGETHER], QUICK.modes)
            for k in range(0, len(effects), TOGETHER)
        ]
        return np.vstack(parts)

    def with_effect(self, effect: Effect, size: float) -> ModesSetting | None:
        """The model with an effect, modes followed to its size; None where it cannot stand."""
        score = Score(effect, 0.0, np.array([size]), exact=True)
        seed = seed_from(self.evidence, self.nominal, score, 0, nominal=True)
        if seed is None:
            return None
        setting: ModesSetting = seed.setting
        try:
            return replace(setting, residual=followed(setting.residual, seed.start))
        except CvxupdateError:
            return None


@dataclass(frozen=True)
class Shared:
    """A hypothesis on all states: the ``effects`` of each (none: nothing is missing), whether each
    has its ``own`` size, fitted; ``units`` of the contract's figure in each one's parameter."""

    effects: tuple[Effect, ...]
    own: bool
    fit: Fit
    units: tuple[float, ...] = ()

    @property
    def moved(self) -> bool:
        """Whether it stands elsewhere in each state."""
        return len({e.key for e in self.effects}) > 1

    @property
    def unknowns(self) -> int:
        """Its sizes and places."""
        if not self.effects:
            return 0
        count = len(self.effects)
        return (count if self.own else 1) + (count if self.moved else 1)

    @property
    def sizes(self) -> Real:
        """(states, 2): parameter of each state and its deviation."""
        n = len(self.fit.p) - (len(self.effects) if self.own else 1)
        spread = self.fit.deviations
        both = np.column_stack([self.fit.p[n:], spread[n:]])
        if self.own:
            return both
        ratios = np.array(self.units[:1]) / np.array(self.units)
        return np.asarray(ratios[:, None] * both)


@dataclass(frozen=True)
class Kind:
    """Effects of one type along one kind of DOF at every place, the ``units`` of each (its figure
    for a parameter of 1), and where its first node is, ``xyz`` (n, 3) in m."""

    effects: tuple[Effect, ...]
    units: Real
    xyz: Real


def kinds_of(effects: Sequence[Effect], model: Model) -> list[Kind]:
    """Local effects whose figure goes straight with their parameter."""
    found: dict[tuple[str, str | None, int, int], list[tuple[Effect, float]]] = {}
    for e in effects:
        place = e.place
        unit = _unit(e) if local(e) is not None and not e.type.damping else 0.0
        if unit:
            kind = (e.physics, place.dof, len(place.nodes), len(place.elements))
            found.setdefault(kind, []).append((e, unit))
    at = dict(zip(model.node_ids.tolist(), model.xyz, strict=True))
    return [
        Kind(
            tuple(e for e, _ in k),
            np.array([u for _, u in k]),
            np.array([at[e.place.nodes[0]] for e, _ in k]),
        )
        for k in found.values()
    ]


def group_factors(effects: Sequence[Effect]) -> list[Kind]:
    """Factors on whole groups: each state may have its own (temperature, moisture), as far as
    groups scatter."""
    return [
        Kind((e,), np.ones(1), np.zeros((1, 3)))
        for e in effects
        if e.place.groups and e.columns == 1 and e.change is not None and not e.type.damping
    ]


def _unit(effect: Effect) -> float:
    """The figure for a parameter of 1; 0 where it does not go straight with it."""
    change = effect.change
    if change is None or len(effect.figures) != 1:
        return 0.0
    own = change.model.parameters[-1:]
    name = effect.figures[0].name
    at = [effect.reported(change.model, own, [x], [0.0])[0][name] for x in (0.0, 0.5, 1.0)]
    if not np.all(np.isfinite(at)):
        return 0.0
    bend = at[2] - 2.0 * at[1] + at[0]
    return at[2] - at[0] if abs(bend) <= STRAIGHT * abs(at[2] - at[0]) else 0.0


def hypotheses(states: Sequence[State], kind: Kind) -> list[Shared]:
    """Of one kind of effect: at a place of each state with one size; at one place with one size,
    or with each state's own. Those that can be fitted."""
    if kind.effects[0].place.groups:
        factors = fitted_states(states, kind, [0] * len(states), [LEAST] * len(states), True)
        return [] if factors is None else [factors]
    out = []
    for sizes in _grids(kind):
        p = sizes[None, :] / kind.units[:, None]
        left = np.array([s.left(kind.effects, p) for s in states])  # states, places, sizes
        if not np.isfinite(left).any():
            continue
        g = int(np.argmin(left.min(axis=1).sum(axis=0)))
        moved = [int(k) for k in np.argmin(left[:, :, g], axis=1)]
        one, at = np.unravel_index(int(np.argmin(left.sum(axis=0))), left.shape[1:])
        grown = int(np.argmin(left.min(axis=2).sum(axis=0)))
        each = [float(sizes[k]) for k in np.argmin(left[:, grown, :], axis=1)]
        same = len(states)
        tries = [
            fitted_states(states, kind, moved, [float(sizes[g])] * same, False),
            fitted_states(states, kind, [int(one)] * same, [float(sizes[at])] * same, False),
            fitted_states(states, kind, [grown] * same, each, True),
        ]
        out += [t for t in tries if t is not None]
    return out


def _grids(kind: Kind) -> list[Real]:
    """Sizes in the unit of the figure, on each side that the effect may take."""
    lower, upper = kind.effects[0].limits
    unit = float(np.median(kind.units))
    out = [np.geomspace(LEAST, upper, SIZES) * unit] if upper > LEAST else []
    if lower < -LEAST and kind.effects[0].sign <= 0:
        out.append(-np.geomspace(LEAST, -lower, SIZES) * unit)
    return out


def fitted_states(
    states: Sequence[State], kind: Kind, places: Sequence[int], sizes: Sequence[float], own: bool
) -> Shared | None:
    """Effects of a kind at a place of each state (their numbers), fitted from sizes in the unit of
    the figure; None where that is no structure."""
    effects = tuple(kind.effects[k] for k in places)
    units = tuple(float(kind.units[k]) for k in places)
    parts = [
        s.with_effect(e, size / u)
        for s, e, size, u in zip(states, effects, sizes, units, strict=True)
    ]
    if any(part is None for part in parts):
        return None
    nuisance = len(states[0].evidence.model.parameters)
    whole = bool(effects[0].place.groups) and nuisance > 0
    setting = together([q for q in parts if q is not None], nuisance, units, own, whole)
    start = np.zeros(len(setting.columns))
    start[nuisance:] = (
        [s / u for s, u in zip(sizes, units, strict=True)] if own else (sizes[0] / units[0])
    )
    try:
        fit = fitted_together(setting, np.clip(start, setting.lower, setting.upper))
    except CvxupdateError:
        return None
    return Shared(effects, own, fit, units)


def nothing(states: Sequence[State]) -> Shared:
    """The nuisance parameters alone, one for all states."""
    parts = [s.evidence.bases[0].setting for s in states]
    setting: Together = together(parts, len(states[0].evidence.model.parameters), (), False)
    return Shared((), False, fitted_together(setting, np.zeros(len(setting.columns))))
