"""FRFs and time histories as evidence: output error on the half-plane, from smooth to sharp."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate.response_error import Stated, stated_errors
from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.fit import Fit, fitted_at
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.nominal.linear import Linear
from cvxupdate.diagnose.nominal.mesh import mesh_line
from cvxupdate.diagnose.nominal.refinement import Mesh, mesh_lines, mesh_notes
from cvxupdate.diagnose.nominal.supports import elements_of, on_the_file, regrown
from cvxupdate.diagnose.nominal.theory import theory_lines
from cvxupdate.diagnose.responses.columns import columns_of, delay_unit
from cvxupdate.diagnose.responses.data import Data
from cvxupdate.diagnose.responses.errors import (
    ContractErrors,
    Heard,
    heard,
    noise_errors,
    stated,
)
from cvxupdate.diagnose.responses.figures import responses_shown
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.responses.guide import Guide, at_finite_sizes
from cvxupdate.diagnose.responses.levels import level_change
from cvxupdate.diagnose.responses.point import ResponsePoint, ResponseSetting
from cvxupdate.diagnose.responses.remains import remains
from cvxupdate.diagnose.responses.resampling import halves
from cvxupdate.diagnose.responses.setting import (
    around,
    followed,
    let_go,
    nuisance_fits,
    setting_for,
    with_damped,
)
from cvxupdate.diagnose.responses.updated import updated_model
from cvxupdate.diagnose.responses.worth import may_leave
from cvxupdate.diagnose.results import Further, Updated
from cvxupdate.diagnose.screen.likeness import moving_as_one
from cvxupdate.diagnose.screen.projection import Linearised, Projection
from cvxupdate.diagnose.settings import CLEAR, EXPLAINED, OPEN
from cvxupdate.diagnose.shown import Shown
from cvxupdate.diagnose.types import Errors, FiniteSize, LevelChange, Progress, Score, Seed
from cvxupdate.fe.model import Model
from cvxupdate.fe.recent import Once
from cvxupdate.fe.synthesis.space import Space
from cvxupdate.fe.terms import Real
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.fault import Fault


@dataclass(frozen=True)
class ResponseEvidence(Linear):
    """What stays fixed while hypotheses come and go: the file's model (``original``), the one with
    nuisance parameters, recordings, supports, effects to try; ``release(node, kind)``: without one
    support; ``file``: the model before it was brought to a reference, ``came`` before its mesh was;
    ``bare``: what is known of effects on the bare model; ``modal``: the modes in a band (Hz)."""

    original: Model
    model: Model
    data: Data
    fine: Mesh
    names: tuple[str, ...]
    supports: tuple[tuple[int, str], ...]
    release: Callable[[int, str], Model]
    progress: Progress
    file: Model | None = None
    budget: Budget = field(default_factory=Budget)
    came: Model | None = None
    bare: dict[object, FiniteSize] = field(default_factory=dict)
    modal: Callable[[tuple[float, float], int], Any] | None = None

    told_by = "responses"

    @property
    def levels(self) -> int:
        """Levels of smoothing."""
        return len(self.data.levels)

    @property
    def band(self) -> tuple[float, float]:
        """Hz."""
        return self.data.bottom, self.data.top

    @property
    def delay_unit(self) -> float:
        """A delay that turns the phase by one radian at the top of the band, s."""
        return delay_unit(self.data.top)

    @cached_property
    def bases(self) -> tuple[Fit, ...]:
        """Nuisance parameters fitted, level by level; far off, there is nothing to sharpen."""
        return nuisance_fits(self)

    @cached_property
    def nominal_point(self) -> ResponsePoint:
        """The nominal model, the mesh's error taken out."""
        return (s := self.setting(self.model, ())).evaluate(np.zeros(len(s.columns)))

    @cached_property
    def nominal(self) -> Errors:
        """Its errors."""
        return self._heard(self.nominal_point).errors

    @cached_property
    def noise(self) -> Errors:
        """Of noise alone; or what the model leaves of the reference state, and so of any other."""
        alone = Errors(*(noise_errors(x) for x in (self.data.sharp, self.data.sharp_hold_out)))
        return alone if self.data.common is None else self.data.common.least(alone)

    def level_change(self) -> LevelChange | None:
        """Between runs at different drive levels."""
        return level_change(self.data.compared)

    @cached_property
    def _space(self) -> Space | None:  # of a model on a mesh finer than the file's
        return around(self.model, self.model.zero(), self.data.top) if self.fine.finer else None

    @cached_property
    def _zeta(self) -> float:
        setting = self.setting(self.model, ())
        return float(np.median(setting.zeta)) if setting.damped else 0.005

    def by_modes(self, fewest: int = 0) -> Any:
        """The modes in them."""
        return None if self.modal is None else self.modal(self.band, fewest)

    def context(self, model: Model) -> SearchContext:
        """For placing effects on the nuisance model or one grown from it."""
        m = model.matrices(model.zero())

        @cache
        def released(node: int, kind: str) -> Model:
            return regrown(self.release(node, kind), model)

        d, own, held = self.data, elements_of(self.file or self.model), self.supports
        rig = (self._zeta, d.accelerometers, d.driven, d.forces, d.later, d.apart, own)
        return SearchContext(model, m.K, m.M, d.top, d.bottom, d.sensors, held, released, *rig)

    def candidates(self, model: Model, names: Sequence[str] | None = None) -> list[Effect]:
        """Every effect at every place of a model that the file has."""
        wanted = self.names if names is None else names
        if model is self.model:
            return [c for c in self._on_it if c.physics in wanted]
        return self._on(model, wanted)

    @cached_property
    def _on_it(self) -> list[Effect]:
        return self._on(self.model, None)

    def _on(self, model: Model, names: Sequence[str] | None) -> list[Effect]:
        found = candidates_of(self.context(model), names, self.told_by)
        return on_the_file(found, self.model, self.file)

    def setting(
        self, model: Model, faults: Sequence[Fault], like: ResponseSetting | None = None
    ) -> ResponseSetting:
        """A model against the recordings at the level of another setting (None: the first), with a
        damping ratio for every mode that has one there."""
        d, level = self.data, 0 if like is None else like.level
        signals, shift = d.levels[level], d.shift_of(model)
        made = setting_for(model, self.original, signals, d.top, faults, shift, self._space)
        return with_damped(replace(made, level=level, mixed=d.mixed, carried=d.carried), like)

    def at_level(self, setting: ResponseSetting, level: int) -> ResponseSetting:
        """The same against those of another level."""
        return replace(setting, signals=self.data.levels[level], level=level)

    def evaluated(self, setting: ResponseSetting, p: Real) -> Fit:
        """Without fitting."""
        return fitted_at(setting, p)

    def fitted(self, seed: Seed, effort: str) -> Fit:
        """By trust-region convex steps."""
        return followed(seed.setting, seed.start, effort)

    def linearised(self, found: Fit) -> Linearised:
        """Of the nuisance parameters that can still move."""
        return linearised(found.point)

    def columns(self, found: Fit, effects: Sequence[Effect]) -> list[Real | None]:
        """Weighted derivative columns."""
        return columns_of(found.point, effects)

    def first_order(self, found: Fit, effects: Sequence[Effect]) -> list[Score]:
        """Explained fractions to first order."""
        return first_order(found.point, effects)

    def alike(self, found: Fit, effect: Effect, strictly: bool = False) -> Sequence[Effect]:
        """Those that move as one with its own: all others are compared."""
        return moving_as_one(self, self.bases[-1], found, effect)

    def halves(self, found: Fit) -> Sequence[NDArray[np.bool_]]:
        """Of blocks of frequency of each sensor and recording."""
        return halves(found.point.setting.signals)

    def finite_size(
        self, nominal: Fit, parent: Fit, placed: tuple[Effect, ...], effects: Sequence[Effect]
    ) -> FiniteSize:
        """By weighted squares, less what nuisance parameters take up; of the bare model once."""
        key = (nominal.setting.level, nominal.p.tobytes(), tuple(e.key for e in effects))
        if not placed and key in self.bare:
            return self.bare[key]
        left = Projection.of(linearised(nominal.point))
        found = at_finite_sizes(self, Hypothesis(placed, nominal), effects, left, left)
        return found if placed else self.bare.setdefault(key, found)

    @cached_property
    def approach(self) -> Guide:
        """Beside a model that is far off."""
        return Guide(self)

    def held_out(self, fit: Fit) -> float:
        """Of what is driven from elsewhere; another record at the same drive says the same."""
        return self._heard(fit.point).likelihood if self.data.later else 0.0

    def errors(self, found: Fit) -> Errors:
        """Channel by channel."""
        return self._heard(found.point).errors

    @cached_property
    def _heard(self) -> Once[Heard]:
        return Once(lambda point: heard(point, self.data.sharp, self.data.sharp_hold_out))

    def relative(self, errors: Errors) -> float:
        """A fraction of the responses as it is."""
        return errors.worst

    def allowance(self, model: Model) -> float:
        """What extrapolation to a fine mesh may miss, or on a finer one that mesh and theory."""
        return may_leave(self.fine, self.data, self.bases[-1], model)

    def explained(self, found: Fit, errors: Errors) -> bool:
        """Within noise and the discrepancy of a sound model, or what the mesh may leave."""
        model = found.setting.model
        return bool(found.misfit <= OPEN * EXPLAINED or errors.worst <= self.allowance(model))

    def clear(self, found: Fit) -> bool:
        """Half a per cent of the responses beyond noise: thousands of rows tell that much."""
        return found.excess <= CLEAR

    def wide(self) -> Fit:
        """The nuisance parameters far beyond their scatter."""
        return let_go(self)

    def further(self, last: Fit) -> Further:
        """Nothing: the search heard all that responses say."""
        return Further()

    def left(self, errors: Errors) -> str:
        """In words."""
        held = f" and {errors.hold_out:.3g} (held out)" if np.isfinite(errors.hold_out) else ""
        return f"{errors.fit:.3g} of the response (fitted){held}"

    def remains(self, found: Fit) -> str:
        """Where in frequency, and at which sensors."""
        return remains(found.point, (*self.data.sharp, *self.data.sharp_hold_out))

    def lines(self) -> list[str]:
        """What the mesh of the file is worth, and what time did not allow."""
        mesh = [*mesh_line(self.data.mesh.worst(self.data.top)), *mesh_lines(self.fine)]
        return [*mesh, *theory_lines(self.model, self.bases[-1]), *self.budget.lines]

    def updated(self, last: Fit, further: Further) -> Updated:
        """With a damping ratio of its own for every mode, and the faults of the sensors."""
        return updated_model(last.point, mesh_notes(self.fine), self.fine.told)

    def shown(self, last: Fit, scores: Sequence[Score]) -> Shown:
        """Responses before and after, what remains, and the map of explained fractions."""
        d, scored = self.data, [(s.effect, s.fraction) for s in scores]
        return responses_shown(self.nominal_point, last.point, d.sharp, d.sharp_hold_out, scored)

    @cached_property
    def before(self) -> tuple[Stated, ...]:
        """Contract's errors of the file as it came."""
        return stated_errors(self.came or self.original, (*self.data.fit, *self.data.hold_out))

    def _contract(self, last: Fit) -> ContractErrors:
        both = (*self.data.sharp, *self.data.sharp_hold_out)
        return ContractErrors(self.before, stated(last.point, both))

    def stated(self, last: Fit) -> tuple[Errors, Errors]:
        """As the contract has it."""
        return self._contract(last).together()

    def metrics(self, last: Fit) -> dict[str, Any]:
        """The contract's metrics."""
        return self._contract(last).metrics()
