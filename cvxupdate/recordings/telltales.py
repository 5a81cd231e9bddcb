"""What time histories say of a structure by themselves, whatever its model: resonances that move
with the level or with time, asymmetry, what answers where nothing was forced, a ring-down's
frequency and damping against its amplitude (Worden and Tomlinson 2001, chapters 2 and 4; Kerschen,
Worden, Vakakis and Golinval 2006, section 3).

Two stretches of recordings are compared by their responses on a logarithmic scale of frequency:
a shift that lays one over the other, and how wide its resonances are. Deviations are a jackknife's
over blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, hilbert, sosfiltfilt

from cvxupdate.recordings.measured import MOTION, excited_band
from cvxupdate.recordings.types import FrequencyResponse, Real, TimeHistory

BLOCKS = 8  # of half their length apart, in a stretch
FORCED = 0.03  # of the strongest: lines whose force is less are not compared
LEAST_LINES = 12  # compared at least
GRID = 800  # points of the logarithmic scale
FINE = 4000  # of FRFs, whose resonances have no window's width
FARTHEST = 0.25  # shift of the logarithm of frequency that is looked for
SILENT = 1e-3  # of the force's largest value: where it has ended
CYCLES = 24.0  # of a ring-down at least
AROUND = 0.25  # of its frequency: half-width of a mode's own band
UNFORCED = 1e-4  # of the strongest line's power: lines on which nothing was forced
STRETCH = 25  # lines whose mean power is one estimate of the noise


@dataclass(frozen=True)
class Stretch:
    """Spectra of blocks of a recording: ``force`` (blocks, lines) and ``motion`` (blocks, lines,
    sensors) at ``f`` Hz; ``band`` (Hz) that was forced, ``size`` the r.m.s. of the force."""

    f: Real
    force: np.ndarray
    motion: np.ndarray
    band: tuple[float, float]
    size: float


@dataclass(frozen=True)
class Change:
    """Of resonances from one stretch to another: relative ``shift`` of frequency and relative
    growth of width (``wider``), each with its standard deviation."""

    shift: float
    shift_deviation: float
    wider: float
    wider_deviation: float

    def shifts(self, least: float, times: float) -> bool:
        """By more than ``least`` and so many standard deviations."""
        return abs(self.shift) > max(least, times * self.shift_deviation)

    def widens(self, least: float, times: float) -> bool:
        """Width grows or falls by more than ``least`` and so many standard deviations."""
        return abs(self.wider) > max(least, times * self.wider_deviation)


def channels_of(history: TimeHistory) -> tuple[Real, Real] | None:
    """(force (samples,), motion (samples, sensors)); None with several forces or none, or where
    nothing moves."""
    drives = [i for i, c in enumerate(history.channels) if c.quantity == "force"]
    senses = [i for i, c in enumerate(history.channels) if c.quantity in MOTION]
    if len(drives) != 1 or not senses:
        return None
    return history.data[:, drives[0]], history.data[:, senses]


def stretch(history: TimeHistory, start: float = 0.0, end: float = 1.0) -> Stretch | None:
    """Between two parts (0 to 1) of a recording; None where it cannot be compared."""
    known = channels_of(history)
    if known is None:
        return None
    force, motion = known
    n = len(force)
    cut = slice(round(start * n), round(end * n))
    force, motion = force[cut], motion[cut]
    size = 2 * (len(force) // (BLOCKS + 1))
    if size < 64:
        return None
    f = np.fft.rfftfreq(size, 1.0 / history.rate)
    window: Real = np.hanning(size)
    begins = [k * (size // 2) for k in range(BLOCKS)]
    F = np.array([np.fft.rfft(window * force[b : b + size]) for b in begins])
    X = np.array([np.fft.rfft(window[:, None] * motion[b : b + size], axis=0) for b in begins])
    return Stretch(
        np.asarray(f, dtype=float), F, X, excited_band(history), float(np.sqrt(np.mean(force**2)))
    )


def change(a: Stretch, b: Stretch) -> Change | None:
    """From ``a`` to ``b``, on the lines where both were forced; None where these are few."""
    if a.motion.shape[2] != b.motion.shape[2] or not np.array_equal(a.f, b.f):
        return None
    power = [np.mean(np.abs(s.force) ** 2, axis=0) for s in (a, b)]
    both = np.all([p > FORCED * p.max() for p in power], axis=0)
    both &= (a.f >= max(a.band[0], b.band[0])) & (a.f <= min(a.band[1], b.band[1]))
    if np.sum(both) < LEAST_LINES:
        return None
    low, high = a.f[both][0], a.f[both][-1]
    if high < 1.5 * low:
        return None
    u = np.linspace(np.log(low), np.log(high), GRID)
    everything = np.arange(BLOCKS)
    whole = _curves(a, u, everything), _curves(b, u, everything)
    sizes = np.array([_shift(*whole, u), _wider(*whole)])
    pieces = []
    for k in everything:  # delete one block of each at a time
        curves = _curves(a, u, everything != k), _curves(b, u, everything != k)
        pieces.append([_shift(*curves, u), _wider(*curves)])
    spread = np.std(np.array(pieces), axis=0) * np.sqrt(BLOCKS - 1)
    return Change(float(sizes[0]), float(spread[0]), float(sizes[1]), float(spread[1]))


def change_of_frfs(a: FrequencyResponse, b: FrequencyResponse) -> Change | None:
    """From ``a`` to ``b``, FRFs of the same channels, over the band that both have; deviations are
    a jackknife's over interleaved lines. None where they do not compare."""
    channels = [([c.label for c in r.responses], [c.label for c in r.references]) for r in (a, b)]
    if channels[0] != channels[1] or a.quantity != b.quantity:
        return None
    f = [r.frequency[r.frequency > 0.0] for r in (a, b)]
    if min(map(len, f)) < 2 * BLOCKS:
        return None
    low, high = max(x[0] for x in f), min(x[-1] for x in f)
    if high < 1.5 * low:
        return None
    u = np.linspace(np.log(low), np.log(high), FINE)

    def between(left_out: int) -> tuple[float, float]:
        x, y = (_frf_curve(r, u, left_out) for r in (a, b))
        return _shift(x, y, u), _wider(x, y)

    sizes, pieces = between(-1), np.array([between(k) for k in range(BLOCKS)])
    spread = np.std(pieces, axis=0) * np.sqrt(BLOCKS - 1)
    return Change(sizes[0], float(spread[0]), sizes[1], float(spread[1]))


def _frf_curve(frf: FrequencyResponse, u: Real, left_out: int) -> Real:
    """Size of the responses, every channel alike, on a logarithmic scale, without every eighth
    line from ``left_out`` on (−1: with all)."""
    keep = (frf.frequency > 0.0) & (np.arange(len(frf.frequency)) % BLOCKS != left_out)
    H = np.abs(frf.H[keep]).reshape(int(keep.sum()), -1)
    heard = np.all(np.isfinite(H), axis=1)
    H = H[heard] / np.maximum(np.sqrt(np.mean(H[heard] ** 2, axis=0)), 1e-300)
    return np.interp(u, np.log(frf.frequency[keep][heard]), np.sqrt(np.mean(H**2, axis=1)))


def _curves(s: Stretch, u: Real, blocks: np.ndarray) -> Real:
    """Size of the responses (GRID,), every sensor alike, on a logarithmic scale."""
    force, motion = s.force[blocks], s.motion[blocks]
    power = np.mean(np.abs(force) ** 2, axis=0)
    H = np.mean(np.conj(force)[:, :, None] * motion, axis=0)
    H = np.abs(H) / np.maximum(power, 1e-12 * power.max())[:, None]
    H = H / np.maximum(np.sqrt(np.mean(H**2, axis=0)), 1e-300)
    return np.interp(u, np.log(np.maximum(s.f, 1e-300)), np.sqrt(np.mean(H**2, axis=1)))


def _shift(a: Real, b: Real, u: Real) -> float:
    """Relative shift of frequency that lays ``b`` over ``a``: where their product is largest."""
    step = u[1] - u[0]
    most = min(int(FARTHEST / step), len(u) // 3)
    lags = np.arange(-most, most + 1)
    overlap = np.array([_alike(a, b, int(k)) for k in lags])
    k = int(np.clip(np.argmax(overlap), 1, len(lags) - 2))
    y = overlap[k - 1 : k + 2]
    bend = y[0] - 2.0 * y[1] + y[2]
    part = 0.0 if bend >= 0.0 else 0.5 * (y[0] - y[2]) / bend
    return float(np.expm1((lags[k] + part) * step))


def _alike(a: Real, b: Real, lag: int) -> float:
    n = len(a) - abs(lag)
    x, y = (a[:n], b[lag:]) if lag >= 0 else (a[-lag:], b[:n])
    return float(x @ y / np.sqrt((x @ x) * (y @ y)))


def _wider(a: Real, b: Real) -> float:
    """Growth of (∫|H|²)² / ∫|H|⁴, which goes as the width of a resonance."""
    width = [float(np.mean(c**2) ** 2 / np.mean(c**4)) for c in (a, b)]
    return width[1] / width[0] - 1.0


def halves(history: TimeHistory) -> Change | None:
    """From the first half of a recording to the second, where both were forced alike."""
    a, b = stretch(history, 0.0, 0.5), stretch(history, 0.5, 1.0)
    if a is None or b is None or not 0.8 < b.size / max(a.size, 1e-300) < 1.25:
        return None
    return change(a, b)


def asymmetry(history: TimeHistory) -> tuple[float, float] | None:
    """(third moment of the motion, its standard deviation over blocks), standardised, of the sensor
    that shows it most: what pushes harder than it pulls. None where the force is lopsided too."""
    known = channels_of(history)
    if known is None:
        return None
    force, motion = known
    third = _skewness(force[:, None])[0]
    if abs(third[0]) > 0.1 + 3.0 * third[1]:
        return None
    found = max(_skewness(motion), key=lambda s: abs(s[0]) / max(s[1], 1e-12))
    return float(found[0]), float(found[1])


def _skewness(x: Real) -> list[tuple[float, float]]:
    parts = np.array_split(x - x.mean(axis=0), 2 * BLOCKS)
    scale = np.maximum(np.std(x, axis=0), 1e-300)
    each = np.array([np.mean((p / scale) ** 3, axis=0) for p in parts])
    deviation = np.std(each, axis=0) / np.sqrt(len(each) - 1)
    return list(zip(each.mean(axis=0).tolist(), deviation.tolist(), strict=True))


def unforced(history: TimeHistory) -> float | None:
    """Part (0 to 1) of the motion's r.m.s. beyond noise on lines that the force left out: a linear
    structure answers nowhere else. None where the force reaches all lines."""
    known = channels_of(history)
    if known is None:
        return None
    window = np.hanning(len(known[0]))
    F = np.abs(np.fft.rfft(window * known[0])) ** 2
    X = np.abs(np.fft.rfft(window[:, None] * (known[1] - known[1].mean(axis=0)), axis=0)) ** 2
    smooth = np.convolve(F, np.ones(STRETCH) / STRETCH, mode="same")
    out = smooth < UNFORCED * smooth.max()
    out[: 2 * STRETCH] = False  # offsets and leakage
    if np.mean(out) < 0.1:
        return None
    count = len(X) // STRETCH
    noise = X[: count * STRETCH].reshape(count, STRETCH, -1).mean(axis=1).min(axis=0)
    beyond = np.maximum(X[out].sum(axis=0) - 1.5 * np.sum(out) * noise, 0.0)
    return float(np.sqrt(np.max(beyond / np.maximum(X.sum(axis=0), 1e-300))))


@dataclass(frozen=True)
class RingDown:
    """A free decay: frequency (Hz) and fraction of critical damping while it is ``loud`` and while
    it is faint, ``ratio`` of their amplitudes."""

    frequency: tuple[float, float]
    damping: tuple[float, float]
    ratio: float


def ring_down(history: TimeHistory) -> RingDown | None:
    """Of the strongest mode after the last force; None where there is none, or hardly any decay."""
    known = channels_of(history)
    if known is None:
        return None
    force, motion = known
    forced = np.flatnonzero(np.abs(force) > SILENT * np.max(np.abs(force)) + 6.0 * _rest(force))
    begin = int(forced[-1]) + 1 if len(forced) else len(force)
    free = motion[begin:]
    if len(free) < 64:
        return None
    spectrum = np.abs(np.fft.rfft(np.hanning(len(free))[:, None] * free, axis=0))
    f = np.fft.rfftfreq(len(free), 1.0 / history.rate)
    spectrum[f < 4.0 * history.rate / len(free)] = 0.0
    line, sensor = np.unravel_index(int(np.argmax(spectrum)), spectrum.shape)
    centre = float(f[line])
    band = (centre * (1.0 - AROUND), min(centre * (1.0 + AROUND), 0.49 * history.rate))
    if len(free) * centre / history.rate < CYCLES:
        return None
    own = hilbert(
        sosfiltfilt(butter(4, band, "bandpass", fs=history.rate, output="sos"), free[:, sensor])
    )
    edge = int(2.0 * history.rate / centre)
    return _decay(own[edge:-edge], history.rate, _rest(motion[:, sensor]))


def _rest(x: Real) -> float:
    """Standard deviation of what a channel says at rest, at its beginning."""
    return float(np.std(x[:24]))


def _decay(own: np.ndarray, rate: float, noise: float) -> RingDown | None:
    amplitude = np.abs(own)
    below = np.flatnonzero(amplitude < max(4.0 * noise, 0.01 * amplitude[0]))
    n = int(below[0]) if len(below) else len(own)
    third = n // 3
    if third < 24:
        return None
    phase, t = np.unwrap(np.angle(own)), np.arange(len(own)) / rate
    sizes = []
    for cut in (slice(0, third), slice(n - third, n)):
        omega = np.polyfit(t[cut], phase[cut], 1)[0]
        fall = -np.polyfit(t[cut], np.log(amplitude[cut]), 1)[0]
        sizes.append((omega / (2.0 * np.pi), fall / omega, float(np.mean(amplitude[cut]))))
    (f0, z0, a0), (f1, z1, a1) = sizes
    if a0 < 2.0 * a1:
        return None
    return RingDown((f0, f1), (z0, z1), a0 / a1)
