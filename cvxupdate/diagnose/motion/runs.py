"""Recordings in time as they are marched and compared: forces on a finer clock, the lines on which
responses are judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from cvxupdate.diagnose.responses.data import DIFFERENCED, decayed, signals_of
from cvxupdate.diagnose.responses.rest import QUIET, STILL, force_noise, power, rest_noise, through
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal, smoothed
from cvxupdate.recordings.instant import sets_in, transformed
from cvxupdate.recordings.mains import tones, without
from cvxupdate.recordings.measured import DECAY, MOTION, band_of
from cvxupdate.recordings.types import Channel, TimeHistory

FINER = 8  # steps of the march in a sample
SMOOTHING = 0.05  # half-width of the kernel of the first fits, in parts of the frequency
BEFORE = 64  # samples of force before the first one, where it sets in with that
LINES = 700  # of a run at most
PERIODS = 8.0  # in a record, at least: of slower motion its two ends say more than what is between
COLUMNS = 4  # steps of the columns of a regression in a sample
# of the sampling rate: up to here recorders pass what they hear (the usual rate is 2.56 times the
# band, ISO 18431-1); above, their anti-alias filters roll off, and a simulation has no such filter
EDGE = 1.0 / 2.56
MOST_SAMPLES = 32768  # of a run that is fitted: under the exponential window a seventh of it counts
STRETCH = 25  # lines whose mean power is one estimate of the noise
QUIETEST = 1.8  # their mean over the least of a hundred such estimates, of white noise


@dataclass(frozen=True)
class Run:
    """One recording: ``force`` (samples, inputs) and ``motion`` (samples, sensors) at ``rate`` Hz,
    ``orders`` of differentiation of the sensors, ``noise`` (sensors,) standard deviations per
    sample; labels of DOFs."""

    name: str
    use: str
    level: float
    rate: float
    force: Real
    motion: Real
    orders: tuple[int, ...]
    noise: Real
    inputs: tuple[str, ...]
    sensors: tuple[str, ...]

    @property
    def samples(self) -> int:
        """Their number."""
        return len(self.force)

    @property
    def fine_rate(self) -> float:
        """Of the march, Hz."""
        return self.rate * FINER

    @cached_property
    def padded(self) -> int:
        """Samples of a transform in which nothing of the end comes round to the beginning."""
        return int(next_fast_len(2 * self.samples, real=True))

    @cached_property
    def lines(self) -> Complex:
        """iω of a padded transform."""
        return np.asarray(2j * np.pi * np.fft.rfftfreq(self.padded, 1.0 / self.rate))

    def spectra(self, values: Real) -> Complex:
        """Padded transform of samples (samples, …)."""
        return np.asarray(rfft(values, self.padded, axis=0))

    def samples_of(self, spectra: Complex, finer: int = 1) -> Real:
        """Back to samples, on a clock ``finer`` times as fast (band-limited interpolation)."""
        wide = np.zeros((self.padded * finer // 2 + 1, *spectra.shape[1:]), dtype=complex)
        wide[: len(spectra)] = spectra
        out = irfft(wide, self.padded * finer, axis=0) * finer
        return np.asarray(out[: self.samples * finer])

    def coarse(self, fine: Real) -> Complex:
        """Padded transform, on the lines of the samples, of values on the fine clock."""
        finer = len(fine) // self.samples
        return np.asarray(rfft(fine, self.padded * finer, axis=0)[: len(self.lines)] / finer)

    @cached_property
    def fine_force(self) -> Real:
        """The force on the clock of the march; its first sample stands for the one at rest."""
        return self.interpolated(FINER)

    def begun(self, part: float) -> Real:
        """The ``part`` (0 to 1) of `fine_force` from its beginning."""
        return self.fine_force[: int(np.ceil(part * len(self.fine_force)))]

    def to_the_end(self, fine: Real) -> Real:
        """Values on the clock of the march (fine samples, …), 0 after what there is of them."""
        rest = len(self.fine_force) - len(fine)
        return np.pad(fine, ((0, rest), *((0, 0),) * (fine.ndim - 1))) if rest else fine

    def interpolated(self, finer: int) -> Real:
        """The force on a clock ``finer`` times as fast as the samples'. Where it sets in at some
        strength it goes on backwards, mirrored about its first value and faded: what jumps rings
        between samples otherwise, and half of the ringing is before the record."""
        n = min(BEFORE, self.samples - 1)
        long = np.zeros((self.padded, self.force.shape[1]))
        long[: self.samples] = self.force
        if sets_in(self.force) and n > 0:
            fade = 0.5 + 0.5 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))[:, None]
            long[-n:] = ((2.0 * self.force[0] - self.force[1 : n + 1]) * fade)[::-1]
        return self.samples_of(self.spectra(long), finer)

    def heard(self, s: Complex) -> float:
        """Part of the record (0 to 1) after which e^{−st} is as small as at the end of one that is
        heard to its end."""
        return float(min(1.0, DECAY * self.rate / self.samples / s.real[0]))

    def decaying(self, fine: Real, s: Complex) -> Complex:
        """∫ e^{−st} f dt (points, …) of values on a finer clock, at points ``s`` on the record's
        lines, of one real part."""
        rate = self.rate * (len(fine) // self.samples)
        t = np.arange(len(fine)) / rate
        decay = np.exp(-float(s.real[0]) * t).reshape(-1, *(1,) * (fine.ndim - 1))
        lines = np.rint(s.imag / (2.0 * np.pi) * self.samples / self.rate).astype(np.int64)
        return np.asarray(rfft(decay * fine, axis=0)[lines] / rate)


def run_of(history: TimeHistory) -> Run | None:
    """A recording with forces and motions at DOFs of the model, mains hum taken out; None for any
    other."""
    history = without(history, tones(history))
    channels = history.channels
    drives = [i for i, c in enumerate(channels) if c.quantity == "force" and c.dof]
    senses = [i for i, c in enumerate(channels) if _senses(c)]
    if not drives or not senses:
        return None
    motion = history.data[:, senses]
    force = history.data[:, drives]
    level = history.origin.level
    return Run(
        history.origin.name,
        history.origin.use,
        float(np.sqrt(np.mean(force**2))) if level is None else level,
        history.rate,
        force,
        motion,
        tuple(MOTION.index(channels[i].quantity) for i in senses),
        noise_of(motion, force),
        tuple(channels[i].label for i in drives),
        tuple(channels[i].label for i in senses),
    )


def _senses(channel: Channel) -> bool:
    return channel.quantity in MOTION and bool(channel.dof)


def from_rest(history: TimeHistory) -> TimeHistory:
    """Without the offsets of its channels, where it begins at rest: with a stretch in which the
    forces do not move."""
    if not _rests(history):
        return history
    return replace(history, data=history.data - history.data[:QUIET].mean(axis=0))


def begun(history: TimeHistory, part: float) -> TimeHistory:
    """The ``part`` (0 to 1) of it from its beginning."""
    return replace(history, data=history.data[: int(part * len(history.data))])


def shortened(history: TimeHistory) -> TimeHistory:
    """No longer than `MOST_SAMPLES`: of a record from rest the beginning is one by itself."""
    return replace(history, data=history.data[:MOST_SAMPLES])


def _rests(history: TimeHistory) -> bool:
    drives = [i for i, c in enumerate(history.channels) if c.quantity == "force"]
    start, sizes = history.data[:QUIET], np.std(history.data, axis=0)
    still = np.std(start[:, drives], axis=0) <= STILL * sizes[drives]
    return bool(drives) and bool(np.all(still))


def offset_errors(history: TimeHistory) -> Real:
    """Standard deviation (channels,) of the offset that `from_rest` took out, the mean of a few
    samples: of a long record the lowest lines say nothing finer. 0 where nothing was taken out."""
    if not _rests(history):
        return np.zeros(history.data.shape[1])
    return np.asarray(np.std(history.data[:QUIET], axis=0, ddof=1) / np.sqrt(QUIET))


def noise_of(motion: Real, force: Real) -> Real:
    """Standard deviation per sample (sensors,) of white noise: the quietest stretch of each
    spectrum. Distortion may fill all of it, so that it is an upper bound: no more is taken than
    what the samples scatter by at rest, before the ``force`` (samples, inputs) begins, or, where
    they never rest, than where nothing is known."""
    spectrum = power(motion)[1:]
    edges = np.arange(0, len(spectrum) + 1, STRETCH)
    least = np.array([spectrum[a:b].mean(axis=0) for a, b in pairwise(edges)]).min(axis=0)
    rest = rest_noise(motion, force)
    most = np.where(np.isfinite(rest), rest, DIFFERENCED * np.std(motion, axis=0))
    return np.asarray(np.minimum(np.sqrt(least * QUIETEST), most))


def wide(history: TimeHistory) -> TimeHistory:
    """With its whole band: what a nonlinear structure says, it also says where the force is not."""
    low = PERIODS * history.rate / len(history.data)
    band = (min(low, band_of(history)[0]), EDGE * history.rate)
    return replace(history, band=band)


def stages_of(
    histories: Sequence[TimeHistory], runs: Mapping[str, Run], sharp: Sequence[Signal]
) -> tuple[tuple[Signal, ...], ...]:
    """What is fitted: first the ``sharp`` signals smoothed, so that resonances find their places,
    then lines of the whole band, some hundreds of each run."""
    return tuple(smoothed(s, SMOOTHING) for s in sharp), thinned_signals(histories, runs)


def thinned_signals(
    histories: Sequence[TimeHistory], runs: Mapping[str, Run]
) -> tuple[Signal, ...]:
    """Of the whole band, some hundreds of lines of each run."""
    thinned = []
    for s in wide_signals(histories, [runs[h.origin.name] for h in histories]):
        keep = slice(None, None, max(1, int(np.ceil(len(s.s) / LINES))))
        thinned.append(replace(s, s=s.s[keep], Y=s.Y[keep], U=s.U[keep], std=s.std[keep]))
    return tuple(thinned)


def heard_of(signals: Sequence[Signal], runs: Mapping[str, Run]) -> dict[str, float]:
    """Part of each run (0 to 1) that its signals hear."""
    out = dict.fromkeys((s.name for s in signals), 0.0)
    for s in signals:
        out[s.name] = max(out[s.name], runs[s.name].heard(s.s))
    return out


def beginning(signal: Signal, run: Run, decay: float) -> Signal:
    """The same quantity of the ``run`` under a steeper window e^{−δt}, δT = ``decay``: of the
    record the beginning. So much steeper, so much further apart are lines that say something of
    their own, and no more of the signal's are taken."""
    t = np.arange(run.samples) / run.samples
    own = [
        k
        for k, (label, order) in enumerate(zip(run.sensors, run.orders, strict=True))
        if order == signal.order and label in signal.sensors
    ]
    lines = np.rint(signal.s.imag / (2.0 * np.pi) * run.samples / run.rate).astype(np.int64)
    apart = int(np.median(np.diff(lines))) if len(lines) > 1 else 1
    kept = slice(None, None, max(1, int(decay / DECAY) // apart))
    lines = lines[kept]
    begins = sets_in(run.force)
    s, Y = transformed(run.motion[:, own], run.rate, decay, lines, begins)
    _, U = transformed(run.force, run.rate, decay, lines, begins)
    heard = np.linalg.norm(np.exp(-decay * t)) / np.linalg.norm(np.exp(-DECAY * t))
    std = signal.std[kept] * heard
    return replace(signal, s=s, Y=Y[:, :, None], U=U[:, :, None], std=std)


def wide_signals(histories: Sequence[TimeHistory], runs: Sequence[Run]) -> tuple[Signal, ...]:
    """On the lines of the whole band, with the noise of the runs."""
    out = []
    for history, run in zip(histories, runs, strict=True):
        decay = decayed(run.samples, run.rate)
        forces = force_noise(run.force) * decay
        errors = offset_errors(history)
        offsets = [e for e, c in zip(errors, history.channels, strict=True) if _senses(c)]
        for signal in signals_of(wide(history)):
            own = [
                k
                for k, (label, order) in enumerate(zip(run.sensors, run.orders, strict=True))
                if order == signal.order and label in signal.sensors
            ]
            noise, offset = run.noise[own] * decay, np.array(offsets)[own]
            std = np.hypot(noise, offset / np.abs(signal.s)[:, None])  # a step has 1/s
            driven = through(forces, signal.Y, signal.U)
            out.append(replace(signal, std=np.hypot(std[:, :, None], driven)))
    return tuple(out)
