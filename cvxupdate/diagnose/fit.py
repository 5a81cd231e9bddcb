"""A model fitted to recordings, with or without effects: the same for every kind of evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.settings import NOISE_KNOWN, RESOLVED
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.physics.fault import Fault
from cvxupdate.update.trust_region import Options, iterate

FARTHEST = 4.0  # of unknowns that are no parameters of the model: log damping ratios, faults


class Setting(Protocol):
    """A model and what it is compared with; its unknowns are, in order, the model's parameters,
    the evidence's own (damping) and the sensor faults'."""

    @property
    def model(self) -> Model:
        """With its parameters: nuisance ones, then the effects'."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Of the sensors, in the order in which they act."""

    @property
    def level(self) -> int:
        """Of smoothing, at which it is compared."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the unknowns."""

    @property
    def scales(self) -> Real:
        """Prior standard deviations of the unknowns."""

    def noise_parts(self, point: Any) -> Real:
        """The part of each row's weighted square that noise alone makes."""

    def damping_strain(self, p: Real) -> float:
        """Squares of the modes' own log damping ratios in units of their usual scatter: about one
        for each mode when all is usual."""

    def evaluate(self, p: Real, before: Any = None) -> Any:
        """The model at ``p``. Raises ModelError where it is no structure."""


@dataclass(frozen=True)
class Fit:
    """A setting at a point: weighted squares ``cost`` (rows and priors), number of ``rows``."""

    setting: Any
    point: Any
    cost: float
    rows: int

    @property
    def p(self) -> Real:
        """The unknowns."""
        p: Real = self.point.p
        return p

    @property
    def misfit(self) -> float:
        """Weighted squares per row, priors included: 1 when what is left is noise and the
        discrepancy of a sound model."""
        return self.cost / max(1, self.rows)

    @cached_property
    def noise(self) -> float:
        """Weighted squares per row that noise alone leaves: below 1, for the weights allow for the
        discrepancy of a sound model as well."""
        return float(np.mean(self.setting.noise_parts(self.point))) if self.rows else 0.0

    @property
    def excess(self) -> float:
        """The misfit beyond noise, as far as the noise is known: what tells two explanations apart
        that are both within the discrepancy."""
        return max(self.misfit - self.noise, NOISE_KNOWN * self.noise + RESOLVED)

    @property
    def damping_strain(self) -> float:
        """That of the setting."""
        return float(self.setting.damping_strain(self.p))

    @property
    def deviations(self) -> Real:
        """Standard deviations of the unknowns: linearised, grown with the misfit."""
        return self._spread[0]

    @property
    def noise_deviations(self) -> Real:
        """The same of the recordings' noise alone."""
        return self._spread[1]

    @cached_property
    def _spread(self) -> tuple[Real, Real]:
        """From H = AᵀA + S⁻² with weighted derivatives A and prior deviations S: H⁻¹ times the
        misfit, and H⁻¹ Aᵀ N A H⁻¹ with the part N that noise has in each row."""
        A, _ = self.point.system().weighted()
        inverse = np.linalg.pinv(A.T @ A + np.diag(1.0 / self.setting.scales**2))
        grow = max(1.0, self.cost / max(1, len(A) - A.shape[1]))
        heard, noise = inverse @ A.T, self.setting.noise_parts(self.point)
        both = np.diag(inverse) * grow, np.einsum("ij,j,ij->i", heard, noise, heard)
        wide, narrow = (np.sqrt(np.maximum(v, 0.0)) for v in both)
        return wide, narrow


def fitted_at(setting: Any, p: Real, before: Any = None) -> Fit:
    """A setting taken as it is at ``p``. Raises ModelError where the model is no structure."""
    return _taken(setting, setting.evaluate(p, before))


def _taken(setting: Any, point: Any) -> Fit:
    """What the point has computed on the way is let go, it may be large."""
    values, weights, _ = point.differences
    cost = float(np.sum((weights * values) ** 2) + np.sum((point.p / setting.scales) ** 2))
    return Fit(setting, replace(point), cost, len(values))


def bounds_of(setting: Any) -> Bounds:
    """The parameters' own bounds; wide ones for damping and faults."""
    parameters = setting.model.parameters
    others = [FARTHEST] * (len(setting.columns) - len(parameters))
    lower = [*(q.lower for q in parameters), *(-x for x in others)]
    return Bounds(np.array(lower), np.array([*(q.upper for q in parameters), *others]))


def fitted(setting: Any, start: Real, options: Options) -> Fit:
    """Weighted differences plus Gaussian priors, minimised from ``start`` by trust-region convex
    steps.

    Raises
    ------
    ModelError
        When the model is no structure at ``start``.
    """
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.0, setting.scales),),
        constraints=(bounds_of(setting),),
        columns=setting.columns,
    )
    return _taken(setting, iterate(setting, problem, SolverChoice(), options, start).point)
