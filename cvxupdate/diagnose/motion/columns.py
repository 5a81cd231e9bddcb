"""How much of what a model leaves the internal forces of the non-linear effects explain, place by
place: columns along the smoothed motion, linear in their coefficients.

First the places: whatever the law, a force at one place and in one direction reaches the sensors
through that place's receptances, so on every line the residual has rank one.
Then the laws at the places that are left: of gaps and slip distances a grid, refined
where it explains most, the motion smoothed again with the law's own force as its mean.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.fit import Fit, fitted_at
from cvxupdate.diagnose.motion.point import MotionPoint
from cvxupdate.diagnose.motion.scene import Scene
from cvxupdate.diagnose.motion.smoother import Smoother
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.settings import EACH_SIZED, LOCATED, MOST_PLACES
from cvxupdate.diagnose.types import Key, Score
from cvxupdate.forces import (
    contact_columns,
    cubic_column,
    even_column,
    friction_column,
    jenkins_columns,
    quadratic_column,
)
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.internal_force import NonlinearForce, direction

GRID = np.geomspace(0.02, 0.85, 9)  # of the largest motion: gaps and slip distances
# times the best of the grid, and how often the motion is smoothed anew there
CLOSER = (((0.7, 0.84, 1.19, 1.4), 1), ((1.0,), 3), ((0.92, 1.08), 2))
SMOOTHED = 3  # how often the motion is smoothed anew with the law's force
SMOOTH = (0.003, 0.02)  # of the largest velocity: width of the sign of friction
BLIND = 4  # times as many places where none can be told by rank: one sensor has few rows
KEPT = 0.3  # of the best law at any place: laws that explain less are not refined
CLOSER_EACH = 2 * EACH_SIZED  # of each effect type: twice as many as are refitted
LARGEST = 99.9  # per cent of the samples are below what counts as the largest motion

Column = Callable[[Real, Real], Real]
Motions = Sequence[tuple[Real, Real]]


def law_scores(point: MotionPoint, effects: Sequence[Effect]) -> tuple[list[Score], float]:
    """Scores of the effects that are internal forces, in their order, and the squares of the
    projected residual, of which they are parts. Where some place is far better than others, only
    laws there are tried."""
    scene = Scene.of(point)
    actions = [e.action for e in effects]
    model = point.setting.model
    rows = [a.rows if isinstance(a, NonlinearForce) else () for a in actions]
    places = list(dict.fromkeys(r for r in rows if r))
    if not places:
        return [nothing(e) for e in effects], scene.left.total
    B = np.stack([direction(model, r) for r in places], axis=1)
    shapes = point.modes.shapes.T @ B
    left = scene.left_by_force(shapes)
    tried = _promising(left)
    out = [nothing(e) for e in effects]
    found: dict[int, tuple[Spot, Fitted]] = {}
    for k in tried:
        reach = [H[:, :, 0] for H in scene.reaches(shapes[:, k : k + 1])]
        smoothers = [b.smoother(shapes[:, k]) for b in scene.beyond]
        spot = Spot(scene, reach, smoothers, tuple(s.run.name for s in smoothers))
        motion = [s.motion() for s in smoothers]
        found |= {
            i: (spot, spot.coarse(effects[i].action, motion))
            for i, r in enumerate(rows)
            if r == places[k]
        }
    refined = _worth_it({i: (effects[i], f.fraction) for i, (_, f) in found.items()})
    for i, (spot, fit) in found.items():
        out[i] = spot.score(effects[i], fit, i in refined)
    return out, scene.left.total


def _worth_it(found: Mapping[int, tuple[Effect, float]]) -> set[int]:
    """Of laws with what they explain along the first motion, those that a finer grid may bring to
    the short list."""
    least = KEPT * max((fraction for _, fraction in found.values()), default=0.0)
    order = sorted(found, key=lambda i: -found[i][1])
    out: dict[str, list[int]] = {}
    for i in order:
        effect, fraction = found[i]
        own = out.setdefault(effect.physics, [])
        if fraction >= least and len(own) < CLOSER_EACH:
            own.append(i)
    return {i for own in out.values() for i in own}


def nothing(effect: Effect) -> Score:
    """Of a law that was not tried there."""
    return Score(effect, 0.0, np.zeros(effect.count), trusted=False)


def _promising(left: Real) -> list[int]:
    if not np.all(np.isfinite(left)):  # one sensor: any force anywhere would do, the laws tell
        return list(range(min(len(left), BLIND * MOST_PLACES)))
    order = np.argsort(left, kind="stable")
    least = left[order[0]]
    return [int(k) for k in order[:MOST_PLACES] if left[k] <= LOCATED * least or k in order[:2]]


@dataclass(frozen=True)
class Fitted:
    """A law at a place: explained ``fraction``, its ``coefficient``, the shape ``size`` (gap or
    slip distance, 0 where it has none)."""

    fraction: float
    coefficient: float
    size: float


@dataclass(frozen=True)
class Spot:
    """A place in a scene: receptances to the rows of every signal, smoothers of every run."""

    scene: Scene
    reach: Sequence[Complex]
    smoothers: Sequence[Smoother]
    names: tuple[str, ...]

    @cached_property
    def beside_linear(self) -> Projection:
        """What is left of the residual beside a spring and a dashpot here; of all laws the same."""
        motion = [np.stack(s.motion(), axis=1) for s in self.smoothers]
        return self.scene.left.beside(self.columns(motion))

    def columns(self, forces: Sequence[Real]) -> Real:
        """Weighted changes (rows, laws) of the rows by internal forces (fine samples, laws) of
        every run."""
        by_name = dict(zip(self.names, forces, strict=True))
        parts = []
        for s, H in zip(self.scene.point.setting.signals, self.reach, strict=True):
            run = self.scene.point.setting.runs[s.name]
            spectra = run.decaying(by_name[s.name], s.s)
            values = (-H[:, :, None] * spectra[:, None, :]).reshape(-1, spectra.shape[1])
            parts += [values.real, values.imag]
        return np.concatenate(parts)

    def fits(
        self, law: Column, sizes: Real, motion: Motions, left: Projection | None = None
    ) -> list[Fitted]:
        """The best coefficient along a motion, of every size, of what is ``left`` (None: of the
        scene's residual)."""
        left = left or self.scene.left
        forces = [law(x, v) for x, v in motion]
        if left.total <= 0.0 or not any(np.any(f) for f in forces):
            return [Fitted(0.0, 0.0, float(g)) for g in sizes]
        along, length = left.products(self.columns(forces))
        length = np.where(length > 0.0, length, np.inf)
        return [
            Fitted(float(a**2 / n / self.scene.left.total), float(a / n), float(g))
            for a, n, g in zip(along, length, sizes, strict=True)
        ]

    def repeated(self, law: Column, size: float, motion: Motions, rounds: int) -> Fitted:
        """The motion smoothed anew with the law's own force, several times; the best."""
        sizes = np.array([size])
        (best,) = self.fits(law, sizes, motion)
        now = best
        for _ in range(rounds):
            if now.coefficient == 0.0:
                break
            motion = [
                s.settled(now.coefficient * law(x, v)[:, 0], x, v)
                for s, (x, v) in zip(self.smoothers, motion, strict=True)
            ]
            (now,) = self.fits(law, sizes, motion)
            best = max(best, now, key=lambda f: f.fraction)
        return best

    def score(self, effect: Effect, found: Fitted, refine: bool) -> Score:
        """Of an effect at this place, from what a coarse grid found."""
        action = effect.action
        p = np.zeros(effect.count)
        if isinstance(action, NonlinearForce) and found.fraction > 0.0:
            found = self.refined(action, found) if refine else found
            p = _unknowns(action, found)
        return Score(effect, found.fraction, p, exact=True, trusted=bool(np.all(p)))

    def coarse(self, action: object, motion: Motions) -> Fitted:
        """The best of a grid, with the sign that physics demands; where a model that is bent to the
        mean of what a law does leaves it none, beside a spring and a dashpot that take that back
        (statistical linearisation)."""
        nothing = Fitted(0.0, 0.0, 0.0)
        if not isinstance(action, NonlinearForce):
            return nothing
        family, sizes = _family(action, motion)
        if not len(sizes):
            return nothing
        tried = self.fits(family(sizes), sizes, motion)
        best = max((_signed(action, f) for f in tried), key=lambda f: f.fraction)
        if best.fraction > 0.0:
            return best
        tried = self.fits(family(sizes), sizes, motion, self.beside_linear)
        return max((_signed(action, f) for f in tried), key=lambda f: f.fraction)

    def refined(self, action: NonlinearForce, found: Fitted) -> Fitted:
        """On a finer grid around, the motion smoothed anew with the law's force."""
        motion = [s.motion() for s in self.smoothers]
        family, _ = _family(action, motion)
        shaped = action.law in ("clearance", "jenkins")
        for factors, rounds in CLOSER if shaped else (((1.0,), SMOOTHED),):
            tried = [
                _signed(action, self.repeated(family(np.array([g])), g, motion, rounds))
                for g in (found.size * f for f in factors)
            ]
            found = max(found, *tried, key=lambda f: f.fraction)
        return found


def _signed(action: NonlinearForce, f: Fitted) -> Fitted:
    return f if f.coefficient > 0.0 or not action.positive[0] else replace(f, fraction=0.0)


def _family(action: NonlinearForce, motion: Motions) -> tuple[Callable[[Real], Column], Real]:
    """Laws (fine samples, sizes) by their shapes' sizes, and the sizes to try."""
    far = max(float(np.percentile(np.abs(x), LARGEST)) for x, _ in motion)
    fast = max(float(np.percentile(np.abs(v), LARGEST)) for _, v in motion)
    both = action.sides == "two"

    def law(sizes: Real) -> Column:
        match action.law:
            case "cubic":
                return lambda x, v: (even_column if "even" in action.names else cubic_column)(x)
            case "quadratic":
                return lambda x, v: quadratic_column(v)
            case "friction":
                return lambda x, v: np.hstack([friction_column(v, g) for g in sizes])
            case "clearance":
                return lambda x, v: contact_columns(x, sizes * action.side, both)
        return lambda x, v: jenkins_columns(x[:, None], sizes)[:, 0]

    if far <= 0.0 or fast <= 0.0:
        return law, np.zeros(0)
    sizes = {"cubic": np.ones(1), "quadratic": np.ones(1), "friction": fast * np.array(SMOOTH)}
    return law, sizes.get(action.law, far * GRID)


def _unknowns(action: NonlinearForce, found: Fitted) -> Real:
    """In the order of the action's names, SI."""
    if action.law == "clearance":
        return np.array([found.coefficient, found.size * action.side])
    if action.law == "jenkins":
        return np.array([found.coefficient / found.size, found.coefficient])
    return np.array([found.coefficient])


def is_law(effect: Effect) -> bool:
    """Whether an effect is an internal force."""
    return isinstance(effect.action, NonlinearForce)


@dataclass(frozen=True)
class LawScores:
    """Scores of laws at the points of fits, each worked out once, and the squares of the projected
    residual there."""

    known: dict[bytes, tuple[dict[Key, Score], float]] = field(default_factory=dict)

    def of(self, found: Fit, effects: Sequence[Effect]) -> dict[Key, Score]:
        """At a fit against sharp signals."""
        return self._at(found, effects)[0]

    def _at(self, found: Fit, effects: Sequence[Effect]) -> tuple[dict[Key, Score], float]:
        key = found.p.tobytes() + ",".join(found.setting.columns).encode()
        if key not in self.known and effects:
            scores, total = law_scores(found.point, effects)
            self.known[key] = ({s.effect.key: s for s in scores}, total)
        return self.known.get(key, ({}, 0.0))

    def first(self, found: Fit, laws: Sequence[Effect]) -> dict[Key, Score]:
        """Beside no other law: where the best of them leaves less at the nominal model, its own are
        taken, from which finite sizes begin. What it leaves counts and not its part: far from where
        the nuisance parameters belong, most of the residual is theirs, and some law resembles
        it."""
        nominal = fitted_at(found.setting, np.zeros(len(found.p)))
        both = [self._at(f, laws) for f in (nominal, found)]
        left = [
            total * (1.0 - max((s.fraction for s in own.values()), default=0.0))
            for own, total in both
        ]
        if left[0] <= left[1]:
            return {k: replace(s, trusted=False) for k, s in both[0][0].items()}
        return both[1][0]
