"""How the points of an edge between two nodes follow them, and the coordinates that an edge has
besides.

A beam or the edge of a sheet from node a to b, s = t L along the unit vector e: transverse
displacements follow Hermite's cubic of the ends' displacements and rotations, the rotations across
are its slopes; stretch and twist are linear. Each further coordinate vanishes at both ends, so
rigid motions are those of the nodes (hierarchical shapes: Szabó and Babuška 1991, ch. 6).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from cvxupdate.fe.elements.base import Real

# what an edge may do besides following its ends, by kind: functions of t for the displacement along
# a direction and for the rotation that belongs to it
BEND, TWIST, STRETCH, SHEAR = 3, 3, 2, 3
SLOPE = 2  # of an edge that is held straight: how it may turn at its ends where it gives way
ALONE = 5  # of a line, beside which no sheet helps: two waves of bending in one element


@dataclass(frozen=True)
class Edge:
    """From node ``a`` at ``start`` to the higher-numbered ``b`` at ``end``; ``turns``: rotations of
    its ends bend it; ``rim``: it is one of a sheet; ``line``: it is an element itself;
    ``ruled``: it is held straight along its length, without being clamped; ``clamped``: it can
    not turn about itself either."""

    a: int
    b: int
    start: Real
    end: Real
    turns: bool
    rim: bool = False
    ruled: bool = False
    line: bool = False
    clamped: bool = False

    @cached_property
    def axes(self) -> tuple[Real, Real, Real, float]:
        """Unit vector along it, two across (the second as upright as can be), and its length."""
        along = self.end - self.start
        length = float(np.linalg.norm(along))
        e = along / length
        upright = np.array([0.0, 0.0, 1.0]) if abs(e[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
        second = upright - (upright @ e) * e
        second /= np.linalg.norm(second)
        return e, _cross(second) @ e, second, length

    @cached_property
    def names(self) -> list[tuple[str, Real]]:
        """(kind and number, direction) of its further coordinates."""
        e, one, two, _ = self.axes
        stretch = [(f"stretch{k}", e) for k in range(STRETCH)]
        if not self.turns:
            return stretch
        across = [
            (f"{word}{k}", d)
            for word, many in (
                ("bend", ALONE if self.line else BEND),
                ("shear", SHEAR),
                ("slope", 0 if self.line else SLOPE),
            )
            for k in range(many)
            for d in (one, two)
        ]
        return [*stretch, *((f"twist{k}", e) for k in range(TWIST)), *across]

    def followed(self, t: float) -> Real:
        """(6, 12): displacement and rotation at t by those of a, then b."""
        e, _, _, length = self.axes
        along = np.outer(e, e)
        across = np.eye(3) - along
        out = np.zeros((6, 12))
        out[:3, :3], out[:3, 6:9] = (1.0 - t) * np.eye(3), t * np.eye(3)
        if not self.turns:
            return out
        cross = _cross(e)  # d -> e x d; a rotation r moves the points ahead by r x e = -e x r
        slope = np.array([-1.0, 1.0]) / length  # of a straight line
        if not self.ruled:
            w, slope = _hermite(t, length)
            out[:3, :3], out[:3, 6:9] = (
                (1.0 - t) * along + w[0] * across,
                t * along + w[2] * across,
            )
            out[:3, 3:6], out[:3, 9:] = -w[1] * cross, -w[3] * cross
            # rotation across = e x du/ds
            out[3:, 3:6] = -slope[1] * cross @ cross
            out[3:, 9:] = -slope[3] * cross @ cross
            slope = slope[[0, 2]]
        out[3:, :3], out[3:, 6:9] = slope[0] * cross, slope[1] * cross
        out[3:, 3:6] += (1.0 - t) * along
        out[3:, 9:] += t * along
        return out

    def further(self, t: float) -> Real:
        """(6, coordinates): the same by a unit of each of `names`."""
        e, _, _, length = self.axes
        turn, out = _cross(e), np.zeros((6, len(self.names)))
        for j, (name, d) in enumerate(self.names):
            word, k = name[:-1], int(name[-1])
            if word == "stretch":
                out[:3, j] = _bubble(t, k) * d
            elif word == "twist":
                out[3:, j] = _bubble(t, k) * d / length
            elif word == "bend":
                w, slope = _flat(t, k)
                out[:3, j], out[3:, j] = w * d, slope / length * (turn @ d)
            elif word == "slope":  # elsewhere ends' rotations do
                w, slope = _bent(t, k) if self.ruled else (0.0, 0.0)
                out[:3, j], out[3:, j] = w * d, slope / length * (turn @ d)
            elif k == 0:  # constant shear along a beam: what its ends' rotations lack
                w = t - t**2 * (3.0 - 2.0 * t)
                out[:3, j], out[3:, j] = w * d, -6.0 * t * (1.0 - t) / length * (turn @ d)
            else:
                out[:3, j] = _bubble(t, k - 1) * d
        return out


def _cross(e: Real) -> Real:
    """The matrix of e × ."""
    return np.array([[0.0, -e[2], e[1]], [e[2], 0.0, -e[0]], [-e[1], e[0], 0.0]])


def _hermite(t: float, length: float) -> tuple[Real, Real]:
    """Cubic shapes of (w, slope) at both ends, and their derivatives along the edge."""
    w = [
        1.0 - 3.0 * t**2 + 2.0 * t**3,
        (t - 2.0 * t**2 + t**3) * length,
        3.0 * t**2 - 2.0 * t**3,
        (t**3 - t**2) * length,
    ]
    slope = [
        (6.0 * t**2 - 6.0 * t) / length,
        1.0 - 4.0 * t + 3.0 * t**2,
        (6.0 * t - 6.0 * t**2) / length,
        3.0 * t**2 - 2.0 * t,
    ]
    return np.array(w), np.array(slope)


@cache  # of few points, the same ones on every edge
def _bubble(t: float, k: int) -> float:
    """t (1 − t) times a Legendre polynomial."""
    return float(
        4.0 * t * (1.0 - t) * np.polynomial.legendre.legval(2.0 * t - 1.0, np.eye(k + 1)[k])
    )


@cache
def _bent(t: float, k: int) -> tuple[float, float]:
    """t (1 − t) times a Legendre polynomial, and its derivative."""
    x = 2.0 * t - 1.0
    one = np.polynomial.legendre.Legendre.basis(k)
    rate = 4.0 * (1.0 - 2.0 * t) * one(x) + 8.0 * t * (1.0 - t) * one.deriv()(x)
    return _bubble(t, k), float(rate)


@cache
def _flat(t: float, k: int) -> tuple[float, float]:
    """t² (1 − t)² times a Legendre polynomial, and its derivative."""
    x = 2.0 * t - 1.0
    one = np.polynomial.legendre.Legendre.basis(k)
    flat, rate = 16.0 * (t * (1.0 - t)) ** 2, 32.0 * t * (1.0 - t) * (1.0 - 2.0 * t)
    return float(flat * one(x)), float(rate * one(x) + flat * 2.0 * one.deriv()(x))
