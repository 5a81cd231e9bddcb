"""Branches of periodic responses over frequency, around their folds: continuation by arc length
(Seydel 2010, chapter 4; Krack and Gross 2019, section 4.5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cvxupdate.errors import ConvergenceError, InputError
from cvxupdate.forces.laws import Real
from cvxupdate.simulate.periodic import (
    CLOSE,
    HARMONICS,
    Equations,
    Periodic,
    coefficients,
    equations,
    harmonic_balance,
)
from cvxupdate.simulate.system import System

MOST_POINTS = 2000
FEW, MANY = 4, 8
"""Iterations below which the next step is longer, and at which the step is given up as too long."""
FINEST = 1e-6
"""Of the first step: shorter ones say that the branch is lost."""


def follow(
    system: System,
    force: ArrayLike,
    begin: float,
    end: float,
    harmonics: int = HARMONICS,
    points: int = 100,
    samples: int | None = None,
) -> tuple[Periodic, ...]:
    """The branch of periodic responses from ``begin`` to ``end`` (Hz), in order along it: about
    ``points`` of them where it runs straight, more where it bends.

    Raises
    ------
    InputError
        Frequencies that are not above 0, or equal.
    ConvergenceError
        The branch is lost.
    """
    if not (begin > 0.0 and end > 0.0 and begin != end):
        raise InputError("follow: give two different frequencies above 0 Hz.")
    eq = equations(system, force, harmonics, samples)
    first = harmonic_balance(eq.system, eq.push, begin, harmonics, samples=eq.samples)
    turn = 2.0 * np.pi
    y = np.append(coefficients(first), turn * begin)
    return _walk(eq, y, turn * end, turn * abs(end - begin) / points, first)


def _walk(eq: Equations, y: Real, end: float, step: float, first: Periodic) -> tuple[Periodic, ...]:
    """Points from y = (X, Ω) on; lengths are relative to the size of X and the step in Ω."""
    way = np.sign(end - y[-1])
    direction = np.append(np.zeros(len(y) - 1), way)
    found, length, longest = [first], 1.0, 2.0
    while len(found) < MOST_POINTS:
        scale = np.append(np.full(len(y) - 1, max(np.abs(y[:-1]).max(), 1e-300) / 4.0), step)
        tangent = _tangent(eq, y, direction, scale)
        new, turns = _correct(eq, y, tangent, scale, length)
        if new is None:
            length /= 2.0
            if length < FINEST:
                raise ConvergenceError(
                    f"the branch of periodic responses is lost at {y[-1] / (2 * np.pi):.6g} Hz. "
                    "Take more harmonics or samples."
                )
            continue
        direction, y = new - y, new
        if way * (y[-1] - end) > 0.0:
            last = harmonic_balance(
                eq.system,
                eq.push,
                end / (2.0 * np.pi),
                eq.harmonics,
                eq.response(y[:-1], float(y[-1])),
                eq.samples,
            )
            return (*found, last)
        found.append(eq.response(y[:-1], float(y[-1])))
        length = min(longest, length * (1.5 if turns <= FEW else 1.0))
    raise ConvergenceError(f"the branch has more than {MOST_POINTS} points before it ends.")


def _tangent(eq: Equations, y: Real, direction: Real, scale: Real) -> Real:
    """The scaled unit tangent that goes on in ``direction``."""
    _, J, slope = eq.residual(y[:-1], float(y[-1]))
    wide = np.column_stack([J, slope]) * scale
    row = direction / scale
    t = np.linalg.solve(np.vstack([wide, row / np.linalg.norm(row)]), np.eye(len(y))[-1])
    return np.asarray(t / np.linalg.norm(t))


def _correct(
    eq: Equations, y: Real, tangent: Real, scale: Real, length: float
) -> tuple[Real | None, int]:
    """A point at the distance ``length`` along the tangent, by Newton's method square to it."""
    new = y + scale * tangent * length
    for turn in range(1, MANY + 1):
        R, J, slope = eq.residual(new[:-1], float(new[-1]))
        wide = np.vstack([np.column_stack([J, slope]) * scale, tangent])
        gone = float(tangent @ ((new - y) / scale)) - length
        move = np.linalg.solve(wide, np.append(R, gone))
        new = new - scale * move
        if not np.all(np.isfinite(new)) or new[-1] <= 0.0:
            return None, turn
        if np.abs(move).max() <= 1e3 * CLOSE:
            return new, turn
    return None, MANY
