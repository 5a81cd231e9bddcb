"""A model fitted to tables of modes, nuisance parameters within their scatter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.modes.following import followed
from cvxupdate.diagnose.modes.tables import Tables
from cvxupdate.diagnose.nominal.scatter import scatter_of, spread_of
from cvxupdate.diagnose.settings import FREE, NOISE_KNOWN, RESOLVED, WIDE
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.physics.fault import Fault
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual
from cvxupdate.residual.repeated import clusters
from cvxupdate.update.trust_region import Options, iterate

SAME = 1e-12  # relative differences of matrices that are rounding
OPTIONS = Options(1e-4, 25, 0.3)


@dataclass(frozen=True)
class ModesSetting:
    """Tables beside a model's modes, and how they are paired (``residual``); ``wide``: nuisance
    stiffness may go as far as a parameter error is followed."""

    tables: Tables
    residual: ModalResidual
    wide: bool = False
    level: int = 0
    faults: tuple[Fault, ...] = ()

    @property
    def model(self) -> Model:
        """With its parameters."""
        return self.residual.model

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.model.parameters)

    @cached_property
    def scales(self) -> Real:
        """Standard deviations of the parameters before any table: groups scatter as usual
        (``wide``: frequencies alone would not keep mass and stiffness apart), effects are free."""
        return np.array(
            [
                FREE if q.group is None else WIDE if self.wide and q.of != "mass" else scatter_of(q)
                for q in self.model.parameters
            ]
        )


@dataclass(frozen=True)
class ModesFit:
    """A setting at ``p``: weighted squares ``cost`` (priors included), ``rows``."""

    setting: ModesSetting
    point: ModalPoint
    cost: float
    rows: int

    damping_strain = 0.0

    @property
    def p(self) -> Real:
        """The parameters."""
        return self.point.p

    @property
    def misfit(self) -> float:
        """Weighted squares per row, priors included."""
        return self.cost / max(1, self.rows)

    @cached_property
    def noise(self) -> float:
        """Weighted squares per row that noise alone leaves, parameters fitted."""
        parts = self.setting.tables.noise_parts(self.point)
        free = max(0, self.rows - self.setting.size) / max(1, self.rows)
        return float(np.mean(parts)) * free if len(parts) else 0.0

    @property
    def excess(self) -> float:
        """The misfit beyond noise, as far as the noise is known."""
        return max(self.misfit - self.noise, NOISE_KNOWN * self.noise + RESOLVED)

    @property
    def deviations(self) -> Real:
        """Standard deviations of the unknowns: linearised, grown with the misfit."""
        return self._spread[0]

    @property
    def noise_deviations(self) -> Real:
        """The same of the tables' noise alone."""
        return self._spread[1]

    @cached_property
    def _spread(self) -> tuple[Real, Real]:
        A, _ = self.point.system().weighted()
        noise = self.setting.tables.noise_parts(self.point)
        return spread_of(A, noise, self.setting.scales, self.cost)


def setting_of(
    model: Model, tables: Tables, like: ModalResidual | None = None, wide: bool = False
) -> ModesSetting:
    """The tables beside a model's modes. ``like``: of a model that is the same structure today,
    with other parameters, whose modes and pairing are then those of this one; found again where it
    is not, or where eigenvalues are repeated, for parameters say how those split.

    Raises
    ------
    ModelError, InputError
        A model that is no structure, modes that cannot be paired.
    """
    if like is not None and _same(model, like):
        return ModesSetting(tables, replace(like, model=model), wide)
    return ModesSetting(tables, modal_residual(model, tables.fit, tables.hold, tables.shapes), wide)


def _same(model: Model, like: ModalResidual) -> bool:
    if like.model.labels != model.labels or clusters(like.start.modes):
        return False
    mine, theirs = (m.matrices(m.zero()) for m in (model, like.model))
    pairs = ((mine.K, theirs.K), (mine.M, theirs.M))
    return all(abs(a - b).max() <= SAME * abs(b).max() for a, b in pairs)


def fitted_at(setting: ModesSetting, point: ModalPoint) -> ModesFit:
    """A point taken as a fit."""
    values, weights, _ = point.differences
    cost = float(np.sum((weights * values) ** 2) + np.sum((point.p / setting.scales) ** 2))
    return ModesFit(setting, point, cost, len(values))


def fit(setting: ModesSetting, start: Real, continued: bool = False) -> ModesFit:
    """Weighted differences of eigenvalues and shapes plus Gaussian priors, minimised from
    ``start``; ``continued``: modes are followed there from today's model.

    Raises
    ------
    ModelError
        A model that is no structure.
    """
    if continued:
        setting = replace(setting, residual=followed(setting.residual, start))
    model = setting.model
    bounds = Bounds(*(np.array([getattr(q, s) for q in model.parameters]) for s in BOTH))
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.0, setting.scales),),
        constraints=(bounds,),
        columns=tuple(q.name for q in model.parameters),
    )
    return fitted_at(
        setting, iterate(setting.residual, problem, SolverChoice(), OPTIONS, start).point
    )


BOTH = ("lower", "upper")
