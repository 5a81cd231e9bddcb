"""Several states of one structure as one fit: unknowns that all share, and each state's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.convex import Bounds
from cvxupdate.diagnose.fit import Fit, fitted
from cvxupdate.diagnose.modes.setting import ModesSetting
from cvxupdate.diagnose.types import Real
from cvxupdate.physics.fault import Fault
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.system import LinearSystem
from cvxupdate.update.trust_region import Options

OPTIONS = Options(1e-4, 40, 0.3)


@dataclass(frozen=True)
class Together:
    """``parts``: the model of each state beside its tables; ``maps``: (its unknowns, all unknowns)
    what each part's unknowns are of all; names, prior deviations and bounds of these."""

    parts: tuple[ModesSetting, ...]
    maps: tuple[Real, ...]
    columns: tuple[str, ...]
    scales: Real
    lower: Real
    upper: Real
    faults: tuple[Fault, ...] = ()
    level: int = 0

    def evaluate(self, p: Real, before: TogetherPoint | None = None) -> TogetherPoint:
        """Every state at ``p``. Raises ModelError where one is no structure."""
        old = [None] * len(self.parts) if before is None else before.points
        points = (
            part.evaluate(to @ p, point)
            for part, to, point in zip(self.parts, self.maps, old, strict=True)
        )
        return TogetherPoint(p, tuple(points), self.maps, self.columns)

    def noise_parts(self, point: TogetherPoint) -> Real:
        """Of every row, state by state."""
        pairs = zip(self.parts, point.points, strict=True)
        return np.concatenate([part.noise_parts(own) for part, own in pairs])

    def figures(self, point: TogetherPoint) -> tuple[float, float]:
        """The sum of the states'."""
        return sum(a.figures(b)[0] for a, b in zip(self.parts, point.points, strict=True)), 0.0

    def damping_strain(self, p: Real) -> float:
        """None."""
        return 0.0


@dataclass(frozen=True)
class TogetherPoint:
    """`Together` at ``p``, with the ``points`` of the states."""

    p: Real
    points: tuple[ModalPoint, ...]
    maps: tuple[Real, ...]
    columns: tuple[str, ...]

    @property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(values, weights, rows) of all states."""
        parts = [point.differences for point in self.points]
        values, weights = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        return values, weights, tuple(row for part in parts for row in part[2])

    def system(self) -> LinearSystem:
        """Linearised here."""
        systems = [point.system() for point in self.points]
        return LinearSystem(
            np.vstack([s.A @ to for s, to in zip(systems, self.maps, strict=True)]),
            np.concatenate([s.b for s in systems]),
            np.concatenate([s.weights for s in systems]),
            self.columns,
            tuple(row for s in systems for row in s.rows),
        )


def together(
    parts: Sequence[ModesSetting],
    nuisance: int,
    units: Sequence[float],
    own: bool,
    whole: bool = False,
) -> Together:
    """Settings whose first ``nuisance`` unknowns are those of one structure, and whose last is the
    size of an effect, of which one is so many ``units`` (none: no effect). Its size is the same in
    all states, in the unit of the first, or each state's ``own``. One of ``whole`` groups is no
    larger than these scatter by: it is one structure."""
    effects = 0 if not units else len(parts) if own else 1
    n = nuisance + effects
    maps = []
    for k in range(len(parts)):
        to = np.zeros((nuisance + bool(units), n))
        to[:nuisance, :nuisance] = np.eye(nuisance)
        if units:
            to[nuisance, nuisance + (k if own else 0)] = 1.0 if own else units[0] / units[k]
        maps.append(to)
    first = parts[0]
    names, scales = list(first.columns[:nuisance]), list(first.scales[:nuisance])
    limits = [(q.lower, q.upper) for q in first.model.parameters[:nuisance]]
    for k in range(effects):
        q = parts[k].model.parameters[nuisance]
        names.append(f"{q.name} ({k})")
        scales.append(
            float(np.max(first.scales[:nuisance]) if whole else parts[k].scales[nuisance])
        )
        limits.append((q.lower, q.upper))
    lower, upper = np.array(limits).reshape(-1, 2).T
    return Together(
        tuple(parts), tuple(maps), tuple(names), np.array(scales), lower.copy(), upper.copy()
    )


def fitted_together(setting: Together, start: Real) -> Fit:
    """By trust-region convex steps; raises ModelError where the start is no structure."""
    return fitted(setting, start, OPTIONS, Bounds(setting.lower, setting.upper))
