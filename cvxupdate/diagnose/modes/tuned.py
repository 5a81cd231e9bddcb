"""Hidden oscillators on tables of modes: what one explains at its best tuning and mass.

It brings a mode that the model does not have and moves its neighbours apart, which no derivative
tells (Den Hartog 1956, 3.2). In the space of the model's own modes one coordinate more is its
mass's motion; as many eigenproblems as there are tunings and masses are solved in one call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.scene import Scene
from cvxupdate.diagnose.settings import OSCILLATOR_MASSES
from cvxupdate.diagnose.types import Real, Score
from cvxupdate.physics.effect import Effect, HiddenOscillator

MARGIN = 7  # modes above the highest that is used, in which a change can show
FEWEST = 20  # modes of the basis at least
PLACES = 24  # looked at closely
STEPS = 5  # tunings and masses about the best


def tuned(where: Scene, candidates: Sequence[Effect], heavy: float) -> list[Score]:
    """Of each place the best of its tunings, at its best mass (kg, a part of the structure's mass
    ``heavy``), best first and no more than `PLACES`."""
    own = [(e, a) for e in candidates if isinstance(a := e.action, HiddenOscillator)]
    if not own or where.total <= 0.0:
        return []
    masses = heavy * np.array(OSCILLATOR_MASSES)
    best: dict[int, tuple[float, Effect, float]] = {}
    for effect, action in own:
        left = remaining(where, action.row, np.full(len(masses), action.frequency), masses)
        k = int(np.argmin(left))
        if action.row not in best or left[k] < best[action.row][0]:
            best[action.row] = (float(left[k]), effect, float(masses[k]))
    first = sorted(best.values(), key=lambda t: t[0])[:PLACES]
    closer = [_closer(where, effect, mass, left) for left, effect, mass in first]
    return [
        Score(effect, max(0.0, 1.0 - left / where.total), np.array([mass]), exact=True)
        for left, effect, mass in sorted(closer, key=lambda t: t[0])
    ]


def _closer(where: Scene, effect: Effect, mass: float, left: float) -> tuple[float, Effect, float]:
    """(left, effect, mass) about a tuning and a mass, halfway to their neighbours."""
    action = effect.action
    if not isinstance(action, HiddenOscillator):
        return left, effect, mass
    f, m = np.meshgrid(
        action.frequency * np.geomspace(0.9, 1.1, STEPS), mass * np.geomspace(0.55, 1.8, STEPS)
    )
    found = remaining(where, action.row, f.ravel(), m.ravel())
    k = int(np.argmin(found))
    if not found[k] < left:
        return left, effect, mass
    return (
        float(found[k]),
        replace(effect, action=replace(action, frequency=float(f.flat[k]))),
        float(m.flat[k]),
    )


def remaining(where: Scene, row: int, frequency: Real, mass: Real) -> Real:
    """Squared residuals (n,) that oscillators of n tunings (Hz) and masses (kg) at a DOF leave."""
    enough = max(where.many.rigid + FEWEST, int(where.used.max(initial=0)) + MARGIN)
    q = min(enough, where.many.shapes.shape[1])
    phi, n = where.many.shapes[row, :q], len(mass)
    k = mass * (2.0 * np.pi * frequency) ** 2
    stiff = np.zeros((n, q + 1, q + 1))
    stiff[:, :q, :q] = k[:, None, None] * np.outer(phi, phi)
    stiff[:, np.arange(q), np.arange(q)] += where.many.eigenvalues[:q]
    stiff[:, :q, q] = stiff[:, q, :q] = -(k / np.sqrt(mass))[:, None] * phi
    stiff[:, q, q] = k / mass
    lam, V = np.linalg.eigh(stiff)
    tails = [np.zeros((n, len(rows), 1)) for _, rows, _, _ in where.shapes]
    at = where.nearest(np.broadcast_to(where.used, (n, len(where.used))), lam, V, tails)
    own = np.take_along_axis(V, at[:, None, :], axis=2)
    return where.left(np.take_along_axis(lam, at, axis=1), where.mixed(own, tails))
