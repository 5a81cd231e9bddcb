"""Hidden oscillators on tables of modes: what one explains at its best tuning and mass.

It brings a mode that the model does not have and moves its neighbours apart, which no derivative
tells (Den Hartog 1956, 3.2). In the space of the model's own modes one coordinate more is its
mass's motion; as many eigenproblems as there are tunings and masses are solved in one call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.modes.scene import Scene
from cvxupdate.diagnose.settings import OSCILLATOR_MASSES
from cvxupdate.diagnose.types import Real, Score
from cvxupdate.fe.stacked import eigh
from cvxupdate.physics.effect import Effect, HiddenOscillator

MARGIN = 7  # modes above the highest that is used, in which a change can show
FEWEST = 20  # modes of the basis at least
EVERY, FEW = 2, OSCILLATOR_MASSES[1::2]  # of the tunings, and masses, of the first look
PLACES = 24  # looked at closely
STEPS, SPAN = 5, 3.0  # tunings as far as the neighbours of the best, masses as far as this factor
CLOSER = 3  # times that a valley is followed, each time half as wide


@dataclass(frozen=True)
class Tried:
    """An oscillator at a place, at its best tuning (Hz) and mass (kg) of those that were tried."""

    effect: Effect
    action: HiddenOscillator
    left: float
    frequency: float
    mass: float

    @property
    def score(self) -> tuple[Effect, Real]:
        """The effect so tuned, and its mass."""
        action = replace(self.action, frequency=self.frequency)
        return replace(self.effect, action=action), np.array([self.mass])


def tuned(where: Scene, candidates: Sequence[Effect], heavy: float) -> list[Score]:
    """Of each place the best of its tunings, at its best mass (kg, a part of the structure's mass
    ``heavy``), best first and no more than twice `PLACES`: those where the best of a grid lies, and
    those to which valleys lead that are as wide as its steps."""
    own = [(e, a) for e in candidates if isinstance(a := e.action, HiddenOscillator)]
    if not own or where.total <= 0.0:
        return []
    grid = np.unique([a.frequency for _, a in own])
    first = dict((a.row, (e, a)) for e, a in reversed(own))
    apart = float((grid[-1] / grid[0]) ** (EVERY / max(1, len(grid) - 1)))
    masses = heavy * np.array(FEW)
    found: dict[int, Tried] = {}
    for level in (0.0, float(np.log(apart))):
        seen = where.softened(level) if level else where
        tried = [_best(seen, e, a, grid[::EVERY], masses) for e, a in first.values()]
        for t in sorted(tried, key=lambda t: t.left)[:PLACES]:
            best = _followed(where, t, apart, level)
            row = t.action.row
            found[row] = min(found.get(row, best), best, key=lambda t: t.left)
    return [
        Score(effect, max(0.0, 1.0 - t.left / where.total), mass, exact=True)
        for t in sorted(found.values(), key=lambda t: t.left)
        for effect, mass in [t.score]
    ]


def _followed(where: Scene, t: Tried, apart: float, level: float) -> Tried:
    """The best near one that was ``tried`` on tables known to ``level``: tunings and masses, the
    level and how far they go halved each time, to the tables as they are."""
    wide = [level / 2.0**k for k in range(1, CLOSER + 1)] if level else []
    for k, soft in enumerate([*wide, 0.0]):
        far = 0.5**k
        about = np.geomspace(apart**-far, apart**far, STEPS)
        closer = np.geomspace(SPAN**-far, SPAN**far, STEPS)
        seen = where.softened(soft) if soft else where
        t = _best(seen, t.effect, t.action, t.frequency * about, t.mass * closer)
    return t


def _best(
    where: Scene, effect: Effect, action: HiddenOscillator, frequency: Real, mass: Real
) -> Tried:
    f, m = (g.ravel() for g in np.meshgrid(frequency, mass))
    left = remaining(where, action.row, f, m)
    k = int(np.argmin(left))
    return Tried(effect, action, float(left[k]), float(f[k]), float(m[k]))


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
    lam, V = eigh(stiff)
    tails = [np.zeros((n, len(rows), 1)) for _, rows, _, _ in where.shapes]
    at = where.nearest(np.broadcast_to(where.used, (n, len(where.used))), lam, V, tails)
    own = np.take_along_axis(V, at[:, None, :], axis=2)
    return where.left(np.take_along_axis(lam, at, axis=1), where.mixed(own, tails))
