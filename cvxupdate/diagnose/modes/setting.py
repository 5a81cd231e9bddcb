"""A model beside tables of modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.modes.tables import Tables
from cvxupdate.diagnose.nominal.scatter import prior_scales
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.physics.fault import Fault
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual
from cvxupdate.residual.repeated import clusters

SAME = 1e-12  # relative differences of matrices that are rounding


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
    def columns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(q.name for q in self.model.parameters)

    @cached_property
    def scales(self) -> Real:
        """Prior standard deviations: frequencies alone would not keep mass and stiffness apart, so
        a ``wide`` one lets stiffness go only."""
        return np.array(prior_scales(self.model, self.wide))

    @property
    def reach(self) -> Real:
        """None: all unknowns are parameters of the model."""
        return np.zeros(0)

    def noise_parts(self, point: ModalPoint) -> Real:
        """The part of each row's weighted square that noise alone makes."""
        return self.tables.noise_parts(point)

    def figures(self, point: ModalPoint) -> tuple[float, float]:
        """Every entry of a table."""
        return float(len(self.noise_parts(point))), 0.0

    def damping_strain(self, p: Real) -> float:
        """None: damping ratios are judged apart."""
        return 0.0

    def evaluate(self, p: Real, before: ModalPoint | None = None) -> ModalPoint:
        """The model at ``p``, modes followed."""
        return self.residual.evaluate(p, before)


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
