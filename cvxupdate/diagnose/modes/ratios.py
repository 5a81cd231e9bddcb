"""Damping ratios of fitted modes, what is known of them beforehand, and what dampers add."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from cvxupdate.diagnose.modes.dashpots import RealModes
from cvxupdate.diagnose.nominal.damping import file_damping
from cvxupdate.diagnose.settings import (
    COMMON_DAMPING_REPEATED,
    COMMON_DAMPING_STD,
    DAMPING_REPEATED,
    FEWEST_RATIOS,
    MODE_DAMPING_STD,
    UNSTATED_DAMPING,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.physics.attached_resonator import Oscillator
from cvxupdate.physics.effect import ModelChange
from cvxupdate.residual.modal import ModalPoint

INSIDE = 41  # sizes tried of a dashpot inside a hidden oscillator


@dataclass(frozen=True)
class Ratios:
    """Measured damping ratios (modes,), their deviations, what is known of them beforehand (by the
    ``file``, or measured at the reference), and the modes: shapes (N, modes), circular frequencies;
    deviations of log ζ about what is known, of each mode (``own``) and of all together
    (``common``); ``swinging`` (oscillators, modes): what one unit of a dashpot inside each hidden
    oscillator of the model adds, which it may have as it likes; ``real`` finds the lowest real
    modes of the model, of which these are those ``at`` (modes,)."""

    measured: Real
    std: Real
    file: Real
    shapes: Real
    omega: Real
    own: Real | float = MODE_DAMPING_STD
    common: float = COMMON_DAMPING_STD
    swinging: Real = field(default_factory=lambda: np.zeros((0, 0)))
    real: Callable[[], RealModes] | None = None
    at: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def spread(self) -> Real:
        """Deviation of the logarithm of each ratio: usual scatter, measurement, and what the first
        order in damping leaves of a heavy one, the ratio itself as a part of it."""
        return np.sqrt(self._variance(1.0))

    def _variance(self, share: Real | float) -> Real:
        """Its square, where only a ``share`` of the ratio scatters."""
        own = np.square(np.multiply(self.own, share))
        return np.asarray(own + (self.std / self.measured) ** 2 + self.measured**2)

    def strain(self, added: Real) -> Real:
        """Squares of the log ratios in units of their scatter beside what is known with ``added``
        (sizes, modes), the common shift and what hidden oscillators lose at their best: (sizes,).
        What is added is no more than it is: scatter is of the rest."""
        least = self._strain(added)
        for rate in self.swinging:
            most = float(np.min(self.measured / np.maximum(rate, np.finfo(float).tiny)))
            inside = added[:, None] + most * np.linspace(0.0, 1.0, INSIDE)[:, None] * rate
            tried = self._strain(inside.reshape(-1, len(rate))).reshape(len(added), INSIDE)
            k = np.argmin(tried, axis=1)
            added, least = inside[np.arange(len(k)), k], tried[np.arange(len(k)), k]
        return least

    def _strain(self, added: Real) -> Real:
        share = self.file / (self.file + added)
        u = np.log(self.measured / self.file * share)
        w = 1.0 / self._variance(share)
        common = (w * share * u).sum(axis=1) / ((w * share**2).sum(axis=1) + self.common**-2)
        left = u - share * common[:, None]
        return np.asarray((w * left**2).sum(axis=1) + (common / self.common) ** 2)

    def rate(self, c: ModelChange) -> Real:
        """What one unit of an effect's parameter adds to each ratio, (modes,)."""
        out = np.zeros(len(self.omega))
        phi = np.vstack([self.shapes, np.zeros((1, self.shapes.shape[1]))])
        for b in c.tangent[0]:
            local = phi[b.dofs]  # (elements, dofs, modes); −1 is the ground
            for part, by in ((b.C, 2.0 * self.omega), (b.D, 2.0 * self.omega**2)):
                if part is not None:
                    out += np.einsum("eim,eij,ejm->m", local, part, local, optimize=True) / by
        return out

    def coupled(self, c: ModelChange, sizes: Real) -> Real:
        """What an effect of these ``sizes`` adds to each ratio, (sizes, modes), in all orders."""
        if self.real is None:
            return sizes[:, None] * self.rate(c)
        real, used = self.real(), int(self.at.max()) + 1
        zeta = real.zeta.copy()
        zeta[self.at] = self.file
        real = replace(real, zeta=zeta)
        one = real.damping(c)
        found = [real.with_damping(size * one, used).zeta[self.at] for size in sizes]
        return np.array(found) - self.file


def ratios_of(point: ModalPoint, original: Model, before: Sequence[Real] = ()) -> Ratios | None:
    """The fitted tables' damping ratios beside the model's modes; None where there are too few.
    ``before``: of each table, the ratios at the reference with their deviations, (2, modes), NaN
    where it has none."""
    rows: list[Real] = []
    for k, (table, places) in enumerate(zip(point.residual.fit, point.places, strict=False)):
        at_reference = before[k] if before else np.full((2, len(places)), np.nan)
        today = table.damping, _stated(table.damping, table.damping_std)
        rows.append(np.column_stack([*today, places, at_reference[0], _stated(*at_reference)]))
    of = np.concatenate(rows) if rows else np.empty((0, 5))
    there = (of[:, 0] > 0.0) & (of[:, 2] >= 0)  # NaN is neither
    there[there] = point.modes.eigenvalues[of[there, 2].astype(int)] > 0.0
    if there.sum() < FEWEST_RATIOS:
        return None
    zeta, std, _, known, known_std = of[there].T
    at = of[there, 2].astype(int)
    flexible = np.maximum(point.modes.eigenvalues[point.modes.rigid :], 0.0)
    given = file_damping(original, np.sqrt(flexible) / (2.0 * np.pi))[at - point.modes.rigid]
    omega, shapes = np.sqrt(point.modes.eigenvalues[at]), point.modes.shapes[:, at]
    swinging = _swinging(point.residual.model, shapes) / (2.0 * omega)
    more: dict[str, Any] = {"swinging": swinging, "real": partial(RealModes.of, point), "at": at}
    measured = known > 0.0
    if not np.any(measured):
        return Ratios(zeta, std, given, shapes, omega, **more)
    relative = np.where(measured, known_std / np.where(measured, known, 1.0), 0.0)
    own = np.where(
        measured,
        np.hypot(DAMPING_REPEATED, relative),
        np.hypot(MODE_DAMPING_STD, COMMON_DAMPING_STD),
    )
    known = np.where(measured, known, given)
    return Ratios(zeta, std, known, shapes, omega, own, COMMON_DAMPING_REPEATED, **more)


def _swinging(model: Model, shapes: Real) -> Real:
    """Squares of how far each hidden oscillator moves against its host, (oscillators, modes)."""
    pairs = [b.dofs[:, :2] for b in model.blocks if b.kind.name == Oscillator.name]
    both = np.concatenate([np.zeros((0, 2), dtype=np.int64), *pairs])
    return np.asarray((shapes[both[:, 0]] - shapes[both[:, 1]]) ** 2)


def _stated(damping: Real, std: Real) -> Real:
    return np.where(std > 0.0, std, UNSTATED_DAMPING * damping)
