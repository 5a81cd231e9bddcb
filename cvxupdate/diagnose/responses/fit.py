"""A model fitted to responses, with or without effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.nominal.damping import file_damping
from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.nominal.scatter import scatter_of, spread_of
from cvxupdate.diagnose.responses.lines import Real
from cvxupdate.diagnose.responses.point import ResponsePoint, ResponseSetting
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.diagnose.settings import (
    COMMON_DAMPING_STD,
    FREE,
    MODE_DAMPING_STD,
    NOISE_KNOWN,
    RESOLVED,
)
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.fault import Fault
from cvxupdate.update.trust_region import Options, iterate


@dataclass(frozen=True)
class ResponseFit:
    """A fitted setting: unknowns ``p`` at the last level, weighted squares ``cost`` there (data and
    priors), ``rows``, and the point."""

    setting: ResponseSetting
    p: Real
    point: ResponsePoint
    cost: float
    rows: int

    @property
    def misfit(self) -> float:
        """Weighted squares per row, priors included: 1 when what is left is noise and the
        discrepancy of a sound model."""
        return self.cost / max(1, self.rows)

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
        A, _ = self.point.system().weighted()
        noise = np.concatenate(
            [np.tile(part.reshape(-1), 2) for part in _noise_parts(self.setting.signals)]
        )
        return spread_of(A, noise, prior_scales(self.setting), self.cost)

    @cached_property
    def noise(self) -> float:
        """Weighted squares per row that noise alone leaves: below 1, for the weights allow for
        discretisation as well."""
        parts = _noise_parts(self.setting.signals)
        return float(np.mean(np.concatenate([part.reshape(-1) for part in parts])))

    @property
    def excess(self) -> float:
        """The misfit beyond noise, as far as the noise is known: what tells two explanations apart
        that are both within the allowance."""
        return max(self.misfit - self.noise, NOISE_KNOWN * self.noise + RESOLVED)

    @property
    def damping_strain(self) -> float:
        """Squares of the modes' own log damping ratios in units of their usual scatter: about one
        for each mode when all is usual."""
        n = len(self.setting.model.parameters)
        return float(np.sum((self.p[n + 1 : n + 1 + self.setting.damped] / MODE_DAMPING_STD) ** 2))


def setting_for(
    model: Model,
    original: Model,
    signals: Sequence[Signal],
    top: float,
    faults: Sequence[Fault] = (),
    mesh: MeshError = NONE,
) -> ResponseSetting:
    """Give every mode in the band a damping ratio of its own, starting from the problem file's."""
    m = model.matrices(model.zero())
    rigid = rigid_body_modes(model, m.K, m.M)
    count = min(model.size, 40)
    while True:
        modes = natural_modes(m.K, m.M, count, rigid).flexible()
        if (
            len(modes.frequencies) < count
            or modes.frequencies[-1] > 1.3 * top
            or count >= model.size
        ):
            break
        count = min(2 * count, model.size)
    band = int(np.sum(modes.frequencies < 1.25 * top))
    f = modes.frequencies[:band]
    return ResponseSetting(
        model, tuple(signals), file_damping(original, f), top, tuple(faults), mesh.at(f)
    )


def prior_scales(setting: ResponseSetting) -> Real:
    """Standard deviations of the unknowns before any recording: group p-values scatter as usual;
    effects and faults are free."""
    parameters = setting.model.parameters
    return np.array(
        [
            *(FREE if q.group is None else scatter_of(q) for q in parameters),
            COMMON_DAMPING_STD,
            *[MODE_DAMPING_STD] * setting.damped,
            *[FREE] * len(setting.faults),
        ]
    )


def bounds_of(setting: ResponseSetting) -> Bounds:
    """The parameters' own bounds; wide ones for damping and faults."""
    parameters, others = setting.model.parameters, setting.size - len(setting.model.parameters)
    lower = [q.lower for q in parameters] + [-4.0] * others
    upper = [q.upper for q in parameters] + [4.0] * others
    return Bounds(np.array(lower), np.array(upper))


def fit(
    setting: ResponseSetting,
    start: Real,
    tolerance: float = 3e-3,
    iterations: int = 12,
    radius: float = 0.5,
) -> ResponseFit:
    """Weighted output error plus Gaussian priors, minimised by the trust-region loop of convex
    steps.

    Raises
    ------
    ModelError
        When the model is no structure at ``start``.
    """
    scales = prior_scales(setting)
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.0, scales),),
        constraints=(bounds_of(setting),),
        columns=setting.columns,
    )
    loop = iterate(setting, problem, SolverChoice(), Options(tolerance, iterations, radius), start)
    return fitted_at(loop.point)


def fitted_at(point: ResponsePoint) -> ResponseFit:
    """A point taken as a fit; what the point has computed on the way is let go, it may be large."""
    values, weights, _ = point.differences
    scales = prior_scales(point.setting)
    cost = float(np.sum((weights * values) ** 2)) + float(np.sum((point.p / scales) ** 2))
    return ResponseFit(point.setting, point.p, replace(point), cost, len(values))


def _noise_parts(signals: Sequence[Signal]) -> list[Real]:
    """The part of each row's weighted square that noise alone makes, real and imaginary alike."""
    return [s.std**2 / (2.0 * s.scale() ** 2) for s in signals]
