"""What a model that was brought to its reference state still misses of it: each mode's frequency,
and what is left of the responses. Both are taken as common to the state that is looked into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.responses.errors import channel_errors, on_signals
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.diagnose.responses.signals import Real, Signal
from cvxupdate.diagnose.settings import MET
from cvxupdate.diagnose.types import Errors, Evidence
from cvxupdate.fe.modes import Modes

AROUND = 0.1  # of the frequency: lines to either side over which what is left is averaged


@dataclass(frozen=True)
class Missed:
    """Of one recording of the reference: frequencies (lines,) Hz, and what the model misses there,
    as a fraction of the response around (lines, sensors, cases)."""

    frequency: Real
    sensors: tuple[str, ...]
    inputs: tuple[str, ...]
    order: int
    fraction: Real

    def of(self, signal: Signal) -> Real | None:
        """At the lines of a signal (like its Y); None where the recording is of other channels."""
        if (self.inputs, self.order) != (signal.inputs, signal.order):
            return None
        if self.fraction.shape[2] != signal.Y.shape[2] or not set(signal.sensors) <= {
            *self.sensors
        }:
            return None
        own = self.fraction[:, [self.sensors.index(label) for label in signal.sensors]]
        return _at(signal, self.frequency, own)


@dataclass(frozen=True)
class Common:
    """``shift``: measured over modelled frequencies of the modes of the model as it was brought to
    the reference; ``missed`` of every recording of it; ``floor``: the errors that are left there,
    beyond which nothing can be told."""

    shift: MeshError
    missed: tuple[Missed, ...]
    floor: Errors

    def least(self, noise: Errors) -> Errors:
        """Below which errors of the other state say nothing: ``noise`` alone, or what is left of
        the reference."""
        floor = self.floor
        held = floor.fit if np.isnan(floor.hold_out) else floor.hold_out
        return Errors(
            max(noise.fit, MET * floor.fit),
            noise.hold_out if np.isnan(noise.hold_out) else max(noise.hold_out, MET * held),
        )

    def weighed(self, signal: Signal) -> Signal:
        """A signal of the other state, with what the model misses of it; of channels that the
        reference does not have, as of all."""
        own = next((v for m in self.missed if (v := m.of(signal)) is not None), None)
        if own is None:
            whole = [_r_m_s(m.fraction, (1, 2)) for m in self.missed]
            at = [_at(signal, m.frequency, w) for m, w in zip(self.missed, whole, strict=True)]
            own = np.broadcast_to(_r_m_s(np.array(at), (0,))[0], signal.Y.shape)
        return replace(signal, missed=own)


def common_of(evidence: Evidence, sharp: Sequence[Signal], held: Sequence[Signal]) -> Common:
    """Of the evidence of the reference state for a model that was brought to it: fitted with a
    frequency by itself for every mode; ``sharp`` and ``held`` its signals, fitted and not."""
    setting = replace(evidence.setting(evidence.model, ()), tuned=True)
    found = fitted(setting, np.zeros(len(setting.columns)), EFFORTS["base"])
    for level in range(1, evidence.levels):
        found = fitted(evidence.at_level(found.setting, level), found.p, EFFORTS["base"])
    point: ResponsePoint = found.point
    start = replace(setting, mesh=NONE).evaluate(np.zeros(len(setting.columns)))
    at = start.owner
    own = Modes(start.modes.eigenvalues[at], start.modes.shapes[:, at], 0)
    missed = point.modes.frequencies[point.owner[: len(at)]] / own.frequencies - 1.0
    shift = MeshError.of(setting.model, own, missed)
    errors = Errors(channel_errors(point, sharp), channel_errors(point, held))
    return Common(shift, tuple(_missed(point, s) for s in (*sharp, *held)), errors)


def _missed(point: ResponsePoint, signal: Signal) -> Missed:
    """What is left beyond noise, r.m.s. over the lines around."""
    (model,) = on_signals(point, [signal]).modelled()
    f = signal.s.imag / (2.0 * np.pi)
    low = np.searchsorted(f, f * (1.0 - AROUND), "left")
    high = np.searchsorted(f, f * (1.0 + AROUND), "right")
    left = np.abs(model - signal.Y) ** 2 - signal.std**2
    parts = []
    for squares in (left, np.abs(signal.Y) ** 2):
        total = np.concatenate([np.zeros((1, *squares.shape[1:])), np.cumsum(squares, axis=0)])
        parts.append(total[high] - total[low])
    fraction = np.sqrt(np.maximum(parts[0], 0.0) / np.maximum(parts[1], np.finfo(float).tiny))
    return Missed(f, signal.sensors, signal.inputs, signal.order, fraction)


def _at(signal: Signal, frequency: Real, values: Real) -> Real:
    f = signal.s.imag / (2.0 * np.pi)
    flat = values.reshape(len(frequency), -1)
    columns = [np.interp(f, frequency, flat[:, k]) for k in range(flat.shape[1])]
    return np.stack(columns, axis=-1).reshape(len(f), *values.shape[1:])


def _r_m_s(values: Real, axes: tuple[int, ...]) -> Real:
    return np.asarray(np.sqrt(np.mean(values**2, axis=axes, keepdims=True)))
