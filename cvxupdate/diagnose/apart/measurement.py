"""Which of several measurements tells explanations apart, and by how many deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.settings import APART_ENOUGH, EVEN
from cvxupdate.diagnose.types import Real

BOUNDARIES = ("mass", "spring", "support", "free")
"""Kinds of measurements that change the boundary."""


@dataclass(frozen=True)
class Explanation:
    """Effects that explain the recordings: in words, with the weighted squares per row that they
    leave once refitted."""

    title: str
    misfit: float


@dataclass(frozen=True)
class Measurement:
    """Something to measure: ``kind`` ("response", "repeat", "level", "mass", "spring", "support",
    "free", "shape", "modes"), the DOFs of its ``sensor`` and ``drive`` (empty where it is about
    neither), the ``node`` whose boundary changes (in direction ``dof``), the known ``mass`` (kg) or
    ``stiffness`` (N/m) there, in words (``says``); ``separations`` (pairs,): by how many deviations
    it tells each pair of explanations apart; ``left``: how many of them are expected to be listed
    still beside the true one (None: not known); ``factor``: times the force of the loudest run that
    was recorded."""

    kind: str
    says: str
    separations: tuple[float, ...]
    sensor: str = ""
    drive: str = ""
    node: int | None = None
    mass: float = 0.0
    left: float | None = None
    factor: float = 1.0
    dof: str = ""
    stiffness: float = 0.0

    @property
    def is_boundary(self) -> bool:
        """Whether it changes the boundary."""
        return self.kind in BOUNDARIES

    @property
    def least(self) -> float:
        """Of the pair that it tells worst."""
        return min(self.separations, default=0.0)

    @property
    def worth(self) -> float:
        """The mean over pairs; what is told surely is not told better by more."""
        return float(np.mean(np.minimum(self.separations, APART_ENOUGH)))

    @property
    def rank(self) -> tuple[float, float]:
        """By what is left listed, to a hundredth, or by worth; of equals the one that tells the
        worst pair best."""
        return (self.worth if self.left is None else -round(self.left, 2)), self.least


@dataclass(frozen=True)
class MeasurementSet:
    """Measurements made together, the most telling first, and by how many deviations they tell each
    pair of explanations apart (pairs,). How many other effects are expected to be listed beside
    the true one, also of those that the diagnosis does not list: ``before`` and ``after``;
    ``left`` of those that it lists."""

    measurements: tuple[Measurement, ...]
    separations: tuple[float, ...]
    before: float = 0.0
    after: float = 0.0
    left: float = 0.0

    @property
    def least(self) -> float:
        """Of the pair that they tell worst."""
        return min(self.separations, default=0.0)


@dataclass(frozen=True)
class LawCheck:
    """A linear ``effect`` may be what a ``law`` (both in words) looks like at one level; its size
    would then go with the level to a ``power``. ``separations`` (factors,): by how many deviations
    the same responses at ``factors`` times the level tell one from the other."""

    effect: str
    law: str
    power: float
    factors: tuple[float, ...]
    separations: tuple[float, ...]

    @property
    def chosen(self) -> int:
        """Of the factors the nearest to 1 that tells surely, or the one that tells most."""
        told = [k for k, d in enumerate(self.separations) if d >= APART_ENOUGH]
        near = sorted(told, key=lambda k: (abs(np.log(self.factors[k])), self.factors[k]))
        return near[0] if near else int(np.argmax(self.separations))


@dataclass(frozen=True)
class Apart:
    """``explanations`` that do alike on what was recorded; ``measurements``, the most telling
    first; ``lines`` what else is to be said; ``together`` further responses that are worth
    measuring as a set, where responses were compared; ``pairs`` the explanations (from 0) that each
    separation is of (empty: all of them), ``same`` those that nothing of what was tried tells;
    ``laws`` that single effects may be the equivalents of, which another level tells."""

    explanations: tuple[Explanation, ...]
    measurements: tuple[Measurement, ...]
    lines: tuple[str, ...] = ()
    together: MeasurementSet | None = None
    pairs: tuple[tuple[int, int], ...] = ()
    same: tuple[tuple[int, int], ...] = ()
    laws: tuple[LawCheck, ...] = ()

    @property
    def proposed(self) -> tuple[Measurement, ...]:
        """What is best measured next: the set, or the most telling single measurement where that
        is as good. Another boundary has to leave clearly fewer explanations listed: further
        responses are fitted together with those that are there, and it is a problem of its own.
        Empty where nothing was compared."""
        best, several = self.measurements[:1], self.together
        if not best or several is None or best[0].left is None:
            return best
        if best[0].is_boundary:
            return best if best[0].left < several.left - EVEN else several.measurements
        return best if self.as_good(best[0]) else several.measurements

    def as_good(self, one: Measurement) -> bool:
        """Whether a measurement leaves hardly more explanations listed than the set; so where
        either is not known."""
        if self.together is None or one.left is None:
            return True
        return one.left <= self.together.left + EVEN


def pairs_of(count: int) -> list[tuple[int, int]]:
    """In the order of `Measurement.separations`."""
    return [(i, j) for i in range(count) for j in range(i + 1, count)]


def ranked(measurements: Sequence[Measurement]) -> tuple[Measurement, ...]:
    """The most telling first."""
    return tuple(sorted(measurements, key=lambda m: m.rank, reverse=True))


def separation(gap: Real, spread: Real, share: float = 1.0) -> float:
    """How far apart two predictions are, in standard deviations of their difference.

    √(Δᵀ C⁻¹ Δ) with C = I / ``share`` + S Sᵀ: the ``gap`` Δ (rows,) is in units of each row's
    deviation, ``spread`` S (rows, r) what the unknowns of both explanations leave open after the
    recordings there are (square root of J P Jᵀ), and of rows that say the same only a share counts
    (Box and Hill 1967, the discrimination of two models; by Woodbury's formula).
    """
    inner = np.eye(spread.shape[1]) + share * spread.T @ spread
    heard = spread.T @ gap
    squares = float(gap @ gap - share * heard @ np.linalg.solve(inner, heard))
    return float(np.sqrt(max(share * squares, 0.0)))


def root_of_covariance(A: Real, scales: Real, share: float = 1.0) -> Real:
    """L with L Lᵀ = (``share`` AᵀA + S⁻²)⁻¹: what recordings with weighted derivatives A (rows, n)
    leave of unknowns with prior deviations S (n,)."""
    precision = share * A.T @ A + np.diag(1.0 / scales**2)
    values, vectors = np.linalg.eigh((precision + precision.T) / 2.0)
    return np.asarray(
        vectors / np.sqrt(np.maximum(values, 1e-12 * float(np.max(values, initial=1.0))))
    )
