"""Hidden oscillators beside responses: of each place the tunings at which one explains most.

Those of a place differ by their tuning alone, so all are tried at once, at few masses. Between two
trial frequencies a narrow resonance shows little at either: the best places are looked at more
closely there, and places compete by what they explain then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.responses.few import Few, Measure, Tunings
from cvxupdate.diagnose.responses.signals import Real
from cvxupdate.diagnose.settings import OSCILLATOR_MASSES, STARTS
from cvxupdate.diagnose.types import Score
from cvxupdate.physics.effect import HiddenOscillator
from cvxupdate.physics.low_rank import low_rank

PLACES = 24  # looked at more closely
FREQUENCIES, MASSES = 7, 3  # then, between the neighbours of the best


@dataclass(frozen=True)
class Valley:
    """A score at its best of several tunings (Hz, ascending) and masses (kg): ``left`` there,
    ``frequencies`` and ``masses`` of its neighbours, itself between them."""

    score: Score
    left: float
    frequencies: Real
    masses: Real


def tuned(few: Few, rough: Few, scores: Sequence[Score], left: Measure) -> list[Score]:
    """Scores with the hidden oscillators of the places where one explains most (on few lines,
    ``rough``), at their best tunings, and without the others; all, as they are, where no place has
    several."""
    at: dict[int, list[Score]] = {}
    for score in scores:
        if isinstance(score.effect.action, HiddenOscillator):
            at.setdefault(score.effect.action.row, []).append(score)
    if all(len(own) == 1 for own in at.values()):
        return list(scores)
    masses = few.heavy * np.array(OSCILLATOR_MASSES)
    found = sorted(
        (_valleys(rough, own, masses, left) for own in at.values()), key=lambda own: own[0].left
    )
    rest = [s for s in scores if not isinstance(s.effect.action, HiddenOscillator)]
    return [*rest, *(_closer(few, v, left) for own in found[:PLACES] for v in own)]


def _valleys(few: Few, own: Sequence[Score], masses: Real, left: Measure) -> list[Valley]:
    """Of one place the best tunings that are no neighbours of one another, best first."""
    frequencies = np.array([_tuning(s) for s in own])
    remains = _remains(few, own[0], frequencies, masses, left)
    best = remains.min(axis=1)
    walls = np.concatenate([[np.inf], best, [np.inf]])
    lowest = np.flatnonzero((best <= walls[:-2]) & (best < walls[2:]))
    if not len(lowest):
        lowest = np.array([int(np.argmin(best))])
    ranked = sorted(lowest.tolist(), key=lambda k: best[k])[:STARTS]
    return [
        Valley(own[k], float(best[k]), _around(frequencies, k), _around(masses, at))
        for k in ranked
        for at in [int(np.argmin(remains[k]))]
    ]


def _closer(few: Few, valley: Valley, left: Measure) -> Score:
    """At the best tuning between its neighbours, or its own."""
    between = _between(valley.frequencies, FREQUENCIES)
    frequencies = np.append(between, _tuning(valley.score))
    masses = _between(valley.masses, MASSES)
    remains = _remains(few, valley.score, frequencies, masses, left).min(axis=1)
    return _at(valley.score, float(frequencies[int(np.argmin(remains))]))


def _remains(few: Few, score: Score, frequencies: Real, masses: Real, left: Measure) -> Real:
    """What is left (frequencies, masses)."""
    changes = [low_rank(_at(score, float(f)).effect) for f in frequencies]
    along = Tunings(tuple(c for c in changes if c is not None))
    return left.remaining(few.tuned(along, masses)).reshape(len(frequencies), len(masses))


def _at(score: Score, frequency: float) -> Score:
    """The same, tuned to ``frequency`` (Hz)."""
    action = score.effect.action
    if not isinstance(action, HiddenOscillator):
        return score
    return replace(score, effect=replace(score.effect, action=replace(action, frequency=frequency)))


def _tuning(score: Score) -> float:
    action = score.effect.action
    return action.frequency if isinstance(action, HiddenOscillator) else 0.0


def _around(values: Real, k: int) -> Real:
    return values[max(k - 1, 0) : k + 2]


def _between(values: Real, count: int) -> Real:
    """``count`` values, in equal ratios, between the first and the last."""
    return np.geomspace(values[0], values[-1], count + 2)[1:-1] if len(values) > 1 else values
