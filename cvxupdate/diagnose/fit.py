"""Fitting a model with or without an extra piece of physics, from smooth to sharp."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.forward import file_damping
from cvxupdate.diagnose.mesh import NONE, MeshError
from cvxupdate.diagnose.residual import ResponsePoint, Setting, channel_errors
from cvxupdate.diagnose.signals import Real, Signal
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.fault import Fault
from cvxupdate.update.trust_region import Options, iterate

STIFFNESS_STD, MASS_STD = 0.02, 0.012  # ordinary scatter of a group between drawing and laboratory
CREDIBLE = 3.5  # deviations: an ordinary parameter further off is a finding
COMMON_DAMPING_STD, MODE_DAMPING_STD = (
    1.0,
    0.35,
)  # of log ζ: all modes together, each mode by itself
FREE = 1e4  # no prior
NOISE_KNOWN = 0.1  # relative: how well a file's coherence or quiet band tells the variance
RESOLVED = 0.01  # weighted squares per row: a tenth of the allowance for discretisation
LEVELS = (0.15, 0.05, 0.016, 0.005)


@dataclass(frozen=True)
class Fit:
    """A fitted setting: unknowns ``p`` at the last level, weighted ``cost`` there (data) and
    ``penalty`` (priors), ``rows``, and the point."""

    setting: Setting
    p: Real
    point: ResponsePoint
    cost: float
    penalty: float
    rows: int

    @property
    def misfit(self) -> float:
        """Weighted squares per row, priors included: 1 when what is left is noise and the allowance
        for discretisation."""
        return (self.cost + self.penalty) / max(1, self.rows)

    @cached_property
    def noise(self) -> float:
        """Weighted squares per row that noise alone leaves: below 1, for the weights allow for
        discretisation as well."""
        parts = [(s.std**2 / (2.0 * s.scale() ** 2)).reshape(-1) for s in self.setting.signals]
        return float(np.mean(np.concatenate(parts)))

    @property
    def excess(self) -> float:
        """The misfit beyond noise, as far as the noise is known: what tells two explanations apart
        that are both within the allowance."""
        return max(self.misfit - self.noise, NOISE_KNOWN * self.noise + RESOLVED)

    @property
    def damping_strain(self) -> float:
        """Squares of the modes' own log damping ratios in units of their ordinary scatter: about
        one for each mode when all is ordinary."""
        n = len(self.setting.model.parameters)
        return float(np.sum((self.p[n + 1 : n + 1 + self.setting.damped] / MODE_DAMPING_STD) ** 2))


def setting_for(
    model: Model,
    original: Model,
    signals: Sequence[Signal],
    top: float,
    bottom: float,
    faults: Sequence[Fault] = (),
    mesh: MeshError = NONE,
) -> Setting:
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
    return Setting(model, tuple(signals), file_damping(original, f), top, tuple(faults), mesh.at(f))


def scatter_of(q: Parameter) -> float:
    """Ordinary deviation of a group's p-value: `CREDIBLE` of them reach its bound, and it is at
    most the usual one."""
    return min(MASS_STD if q.of == "mass" else STIFFNESS_STD, q.upper / CREDIBLE)


def prior_scales(setting: Setting) -> Real:
    """Standard deviations of the unknowns before any recording: group p-values scatter ordinarily;
    physics under trial and faults are free."""
    out = []
    for q in setting.model.parameters:
        out.append(FREE if q.group is None else scatter_of(q))
    return np.array(
        [
            *out,
            COMMON_DAMPING_STD,
            *[MODE_DAMPING_STD] * setting.damped,
            *[FREE] * len(setting.faults),
        ]
    )


def bounds_of(setting: Setting) -> Bounds:
    """The parameters' own bounds; wide ones for damping and faults."""
    lower = (
        [q.lower for q in setting.model.parameters]
        + [-4.0] * (1 + setting.damped)
        + [-4.0] * len(setting.faults)
    )
    upper = (
        [q.upper for q in setting.model.parameters]
        + [4.0] * (1 + setting.damped)
        + [4.0] * len(setting.faults)
    )
    return Bounds(np.array(lower), np.array(upper))


def fit(
    setting: Setting,
    start: Real,
    tolerance: float = 3e-3,
    iterations: int = 12,
    radius: float = 0.5,
) -> Fit:
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
    return fitted_at(setting, loop.point)


def fitted_at(setting: Setting, point: ResponsePoint) -> Fit:
    """A point taken as a fit; what the point has computed on the way is let go, it may be large."""
    values, weights, _ = point.differences
    cost, penalty = (
        float(np.sum((weights * values) ** 2)),
        float(np.sum((point.p / prior_scales(setting)) ** 2)),
    )
    return Fit(setting, point.p, replace(point), cost, penalty, len(values))


def at_level(setting: Setting, signals: Sequence[Signal]) -> Setting:
    """The same unknowns against other signals."""
    return replace(setting, signals=tuple(signals))


def error_of(
    setting: Setting, p: Real, signals: Sequence[Signal], reference: ResponsePoint | None = None
) -> float:
    """Normalised error of the responses at ``p`` on ``signals``; modes keep the damping of
    ``reference``."""
    point = at_level(setting, signals).evaluate(p, reference)
    return channel_errors(point.setting.signals, point.modelled())
