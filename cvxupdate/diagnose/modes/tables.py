"""Tables of modes to fit and to score, weighted by noise and by what a sound model may miss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaincinv

from cvxupdate.diagnose.settings import (
    FREQUENCY_DISCREPANCY,
    LIKELY,
    SHAPE_DISCREPANCY,
    UNSTATED_FREQUENCY,
    UNSTATED_SHAPE,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint


def chi_square(level: float, freedoms: int) -> float:
    """What chi-square with so many degrees of freedom does not exceed with probability ``level``;
    scipy.stats takes half a second to import."""
    return float(2.0 * gammaincinv(freedoms / 2.0, level))


@dataclass(frozen=True)
class Tables:
    """Tables to fit and to score only: standard deviations widened by the discrepancy of a sound
    model. ``measured``: those to fit and to score as they were, deviations of noise alone in every
    entry."""

    fit: tuple[ModeTable, ...]
    hold: tuple[ModeTable, ...]
    measured: tuple[ModeTable, ...]

    @property
    def top(self) -> float:
        """The highest frequency to fit, Hz."""
        return max(float(t.frequency.max()) for t in self.fit)

    @property
    def bottom(self) -> float:
        """The lowest, Hz."""
        return min(float(t.frequency.min()) for t in self.fit)

    @property
    def shapes(self) -> bool:
        """Whether any mode to fit has a shape."""
        return any(t.shapes is not None for t in self.fit)

    @property
    def noise(self) -> float:
        """R.m.s. relative error of the held-out frequencies that their deviations alone explain
        nineteen times in twenty; NaN where none are."""
        std = np.concatenate([np.zeros(0), *(t.frequency_std / t.frequency for t in self.hold)])
        if not len(std):
            return float("nan")
        return float(np.sqrt(np.mean(std**2) * chi_square(LIKELY, len(std)) / len(std)))

    def noise_parts(self, point: ModalPoint) -> Real:
        """The part of each row's weighted square that noise alone makes, (rows,)."""
        parts: list[Real] = []
        for k, table in enumerate(self.fit):
            paired = point.places[k] >= 0
            parts.append((self.measured[k].frequency_std / table.frequency_std)[paired] ** 2)
        if point.residual.shapes:
            for k, i, _, rows, _, std in point.shape_rows():
                narrow = self.measured[k].shape_std
                own = np.full(len(rows), UNSTATED_SHAPE) if narrow is None else narrow[i]
                parts.append((np.resize(own[: len(rows)], len(rows)) / std) ** 2)
        return np.concatenate([np.zeros(0), *parts])


def prepared(tables: Sequence[ModeTable]) -> Tables:
    """Those to fit and those to score."""
    fit, hold = (
        tuple(_stated(t) for t in tables if (t.origin.use == "fit") == use) for use in (True, False)
    )
    return Tables(tuple(_widened(t) for t in fit), tuple(_widened(t) for t in hold), (*fit, *hold))


def _stated(table: ModeTable) -> ModeTable:
    """With a standard deviation in every entry."""
    std = UNSTATED_FREQUENCY * table.frequency if table.relative_only else table.frequency_std
    shape = table.shape_std
    if table.shapes is not None:
        known = np.full(table.shapes.shape, np.nan)
        known = known if shape is None else np.broadcast_to(shape, table.shapes.shape)
        shape = np.where(np.isfinite(known), known, UNSTATED_SHAPE)
    return replace(table, frequency_std=std, shape_std=shape, relative_only=False)


def _widened(table: ModeTable) -> ModeTable:
    discrepancy = FREQUENCY_DISCREPANCY**2 * table.frequency**2
    shape = table.shape_std
    return replace(
        table,
        frequency_std=np.sqrt(table.frequency_std**2 + discrepancy),
        shape_std=None if shape is None else np.sqrt(shape**2 + SHAPE_DISCREPANCY**2),
    )


def errors_of(point: ModalPoint, tables: Sequence[ModeTable], fitted: bool) -> Real:
    """Relative errors of the frequencies of the fitted or the held-out modes of ``tables``, which
    are paired as those of the point."""
    first = len(point.residual.fit)
    errors: list[float] = []
    for k, table in enumerate(tables):
        if (k < first) == fitted:
            f = point.frequencies(k)
            errors += ((f - table.frequency) / table.frequency)[np.isfinite(f)].tolist()
    return np.array(errors)


def rms(errors: Real) -> float:
    """NaN where there are none."""
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")
