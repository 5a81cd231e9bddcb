"""Tables of modes as evidence: frequencies and, where measured, shapes; damping ratios beside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.modes.alike import alike_of
from cvxupdate.diagnose.modes.dashpots import ZETA
from cvxupdate.diagnose.modes.figures import modes_shown, with_counterparts
from cvxupdate.diagnose.modes.finite_size import BASIS, local, scan
from cvxupdate.diagnose.modes.first_order import columns_of, first_order, linearised
from cvxupdate.diagnose.modes.fits import fitted_from, space_around, taken_at
from cvxupdate.diagnose.modes.fixtures import on_fixtures
from cvxupdate.diagnose.modes.further import further_of
from cvxupdate.diagnose.modes.identified import driven
from cvxupdate.diagnose.modes.kinds import departs, whole_within
from cvxupdate.diagnose.modes.levels import level_change
from cvxupdate.diagnose.modes.members import whole_members
from cvxupdate.diagnose.modes.remains import remains
from cvxupdate.diagnose.modes.scene import scene_of
from cvxupdate.diagnose.modes.setting import ModesSetting, setting_of
from cvxupdate.diagnose.modes.tables import Tables, errors_of, metrics_of, rms
from cvxupdate.diagnose.modes.tuned import tuned
from cvxupdate.diagnose.nominal.linear import Linear
from cvxupdate.diagnose.nominal.mesh import MeshError, mesh_line
from cvxupdate.diagnose.nominal.refinement import Mesh, mesh_lines, mesh_notes
from cvxupdate.diagnose.nominal.scatter import let_far
from cvxupdate.diagnose.nominal.supports import elements_of, on_the_file, regrown
from cvxupdate.diagnose.nominal.theory import theory_lines
from cvxupdate.diagnose.nominal.written import sayable, solid_of
from cvxupdate.diagnose.results import Further, Updated
from cvxupdate.diagnose.screen.projection import Linearised
from cvxupdate.diagnose.settings import AS_ONE, FAR_OFF, NEIGHBOURING, SPARE
from cvxupdate.diagnose.shown import Shown
from cvxupdate.diagnose.types import (
    Errors,
    FiniteSize,
    LevelChange,
    Progress,
    Real,
    Score,
    Seed,
)
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis.space import Space
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import MODES, RATIOS, Effect
from cvxupdate.physics.fault import Fault
from cvxupdate.residual.modal import ModalPoint


@dataclass(frozen=True)
class ModesEvidence(Linear):
    """What stays fixed while hypotheses come and go: the file's model (``original``), the one with
    nuisance parameters, tables, supports, effects to try (``damping``: on the ratios).
    ``order`` is the place in the file of each table, those to fit first; ``file`` the model as it
    came, where a reference state was there to bring it to, ``came`` where its mesh was coarse.
    """

    original: Model
    model: Model
    tables: Tables
    mesh: MeshError
    fine: Mesh
    names: tuple[str, ...]
    damping: tuple[str, ...]
    supports: tuple[tuple[int, str], ...]
    release: Callable[[int, str], Model]
    order: tuple[int, ...]
    progress: Progress
    file: Model | None = None
    budget: Budget = field(default_factory=Budget)
    came: Model | None = None

    told_by = MODES
    levels = 1
    delay_unit = 1.0
    approach = None

    @property
    def band(self) -> tuple[float, float]:
        """Hz."""
        return self.tables.bottom, self.tables.top

    @cached_property
    def bases(self) -> tuple[Fit, ...]:
        """Nuisance parameters fitted."""
        return (fitted_from(self._nominal, self.model.zero(), space=self._space),)

    @cached_property
    def _nominal(self) -> ModesSetting:
        return setting_of(self.model, self.tables)

    @cached_property
    def nominal_point(self) -> ModalPoint:
        """The nominal model."""
        return self._nominal.evaluate(self.model.zero())

    @cached_property
    def _drawn(self) -> ModalPoint:
        """The file as it came, mesh included."""
        if self.came is None and not self.fine.finer:
            return with_counterparts(self.nominal_point)
        file = (self.came or self.original).with_parameters(())
        return with_counterparts(setting_of(file, self.tables).evaluate(file.zero()))

    @cached_property
    def _space(self) -> Space | None:
        """Where modes are sought, of a large model."""
        return space_around(self.nominal_point, self.tables.top)

    @cached_property
    def nominal(self) -> Errors:
        """Its errors."""
        return self._errors_at(self.nominal_point)

    @cached_property
    def noise(self) -> Errors:
        """What standard deviations alone explain of held-out frequencies."""
        return Errors(float("nan"), self.tables.noise)

    def level_change(self) -> LevelChange | None:
        """Between tables at different drive levels."""
        return level_change(self.tables.measured)

    def context(self, model: Model) -> SearchContext:
        """For placing effects on the nuisance model or one grown from it."""
        return self._context(model, ZETA)

    def _context(self, model: Model, zeta: float) -> SearchContext:
        m = model.matrices(model.zero())

        def released(node: int, kind: str) -> Model:
            return regrown(self.release(node, kind), model)

        t, own = self.tables, elements_of(self.file or self.model)
        held = (self.supports, released, zeta, t.heavy, driven(t.seen))
        return SearchContext(model, m.K, m.M, t.top, t.bottom, (), *held, own=own, undamped=True)

    def candidates(self, model: Model, names: Sequence[str] | None = None) -> list[Effect]:
        """Every effect at every place of a model that the file has."""
        wanted = self.names if names is None else names
        return on_the_file(candidates_of(self.context(model), wanted, MODES), self.model, self.file)

    def setting(
        self, model: Model, faults: Sequence[Fault], like: ModesSetting | None = None
    ) -> ModesSetting:
        """A model beside the tables."""
        return setting_of(model, self.tables, None if like is None else like.residual)

    def at_level(self, setting: ModesSetting, level: int) -> ModesSetting:
        """There is but one."""
        return setting

    def evaluated(self, setting: ModesSetting, p: Real) -> Fit:
        """Without fitting."""
        return taken_at(setting, p)

    def fitted(self, seed: Seed, effort: str) -> Fit:
        """By trust-region convex steps, to the end at once."""
        return fitted_from(seed.setting, seed.start, seed.continued, self._space)

    def linearised(self, found: Fit) -> Linearised:
        """Of the nuisance parameters."""
        return linearised(found)

    def columns(self, found: Fit, effects: Sequence[Effect]) -> list[Real | None]:
        """Weighted derivative columns."""
        return columns_of(found, effects)

    def first_order(self, found: Fit, effects: Sequence[Effect]) -> list[Score]:
        """Explained fractions to first order; derivatives of local effects are not to be
        trusted."""
        scores = first_order(found, effects)
        return [replace(s, trusted=local(s.effect) is None) for s in scores]

    def alike(self, found: Fit, effect: Effect, strictly: bool = False) -> Sequence[Effect]:
        """Beside the nuisance parameters alone: a stiff support is still, its neighbours nearly."""
        candidates = self.candidates(self.model, (effect.physics,))
        least = AS_ONE if strictly else NEIGHBOURING
        return alike_of(effect, self.bases[-1], found, candidates, least)

    def halves(self, found: Fit) -> Sequence[NDArray[np.bool_]]:
        """None: a table has few rows."""
        return ()

    def finite_size(
        self, nominal: Fit, parent: Fit, placed: tuple[Effect, ...], effects: Sequence[Effect]
    ) -> FiniteSize:
        """Local effects in the space of the model's own modes; whole members by continuation where
        the model is far off. Nothing where shapes of a repeated eigenvalue have no derivative."""
        try:
            around, model = scene_of(nominal, BASIS), nominal.setting.model
        except ModelError:
            return FiniteSize([], [])
        scores = [
            Score(effects[k], 1.0 - left / around.total, np.array([size]), exact=True)
            for k, (left, size) in scan(around, effects).items()
            if around.total > 0.0
        ]
        scores += tuned(around, effects, float(model.total_mass()))
        spare = nominal.spare(len(model.parameters)) - SPARE
        scores += on_fixtures(around, [e for e in effects if e.count <= spare + 1], nominal.p)
        far = not placed and self.errors(parent).fit > FAR_OFF
        return FiniteSize(scores, whole_members(parent, effects, self._space) if far else [])

    def errors(self, found: Fit) -> Errors:
        """R.m.s. relative errors of the frequencies."""
        return self._errors_at(found.point)

    def _errors_at(self, point: ModalPoint) -> Errors:
        tables = point.residual.tables
        return Errors(*(rms(errors_of(point, tables, use)) for use in (True, False)))

    def relative(self, errors: Errors) -> float:
        """Of the eigenvalues, which go with stiffness as responses do: twice the frequencies'."""
        return 2.0 * errors.worst

    def allowance(self, model: Model) -> float:
        """None: what the mesh may leave is in the tables' deviations."""
        return 0.0

    def explained(self, found: Fit, errors: Errors) -> bool:
        """Whether noise, the model's discrepancy and the priors alone would leave as much once in
        a hundred times, of all figures and of each kind of them."""
        return self.clear(found)

    def clear(self, found: Fit) -> bool:
        """The same: few rows tell nothing within their chance."""
        return whole_within(found) and not self.departs(found)

    def departs(self, found: Fit) -> str:
        """Frequencies or shapes by themselves."""
        return departs(found, (found.point,), self.tables.kinds)

    def wide(self) -> Fit:
        """The nuisance parameters let go far beyond their scatter."""
        far = let_far(self.model, elements_of(self.file or self.model))
        return fitted_from(setting_of(far, self.tables, wide=True), far.zero(), space=self._space)

    def further(self, last: Fit) -> Further:
        """What the damping ratios say, and FRFs beside the modes in them."""

        def effects(zeta: float) -> list[Effect]:
            context = self._context(last.point.residual.model, zeta)
            return candidates_of(context, self.damping, RATIOS)

        return further_of(self.tables, last, self.bases[-1], self.original, effects)

    def left(self, errors: Errors) -> str:
        """In words."""
        known = np.isfinite(errors.hold_out)
        held = f" and {100 * errors.hold_out:.3g} % (held out)" if known else ""
        return f"{100 * errors.fit:.3g} % of the frequencies, r.m.s. (fitted){held}"

    def remains(self, found: Fit) -> str:
        """At which modes."""
        return remains(found.point)

    def lines(self) -> list[str]:
        """What the mesh of the file is worth, and what time did not allow."""
        mesh = [*mesh_line(self.mesh.worst(self.tables.top)), *mesh_lines(self.fine, False)]
        theory = theory_lines(self.model, self.bases[-1])
        return [*mesh, *self.tables.told, *theory, *self.budget.lines]

    def updated(self, last: Fit, further: Further) -> Updated:
        """With the pairing of each table."""
        point = last.point
        found = zip(self.order, point.places, strict=False)
        pairs = {k: self.tables.pairs(n, at, point.modes.rigid) for n, (k, at) in enumerate(found)}
        alpha = None if further.alpha is None else further.alpha[0]
        kept, p, said = sayable(point.residual.model, point.p)
        told = self.fine.told
        solid, parted = solid_of(point.residual.model, point.p)
        notes = (*mesh_notes(self.fine), *said, *(parted if told else ()))
        return Updated(kept, p, alpha=alpha, pairs=pairs, notes=notes, refine=told, solid=solid)

    def shown(self, last: Fit, scores: Sequence[Score]) -> Shown:
        """Errors of every mode before and after."""
        return modes_shown(self._drawn, last.point, self.tables.measured)

    def stated(self, last: Fit) -> tuple[Errors, Errors]:
        """R.m.s. relative errors of the frequencies: of the file as it came, mesh included, and of
        the diagnosed model."""
        before = (rms(errors_of(self._drawn, self.tables.measured, use)) for use in (True, False))
        return Errors(*before), self.errors(last)

    def metrics(self, last: Fit) -> dict[str, Any]:
        """The contract's metrics."""
        return metrics_of(self._drawn, last.point, self.tables)
