"""A model fitted to recordings, with or without effects: the same for every kind of evidence."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import scipy.linalg

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.settings import (
    CHANCE,
    LARGEST_LEVEL,
    LEAST_LEVEL,
    NOISE_KNOWN,
    RESOLVED,
)
from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.physics.fault import Fault
from cvxupdate.recordings.quantiles import chi_square_above
from cvxupdate.update.trust_region import Options, iterate

SMALL = 1e-12  # variance of a row without noise or discrepancy
PLENTY = 100  # rows, of which it does not matter how many a few unknowns take up
GRID = 25  # levels of the model's discrepancy, over which the evidence is averaged


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

    @property
    def reach(self) -> Real:
        """How far those unknowns may go to either side that are no parameters of the model."""

    def noise_parts(self, point: Any) -> Real:
        """The part of each row's weighted square that noise alone makes."""

    def figures(self, point: Any) -> tuple[float, float]:
        """How many independent figures the rows hold (neighbouring lines of a response say the same
        of a model's discrepancy), and how many of them unknowns of the setting's own take up."""

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
        """Weighted squares per row that noise alone leaves once the parameters are fitted: below 1,
        for the weights allow for the discrepancy of a sound model as well."""
        if not self.rows:
            return 0.0
        spare = max(0, self.rows - len(self.p)) / self.rows
        return float(np.mean(self.setting.noise_parts(self.point))) * spare

    @cached_property
    def independent(self) -> float:
        """That of the setting."""
        return float(self.setting.figures(self.point)[0])

    @property
    def free(self) -> float:
        """Of these figures those that no unknown of the setting's own takes up: with as many
        unknowns any effects reproduce them."""
        every, own = self.setting.figures(self.point)
        return float(every - own)

    @property
    def log_evidence(self) -> float:
        """The likelihood with the priors of the unknowns, which count as little beside the rows as
        they did in the fit."""
        prior = float(np.sum((self.p / self.setting.scales) ** 2))
        return self.log_likelihood - 0.5 * self._share * prior

    @property
    def _share(self) -> float:
        return self.independent / max(1, self.rows)

    @cached_property
    def log_likelihood(self) -> float:
        """Logarithm of the Gaussian likelihood at the unknowns, averaged over the level of the
        model's discrepancy (a factor on what the weights allow for, log-uniform): a model that
        leaves only noise gains by needing no discrepancy, one that leaves much is not ruled out by
        a level that nobody knew. Rows count as so many as are independent."""
        values, weights, _ = self.point.differences
        return self._averaged(np.abs(weights * values) ** 2, self._known_noise)

    @property
    def spent(self) -> bool:
        """Whether a fit is as likely, within chance, as one that leaves noise alone: then nothing
        is left that any effect could explain, however much of a sound model's discrepancy the
        weights allow for."""
        chance = 0.5 * self._share * (chi_square_above(1.0 - CHANCE, self.rows) - self.rows)
        return self.log_likelihood >= self.noise_alone - chance

    @property
    def noise_alone(self) -> float:
        """Logarithm of the likelihood of a fit that leaves noise alone."""
        noise = self._known_noise
        return self._averaged(noise, noise)

    @property
    def _known_noise(self) -> Real:
        # where a coherence says more noise than the weights know, it is all there is
        return np.minimum(self.setting.noise_parts(self.point), 1.0)

    def _averaged(self, squares: Real, noise: Real) -> float:
        share = self._share
        levels = np.geomspace(LEAST_LEVEL, LARGEST_LEVEL, GRID)
        variances = (noise + level**2 * (1.0 - noise) + SMALL for level in levels)
        logs = np.array([-0.5 * share * np.sum(squares / v + np.log(v)) for v in variances])
        best = float(logs.max())
        return best + float(np.log(np.mean(np.exp(logs - best))))

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
        """Standard deviations of the unknowns, linearised, with what the model leaves open."""
        return self._spread[0]

    @property
    def noise_deviations(self) -> Real:
        """The same of the recordings' noise alone."""
        return self._spread[1]

    def spare(self, first: int) -> float:
        """Rows that the first so many unknowns do not take up: each takes up as much of one as the
        rows tell of it beside its prior (MacKay 1992, well-determined parameters). All of one where
        rows are `PLENTY`, or a repeated eigenvalue has no derivatives."""
        least = float(self.rows - first)
        with suppress(ModelError):
            return least if least >= PLENTY else self.rows - float(np.sum(self._determined[:first]))
        return least

    def determined(self, some: Sequence[int]) -> float:
        """How many of ``some`` unknowns the rows tell beside their priors (well-determined ones;
        MacKay 1992); all where a repeated eigenvalue has no derivatives."""
        with suppress(ModelError):
            return float(np.sum(self._determined[list(some)]))
        return float(len(some))

    @cached_property
    def _determined(self) -> Real:
        """Of each unknown the part that the rows tell, (columns,), 0 to 1."""
        _, inverse = self._linearised()
        return np.asarray(1.0 - np.diag(inverse) / self.setting.scales**2)

    def _linearised(self) -> tuple[Real, Real]:
        """Weighted derivatives A (rows, columns) and the inverse of AᵀA + S⁻² with prior deviations
        S; the first may be large, and is not kept."""
        A, _ = self.point.system().weighted()
        return A, inverted(A.T @ A + np.diag(1.0 / self.setting.scales**2))

    @cached_property
    def _spread(self) -> tuple[Real, Real]:
        """From H = AᵀA + S⁻² with weighted derivatives A and prior deviations S: H⁻¹ Aᵀ N A H⁻¹
        with the part N that noise has in each row; and the same with the model's discrepancy in the
        rest, as large as this fit shows it and alike over as many rows as say the same, and with
        what priors may be off that count as often, but no less than H⁻¹ grown with the misfit."""
        A, inverse = self._linearised()
        left = self.cost / max(1, len(A) - A.shape[1])
        heard, noise = inverse @ A.T, self.setting.noise_parts(self.point)
        narrow, rest = (np.einsum("ij,j,ij->i", heard, n, heard) for n in (noise, 1.0 - noise))
        heeded = float(np.mean(noise)) if self.rows else 0.0
        level = max(0.0, left - heeded) / max(SMALL, 1.0 - heeded)
        alike = max(1.0, self.rows / max(1.0, self.independent))
        known = inverse**2 @ self.setting.scales**-2.0 * (heeded + (1.0 - heeded) * alike)
        wide = np.maximum(np.diag(inverse) * max(1.0, left), narrow + rest * level * alike + known)
        together, alone = (np.sqrt(np.maximum(v, 0.0)) for v in (wide, narrow))
        return together, alone


def inverted(H: Real) -> Real:
    """Inverse of a symmetric matrix (n, n) that is not negative, of unknowns in whatever units;
    along what nothing tells it is large and finite."""
    size = np.sqrt(np.diag(H))
    d = 1.0 / np.where(size > 0.0, size, 1.0)
    scaled = d[:, None] * H * d
    try:
        values, V = np.linalg.eigh(scaled)
    except np.linalg.LinAlgError:  # divide and conquer may not converge, however sound a matrix is
        values, V = scipy.linalg.eigh(scaled, driver="ev")
    least = np.finfo(float).eps * len(H) * max(float(values.max(initial=0.0)), 1.0)
    V = d[:, None] * V
    return np.asarray((V / np.maximum(values, least)) @ V.T)


def fitted_at(setting: Any, p: Real, before: Any = None) -> Fit:
    """A setting taken as it is at ``p``. Raises ModelError where the model is no structure."""
    return taken(setting, setting.evaluate(p, before))


def taken(setting: Any, point: Any) -> Fit:
    """A setting at a point of it. What that has computed on the way is let go, it may be large."""
    values, weights, _ = point.differences
    cost = float(np.sum((weights * values) ** 2) + np.sum((point.p / setting.scales) ** 2))
    return Fit(setting, replace(point), cost, len(values))


def bounds_of(setting: Any) -> Bounds:
    """The parameters' own bounds, and those of all other unknowns."""
    parameters = setting.model.parameters
    lower, upper = (np.array([getattr(q, side) for q in parameters]) for side in ("lower", "upper"))
    reach = setting.reach
    return Bounds(np.concatenate([lower, -reach]), np.concatenate([upper, reach]))


def fitted(setting: Any, start: Real, options: Options, bounds: Bounds | None = None) -> Fit:
    """Weighted differences plus Gaussian priors, minimised from ``start`` by trust-region convex
    steps; ``bounds``: of the unknowns, where they are not the parameters of one model.

    Raises
    ------
    ModelError
        When the model is no structure at ``start``.
    """
    return taken(setting, stepped(setting, setting, start, options, bounds))


def stepped(
    compared: Any, setting: Any, start: Real, options: Options, bounds: Bounds | None = None
) -> Any:
    """The point where trust-region convex steps from ``start`` end that lower what ``compared``, a
    comparison of the setting's points, makes of them, with the setting's Gaussian priors."""
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.0, setting.scales),),
        constraints=(bounds_of(setting) if bounds is None else bounds,),
        columns=setting.columns,
    )
    if bounds is None:
        options = replace(options, growing=_sizes(setting))
    return iterate(compared, problem, SolverChoice(direct=True), options, start).point


def _sizes(setting: Any) -> tuple[bool, ...]:
    """Which unknowns are sizes of effects: in units of what is usual at their places they may be
    thousands, and steps of one would never come there."""
    free = [q.group is None for q in setting.model.parameters]
    return (*free, *[False] * (len(setting.columns) - len(free)))
