"""Gains of channels, by the modal constants φ_r φ_d that FRFs give beside frequencies and shapes.

However light the damping and wherever a lump stands, a mode answers to its force as its mass says
(Ewins 2000, 2.8). One factor in the constants of all modes is the force channel's, one in all modes
of one sensor is that sensor's: generalised least squares of their logarithms tell it.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.modes.constants import Constants, beside, constants_of
from cvxupdate.diagnose.modes.identified import Identified
from cvxupdate.diagnose.results import Gain
from cvxupdate.diagnose.settings import (
    CHANCE,
    GAIN_STD,
    LEAST_SIZE,
    LUCK,
    MOST_SURE,
    SIZE_STD,
    STATED,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import ModelError
from cvxupdate.recordings.quantiles import chi_square_above
from cvxupdate.residual.modal import ModalPoint

MOST = 3  # gains that are told at once


def gains_of(
    point: ModalPoint, found: Sequence[Identified], others: Sequence[ModalPoint] = ()
) -> tuple[Gain, ...]:
    """Gains that are likelier than not, whichever mode is left out (the constant of a resonance
    narrower than a line is as wrong as leakage makes it), surest first. ``others``: the point with
    one effect as far off as it may be (`as_it_may_be`)."""
    c = constants_of(point, found, others)
    if c is None:
        return ()
    told = _told(c)
    for mode in c.modes if told else ():
        rest = c.without(mode)
        again = {} if rest is None else _told(rest)
        told = {name: min(sure, again[name]) for name, sure in told.items() if name in again}
    if not told:
        return ()
    size, spread = _sizes(c, [c.names.index(name) for name in told])
    return tuple(
        Gain(n[0], n[1:], float(np.exp(s)), float(np.exp(s) * d), min(sure, MOST_SURE))
        for (n, sure), s, d in zip(told.items(), size, spread, strict=True)
    )


def _told(c: Constants) -> dict[tuple[str, ...], float]:
    """Gains with their probabilities: the best of all, then beside it the next. All are as likely
    before as that there is none; a gain has a prior deviation of `GAIN_STD`."""
    told: list[int] = []
    sure: list[float] = []
    for _ in range(MOST):
        size, variance, fall, scale = _trials(c, told)
        odds = 0.5 * fall / scale - 0.5 * np.log(1.0 + GAIN_STD**2 / (scale * variance))
        odds[told] = -np.inf
        best = int(np.argmax(odds))
        nothing = len(odds) * np.exp(-np.clip(odds[best], -500.0, 500.0))
        confidence = 1.0 / float(np.exp(odds - odds[best]).sum() + nothing)
        small = abs(size[best]) < LEAST_SIZE * np.sqrt(scale[best] * variance[best])
        if confidence < STATED or small:
            break
        told.append(best)
        sure.append(confidence)
    return {c.names[k]: s for k, s in zip(told, sure, strict=True)}


def as_it_may_be(last: Fit, known: int) -> list[ModalPoint]:
    """The point of a fit with each parameter beyond the first ``known``, an effect's, off by
    `SIZE_STD` of its size: a mass that is off is off in the constants of all modes."""
    out = []
    for k in range(known, len(last.p)):
        p = last.p.copy()
        p[k] *= 1.0 - SIZE_STD
        with suppress(ModelError):
            out.append(last.setting.evaluate(p, last.point))
    return out


def not_gainsaid(
    gains: Sequence[Gain], point: ModalPoint, held: Sequence[Identified]
) -> tuple[Gain, ...]:
    """Those that FRFs that were ``held`` out do not gainsay: a sensor's has the same size there; a
    force's there, too, or it is that drive's own."""
    if not held:
        return tuple(gains)
    c = constants_of(beside(point, held), held)
    return tuple(gains) if c is None else tuple(g for x in gains for g in _there(x, gains, c))


def _there(gain: Gain, gains: Sequence[Gain], c: Constants) -> list[Gain]:
    """A gain as constants that were held out have it, the others beside it; none where they say
    that there is none."""
    sensors = [("gain", *g.channels) for g in gains if g.how == "gain"]
    own = [j for j, n in enumerate(c.names) if n in sensors or (n[0] == "force" and len(n) == 2)]
    size, spread = _sizes(c, own)
    says = {
        c.names[j]: abs(s - np.log(gain.value)) < abs(s) or abs(np.log(gain.value)) < LEAST_SIZE * d
        for j, s, d in zip(own, size, spread, strict=True)
    }
    if gain.how == "gain":
        return [gain] if says.get(("gain", *gain.channels), True) else []
    drives = [n[1] for n, yes in says.items() if n[0] == "force" and yes]
    return [replace(gain, channels=tuple(dict.fromkeys((*gain.channels, *drives))))]


def _sizes(c: Constants, told: Sequence[int]) -> tuple[Real, Real]:
    """Logarithms of gains fitted together, with deviations, (told,)."""
    X = c.X[:, list(told)]
    inverse = np.linalg.pinv(X.T @ X)
    size = inverse @ X.T @ c.y
    spread = np.sqrt(np.diag(inverse) * _scale(c.y - X @ size, len(told)))
    return np.asarray(size), np.asarray(spread)


def suspect(point: ModalPoint, found: Sequence[Identified]) -> str | None:
    """The sensor whose constants are off by one factor in all modes, so much that chance gives the
    best of all channels as much once in `LUCK`; None where there is none."""
    c = constants_of(point, found)
    if c is None:
        return None
    _, _, fall, scale = _trials(c, [])
    best = int(np.argmax(fall / scale))
    sure = fall[best] / scale[best] > chi_square_above(LUCK / len(fall), 1)
    return c.names[best][1] if sure and c.names[best][0] == "gain" else None


def _trials(c: Constants, told: Sequence[int]) -> tuple[Real, Real, Real, Real]:
    """Of each gain beside those that are ``told``: its logarithm, the variance, the fall of the
    squares, and how many times their usual scatter the constants scatter with it, (gains,)."""
    q, _ = np.linalg.qr(c.X[:, list(told)])
    y, X = c.y - q @ (q.T @ c.y), c.X - q @ (q.T @ c.X)
    power = np.maximum((X**2).sum(axis=0), 1e-12)
    size = X.T @ y / power
    fall = size**2 * power
    scale = np.array([_scale(y - x * s, len(told) + 1) for x, s in zip(X.T, size, strict=True)])
    return size, 1.0 / power, fall, scale


def _scale(rest: Real, taken: int) -> float:
    """Squares left per degree of freedom, 1 where that is chance."""
    free = max(1, len(rest) - taken)
    squares = float(rest @ rest)
    return max(1.0, squares / free) if squares > chi_square_above(1.0 - CHANCE, free) else 1.0
