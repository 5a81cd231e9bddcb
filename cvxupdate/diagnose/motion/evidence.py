"""Time histories of a structure that depends on its level, as evidence: output error in simulation,
internal forces beside all that a linear model may lack."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.budget import Budget, Timed
from cvxupdate.diagnose.fit import Fit, fitted, fitted_at
from cvxupdate.diagnose.motion.alike import alike, as_one, kin
from cvxupdate.diagnose.motion.apart import next_measurement
from cvxupdate.diagnose.motion.columns import LawScores, is_law, nothing
from cvxupdate.diagnose.motion.drift import told
from cvxupdate.diagnose.motion.guided import begun
from cvxupdate.diagnose.motion.linear import OfLinear
from cvxupdate.diagnose.motion.point import MotionSetting
from cvxupdate.diagnose.motion.runs import Run
from cvxupdate.diagnose.motion.scene import Scene
from cvxupdate.diagnose.nominal.supports import on_the_file
from cvxupdate.diagnose.responses.columns import columns_of
from cvxupdate.diagnose.responses.errors import (
    ContractErrors,
    channel_errors,
    likelihood,
    on_signals,
    stated,
)
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.figures import responses_shown
from cvxupdate.diagnose.responses.finite_size import few_directions
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.levels import left_between
from cvxupdate.diagnose.responses.sets import sets_of_elements
from cvxupdate.diagnose.responses.setting import EFFORTS, let_go
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.diagnose.responses.updated import updated_model
from cvxupdate.diagnose.results import Further, Updated
from cvxupdate.diagnose.screen.projection import Linearised, Projection
from cvxupdate.diagnose.screen.shortlist import best_of
from cvxupdate.diagnose.settings import HALVED, LEVEL_CHANGE, SIMULATED
from cvxupdate.diagnose.shown import Shown
from cvxupdate.diagnose.types import (
    Errors,
    FiniteSize,
    Progress,
    Real,
    Score,
    Seed,
)
from cvxupdate.fe.internal import is_nonlinear
from cvxupdate.fe.model import Model
from cvxupdate.physics import candidates_of
from cvxupdate.physics.effect import MOTION, Effect
from cvxupdate.physics.fault import Fault


@dataclass(frozen=True)
class MotionEvidence(OfLinear, Timed):
    """Beside the ``linear`` evidence of the same recordings, offsets taken out of those that
    ``came``: the ``runs`` by name, ``stages`` of signals from smooth to sharp and those ``held``
    out, the ``laws`` that are tried."""

    came: ResponseEvidence
    linear: ResponseEvidence
    runs: Mapping[str, Run]
    stages: tuple[tuple[Signal, ...], ...]
    held: tuple[Signal, ...]
    laws: tuple[str, ...]
    progress: Progress
    scores: LawScores = field(default_factory=LawScores)
    budget: Budget = field(default_factory=Budget)

    told_by, approach, stocky, resonances = MOTION, None, False, 0

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are tried."""
        return (*self.linear.names, *self.laws)

    @property
    def levels(self) -> int:
        """Of smoothing."""
        return len(self.stages)

    @cached_property
    def bases(self) -> tuple[Fit, ...]:
        """The best linear model: nuisance parameters alone fitted."""
        setting = self.setting(self.model, ())
        out = [fitted(setting, np.zeros(len(setting.columns)), EFFORTS["base"])]
        for level in range(1, self.levels):
            out.append(fitted(self.at_level(setting, level), out[-1].p, EFFORTS["base"]))
        return tuple(out)

    @cached_property
    def depends(self) -> bool:
        """Whether the recordings depend on the level."""
        return (change := self.level_change()) is not None and change.exceeds(LEVEL_CHANGE)

    @cached_property
    def foretold(self) -> bool:
        """Whether the file has laws that foretell what changes between levels, fitted and held out,
        nuisance parameters fitted: half of it is left at the most."""
        change = self.level_change()
        if change is None or not is_nonlinear(self.model):
            return False
        left = self.between_levels(self.bases[-1])
        told = [x <= HALVED * change.change for x in (left.fit, left.hold_out) if np.isfinite(x)]
        return bool(told) and all(told)

    @cached_property
    def drift(self) -> str | None:
        """Stiffness that goes with time, where that explains more than any law."""
        laws = [e for e in self.candidates(self.model, self.laws) if is_law(e)]
        base = self.bases[-1]
        for fit in (base, fitted_at(base.setting, np.zeros(len(base.p)))):
            sharp = self.sharp(fit)
            fractions = [s.fraction for s in self.scores.of(sharp, laws).values()]
            says = told(Scene.of(sharp.point), max(fractions, default=0.0))
            if says:
                return says
        return None

    def candidates(self, model: Model, names: Sequence[str] | None = None) -> list[Effect]:
        """Every effect at every place of a model that the file has."""
        wanted = self.names if names is None else names
        own = candidates_of(self.context(model), [n for n in wanted if n in self.laws], MOTION)
        rest = self.linear.candidates(model, [n for n in wanted if n not in self.laws])
        return [*on_the_file(own, self.linear.model), *rest]

    def setting(
        self, model: Model, faults: Sequence[Fault], like: MotionSetting | None = None
    ) -> MotionSetting:
        """A model against the recordings at the level of another setting (None: the first)."""
        level = 0 if like is None else like.level
        return self.at_level(MotionSetting(self.linear.setting(model, faults), self.runs), level)

    def at_level(self, setting: MotionSetting, level: int) -> MotionSetting:
        """The same against those of another level."""
        linear = replace(setting.linear, signals=self.stages[level], level=level)
        return replace(setting, linear=linear)

    def evaluated(self, setting: MotionSetting, p: Real) -> Fit:
        """Without fitting."""
        return fitted_at(setting, p)

    def fitted(self, seed: Seed, effort: str) -> Fit:
        """By trust-region convex steps, a first pass from where the smoothest stage leads; no fit
        (ModelError) where nothing holds the model, at last at the levels that are held out."""
        smooth = self.stages[0] if effort == "first pass" else ()
        found = fitted(seed.setting, begun(seed.setting, seed.start, smooth), EFFORTS[effort])
        if effort == "sharp" and found.point.forces[0].size:
            likelihood(found, (*self.linear.data.sharp_hold_out, *self.held))
        return found

    def linearised(self, found: Fit) -> Linearised:
        """Of the nuisance parameters that can still move."""
        return linearised(found.point)

    def columns(self, found: Fit, effects: Sequence[Effect]) -> list[Real | None]:
        """Weighted derivative columns of linear effects; a law's coefficient is none."""
        linear = [e for e in effects if not is_law(e)]
        given = iter(columns_of(found.point.linear, linear))
        return [None if is_law(e) else next(given) for e in effects]

    def first_order(self, found: Fit, effects: Sequence[Effect]) -> list[Score]:
        """Of linear effects beside the internal forces that are there; of laws along the smoothed
        motion where none is there yet."""
        linear = [e for e in effects if not is_law(e)]
        left = Projection.of(linearised(found.point))
        given = iter(first_order(found.point.linear, linear, left))
        laws = {}
        if not found.point.forces[0].size:
            laws = self.scores.first(self.sharp(found), [e for e in effects if is_law(e)])
        return [laws.get(e.key, nothing(e)) if is_law(e) else next(given) for e in effects]

    def sharp(self, found: Fit) -> Fit:
        """A fit's point against sharp signals."""
        return fitted_at(self.at_level(found.setting, self.levels - 1), found.p)

    def halves(self, found: Fit) -> Sequence[NDArray[np.bool_]]:
        """None: laws are not resampled, their place is told by rank."""
        return ()

    def finite_size(
        self, nominal: Fit, parent: Fit, placed: tuple[Effect, ...], effects: Sequence[Effect]
    ) -> FiniteSize:
        """Laws along the smoothed motion, linear effects at given internal forces."""
        laws, rest = ([e for e in effects if is_law(e) == law] for law in (True, False))
        scores, point = self.scores.of(self.sharp(nominal), laws), nominal.point.linear
        left = Projection.of(linearised(nominal.point))
        linear = first_order(point, rest, left)
        exact = best_of(
            [scores[e.key] for e in laws if e.key in scores],
            few_directions(point, linear, left),
            sets_of_elements(point, linear, left),
        )
        return FiniteSize([s for s in exact if s.trusted], [])

    def errors(self, found: Fit) -> Errors:
        """Channel by channel, in free simulation."""
        data = self.linear.data
        return Errors(*(channel_errors(found.point, s) for s in (data.sharp, data.sharp_hold_out)))

    def held_out(self, found: Fit) -> float:
        """In free simulation: two laws that do alike at the levels fitted part there."""
        return likelihood(found, self.held)

    def between_levels(self, found: Fit) -> Errors:
        """In free simulation."""
        fitted, held = self.linear.data.sharp, self.linear.data.sharp_hold_out
        both = (*fitted, *held)
        left = [
            s.Y - y for s, y in zip(both, on_signals(found.point, both).modelled(), strict=True)
        ]
        n = len(fitted)
        return Errors(
            left_between(fitted, fitted, [*left[:n], *left[:n]]), left_between(fitted, held, left)
        )

    def alike(self, found: Fit, effect: Effect, strictly: bool = False) -> Sequence[Effect]:
        """Of laws neighbours, and other forms where one leaves much; laws that act like it."""
        names = kin(effect, self.depends and not strictly)
        laws = self.candidates(self.model, names) if names else ()
        if strictly:
            return as_one(found.point, effect, laws)
        return alike(found.point, effect, laws, forms=not self.linear.clear(found))

    def apart(self, one: Fit, other: Fit, titles: tuple[str, str]) -> str:
        """Level and frequency."""
        return next_measurement(self.runs, self.stages[-1], (one, other), titles)

    def relative(self, errors: Errors) -> float:
        """A fraction of the responses as it is."""
        return errors.worst

    def explained(self, found: Fit, errors: Errors) -> bool:
        """Within noise and the discrepancy of a sound model, or what the mesh may leave; without
        internal forces nothing explains what depends on the level."""
        bare = not found.point.forces[0].size
        return not (bare and self.depends) and self.linear.explained(found, errors)

    def clear(self, found: Fit) -> bool:
        """Half a per cent of the responses beyond noise, or what simulation is good for."""
        return self.linear.clear(found) or self.errors(found).fit <= SIMULATED

    def wide(self) -> Fit:
        """The nuisance parameters let go far beyond their scatter."""
        return let_go(self)

    def further(self, last: Fit) -> Further:
        """Nothing."""
        return Further()

    def remains(self, found: Fit) -> str:
        """Not said: a simulation's differences are everywhere."""
        return ""

    def updated(self, last: Fit, further: Further) -> Updated:
        """With a damping ratio of its own for every mode."""
        return updated_model(last.point)

    def shown(self, last: Fit, scores: Sequence[Score]) -> Shown:
        """Responses before and after, what remains, and the map of explained fractions."""
        d, scored = self.linear.data, [(s.effect, s.fraction) for s in scores]
        before = self.linear.nominal_point
        return responses_shown(before, last.point, d.sharp, d.sharp_hold_out, scored)

    def _contract(self, last: Fit) -> ContractErrors:
        after = stated(last.point, (*self.linear.data.sharp, *self.linear.data.sharp_hold_out))
        return ContractErrors(self.came.before, after)

    def stated(self, last: Fit) -> tuple[Errors, Errors]:
        """The contract's error: of the file as it came and of the diagnosed model."""
        return self._contract(last).together()

    def metrics(self, last: Fit) -> dict[str, Any]:
        """The contract's metrics."""
        return self._contract(last).metrics()
