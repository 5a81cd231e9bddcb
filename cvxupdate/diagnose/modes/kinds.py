"""Each kind of figures of a table by itself: a few frequencies that are off are drowned by a
hundred entries of shapes, of whose deviations most is what a sound model may miss.

What a fit leaves of one kind is, of a sound model, no larger than chi-square with as many degrees
of freedom as there are figures of it: what is left is a projection of what all figures scatter by,
and no part of that is longer than chance makes as many figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.settings import CHANCE
from cvxupdate.physics.place import listed
from cvxupdate.recordings.quantiles import chi_square_above
from cvxupdate.residual.modal import ModalPoint


def chi_square(level: float, freedoms: int) -> float:
    """What chi-square with so many degrees of freedom does not exceed with probability
    ``level``."""
    return chi_square_above(1.0 - level, freedoms)


def chance_of_one(kinds: int) -> float:
    """The level at which each of so many kinds is tested: they share one rate of false alarms
    (Bonferroni)."""
    return 1.0 - (1.0 - CHANCE) / kinds


@dataclass(frozen=True)
class Kind:
    """Figures of one kind: how many, the weighted squares that a fit leaves of them, and the most
    that chance leaves."""

    name: str
    count: int
    squares: float
    most: float

    @property
    def departs(self) -> bool:
        """Whether that is more than chance."""
        return self.squares > self.most

    @property
    def says(self) -> str:
        """How far off they are, in words."""
        times = np.sqrt(self.squares / max(1, self.count))
        return f"the {self.count} {self.name} ({times:.2g} times their tolerance, r.m.s.)"


def kinds_of(points: Sequence[ModalPoint], kinds: int) -> tuple[Kind, ...]:
    """Frequencies and entries of shapes of the tables to fit, of all points together; ``kinds``:
    how many are tested, damping ratios among them."""
    eigen, shapes = [], []
    for point in points:
        values, weights, _ = point.differences
        squares = (weights * values) ** 2
        first = len(point.paired)
        eigen.append(squares[:first])
        shapes.append(squares[first:])
    level = chance_of_one(kinds)
    return tuple(
        Kind(name, len(own), float(own.sum()), chi_square(level, len(own)))
        for name, own in (
            ("natural frequencies", np.concatenate(eigen)),
            ("entries of mode shapes", np.concatenate(shapes)),
        )
        if len(own)
    )


def bulk(found: Fit) -> float:
    """The misfit; of a table of modes without the one that is farthest off, its frequency and its
    shape."""
    point = found.point
    if not isinstance(point, ModalPoint):
        return found.misfit
    values, weights, _ = point.differences
    squares = np.abs(weights * values) ** 2
    own = [
        (k, i)
        for k in range(len(point.residual.fit))
        for i in np.flatnonzero(point.places[k] >= 0).tolist()
    ]
    for k, i, _, sensors, _, _ in point.shape_rows() if point.residual.shapes else ():
        own += [(k, i)] * len(sensors)
    by: dict[tuple[int, int], float] = {}
    for mode, square in zip(own, squares.tolist(), strict=True):
        by[mode] = by.get(mode, 0.0) + square
    return (found.cost - max(by.values(), default=0.0)) / max(1, found.rows)


def departing(points: Sequence[ModalPoint], kinds: int) -> tuple[Kind, ...]:
    """The kinds that are left by more than chance."""
    return tuple(k for k in kinds_of(points, kinds) if k.departs)


def whole_within(found: Fit) -> bool:
    """Whether all figures together, and the priors, are within chance."""
    return bool(found.cost <= chi_square(CHANCE, found.rows))


def departs(found: Fit, points: Sequence[ModalPoint], kinds: int) -> str:
    """Which kinds are off, in words, where the whole hides it; empty where nothing is, or all."""
    return listed([k.says for k in departing(points, kinds)]) if whole_within(found) else ""
