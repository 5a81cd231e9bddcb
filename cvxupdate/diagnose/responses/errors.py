"""Errors of modelled responses, channel by channel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.correlate.frf import frf_error
from cvxupdate.correlate.response_error import FRF, TIME, Stated, pooled, together
from cvxupdate.diagnose.fit import Fit, fitted_at, taken
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.setting import unstrayed
from cvxupdate.diagnose.responses.signals import Real, Signal
from cvxupdate.diagnose.types import Errors


def channel_errors(point: ResponsePoint, signals: Sequence[Signal]) -> float:
    """‖Y − Ŷ‖ / ‖Y‖ of each channel that responds, averaged (0 perfect, 1 as large as the signal),
    of the model at ``point`` on ``signals``; modes keep its damping. NaN without signals."""
    if not signals:
        return float("nan")
    return _error(on_signals(point, signals))


def _error(there: ResponsePoint) -> float:
    signals = there.setting.signals
    gaps = (np.abs(model - s.Y) for s, model in zip(signals, there.modelled(), strict=True))
    return averaged(signals, [norms(gap) for gap in gaps])


def noise_errors(signals: Sequence[Signal]) -> float:
    """The same measure for noise alone: what a perfect model would be left with."""
    return averaged(signals, [norms(s.std) for s in signals])


def on_signals(point: ResponsePoint, signals: Sequence[Signal]) -> ResponsePoint:
    """The point with its model's responses to other signals."""
    return point.setting.on(signals).evaluate(point.p, point)


def likelihood(fit: Fit, signals: Sequence[Signal]) -> float:
    """Logarithm of the likelihood of other signals at a fit, at any level of the model's
    discrepancy (`Fit.log_likelihood`). 0 without signals."""
    if not signals:
        return 0.0
    return fitted_at(fit.setting.on(signals), fit.p, fit.point).log_likelihood


def foretold(point: ResponsePoint) -> list[ResponsePoint]:
    """What a point foretells of another drive: with the damping that was fitted, and with the usual
    one of modes that strayed from it. A mode that hardly answers to the drive that was fitted is
    damped away there for standing a tenth of its width beside its resonance, which says nothing of
    how another drive excites it."""
    usual = unstrayed(point.setting, point.p)
    return [point] if usual is None else [point, point.setting.evaluate(usual, point)]


@dataclass(frozen=True)
class Heard:
    """What the recordings say of a point: `channel_errors` of what was fitted, and of what was held
    out at what is `foretold`, with the logarithm of the ``likelihood`` of that (0 without)."""

    errors: Errors
    likelihood: float


def heard(point: ResponsePoint, fit: Sequence[Signal], hold_out: Sequence[Signal]) -> Heard:
    """Of both at once: what is held out takes a model's responses each."""
    error = channel_errors(point, fit)
    if not hold_out:
        return Heard(Errors(error, float("nan")), 0.0)
    there = [on_signals(x, hold_out) for x in foretold(point)]
    held = min(_error(x) for x in there)
    # at the very points, whose responses are at hand
    fits = [replace(taken(x.setting, x), point=x) for x in there]
    return Heard(Errors(error, held), max(f.log_likelihood for f in fits))


def norms(values: Real) -> Real:
    """Of each channel."""
    return np.asarray(np.sqrt(np.sum(values**2, axis=(0, 2))))


def averaged(signals: Sequence[Signal], gaps: Sequence[Real]) -> float:
    """Norms of gaps as fractions of their channels', the mean of those that respond."""
    errors: list[float] = []
    for signal, gap in zip(signals, gaps, strict=True):
        heard = signal.audible()
        errors += (gap[heard] / norms(np.abs(signal.Y))[heard]).tolist()
    return float(np.mean(errors)) if errors else float("nan")


def stated(point: ResponsePoint, signals: Sequence[Signal]) -> list[Stated]:
    """The contract's error of each signal (`cvxupdate.correlate.response_error`), of the model at
    ``point``."""
    if not signals:
        return []
    modelled = on_signals(point, signals).modelled()
    return [
        Stated(s.use, TIME if np.any(s.s.real) else FRF, frf_error(own, s.Y))
        for s, own in zip(signals, modelled, strict=True)
    ]


@dataclass(frozen=True)
class ContractErrors:
    """The contract's errors of every recording, ``before`` and ``after`` a diagnosis."""

    before: Sequence[Stated]
    after: Sequence[Stated]

    def together(self) -> tuple[Errors, Errors]:
        """Before and after: the r.m.s. over all recordings of a use, whatever their kind."""
        before, after = (
            Errors(together(e, "fit"), together(e, "hold-out")) for e in (self.before, self.after)
        )
        return before, after

    def metrics(self) -> dict[str, dict[str, dict[str, float]]]:
        """{"fit": {metric: {"before": …, "after": …}}, "hold_out": {…}}."""
        before, after = pooled(self.before), pooled(self.after)
        return {
            key: {name: {"before": x, "after": after[key][name]} for name, x in before[key].items()}
            for key in before
        }
