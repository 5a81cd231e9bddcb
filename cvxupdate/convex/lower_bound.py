"""How far a point may be from the global minimum of bilinear least squares: convex lower bounds,
over smaller and smaller boxes where one is not enough (branch and bound, Land and Doig 1960)."""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..system import Array
from .moments import Bounded, Moments, Term

LARGEST = 40  # order of a moment matrix: (1 + parameters)(1 + unknowns of a mode); time ∝ order⁶
BOXES = 200  # semidefinite programs at most
SECONDS = 20.0  # of computing in this thread after which no further box is begun
CLOSE = 1e-3
"""Relative gap at which a point is called globally optimal: no model is better for less."""
NOTHING = 1e-6
"""A gap in χ², the sum of squared deviations, that is none: exact recordings leave an objective of
rounding alone."""
CORNER = 0.2  # of a box's side, the least that either part keeps


@dataclass(frozen=True, eq=False)
class GlobalBound:
    """``lower``: no admissible point has an objective below it; ``best`` the lowest one known, at
    ``p`` (n,); ``boxes`` that were looked into."""

    lower: float
    best: float
    p: Array
    boxes: int

    @property
    def gap(self) -> float:
        """best − lower, not negative."""
        return max(self.best - self.lower, 0.0)

    @property
    def relative(self) -> float:
        """The gap relative to the best objective."""
        return self.gap / self.best if self.best > 0.0 else 0.0

    @property
    def optimal(self) -> bool:
        """Whether the point is globally optimal within `CLOSE`."""
        return self.gap <= allowed(self.best)


def allowed(best: float) -> float:
    """The gap within which a point with the objective ``best`` is called globally optimal."""
    return max(CLOSE * best, NOTHING)


def too_large(parameters: int, unknowns: Sequence[int]) -> int | None:
    """The order of the largest moment matrix for terms of so many ``unknowns``, where it is beyond
    `LARGEST`."""
    order = (1 + parameters) * (1 + max(unknowns, default=0))
    return order if order > LARGEST else None


def global_bound(
    terms: Sequence[Term],
    lower: Array,
    upper: Array,
    p: Array,
    value: Callable[[Array], float],
    boxes: int = BOXES,
) -> GlobalBound:
    """The bound over the box lower ≤ x ≤ upper (n,), ``value`` (x) being the true objective, its
    unknowns u eliminated; begun with the point ``p`` (n,) at hand.

    Boxes are split where the moments of their relaxation spread most, those of the lowest bound
    first, until the gap is closed, ``boxes`` programs were solved, or `SECONDS` are over.
    """
    end = time.thread_time() + SECONDS
    program = Moments(tuple(terms), len(lower))
    width = np.where(upper > lower, upper - lower, 1.0)
    best, where, done, number = value(p), p, 0, 0
    proved = np.inf  # of boxes that are settled
    found = program.bound(lower, upper, best)
    queue: list[tuple[float, int, Array, Array, Bounded]] = [(found.lower, 0, lower, upper, found)]
    done = 1
    while queue:
        bound, _, a, b, found = queue[0]
        other = value(found.mean)
        if other < best:
            best, where = other, found.mean
        if (
            best - min(bound, proved) <= allowed(best)
            or done + 2 > boxes
            or time.thread_time() > end
        ):
            break
        heapq.heappop(queue)
        axis = int(np.argmax(found.spread / width**2 + 1e-12 * ((b - a) / width) ** 2))
        side = b[axis] - a[axis]
        cut = np.clip(found.mean[axis], a[axis] + CORNER * side, b[axis] - CORNER * side)
        for low, high in ((a[axis], cut), (cut, b[axis])):
            first, last = a.copy(), b.copy()
            first[axis], last[axis] = low, high
            part = program.bound(first, last, best)
            done, number = done + 1, number + 1
            least = max(part.lower, bound)  # a part is never below the whole
            if best - least <= allowed(best):
                proved = min(proved, least)
            else:
                heapq.heappush(queue, (least, number, first, last, part))
    lowest = min([proved, *(item[0] for item in queue)])
    return GlobalBound(float(min(lowest, best)), float(best), where, done)
