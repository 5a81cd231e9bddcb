"""Mains hum in time histories: a tone at a multiple of 50 or 60 Hz that keeps its phase from the
beginning of a record to its end. It does not grow with the force, so that between drive levels it
looks like a structure that is not linear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.measured import MOTION
from cvxupdate.recordings.types import Real, TimeHistory

Complex = NDArray[np.complex128]

MAINS = (50.0, 60.0)  # Hz
MULTIPLES = 7
OFF = 0.002  # relative: large grids keep within it
NEAR, FAR = 4, 40  # lines to either side with which a tone is compared
# times their median power: a line of white noise is above once in a thousand million times
STANDS_OUT = 30.0
# of the power of a tone in pieces of a record what their mean has: a resonance that is driven at
# random changes its phase from piece to piece
STEADY, PIECES = 0.9, 4
LEAST = 8.0  # periods in a piece
FINER = 16  # steps of frequency in a line


@dataclass(frozen=True)
class Tone:
    """In a ``channel`` (number): the real part of ``amplitude`` e^{2πi ``frequency`` t}, t in s
    from the first sample; ``error``: deviation of the amplitude, by what else is there."""

    channel: int
    frequency: float
    amplitude: complex
    error: float

    def unsure(self, s: Complex) -> Real:
        """Deviation of ∫ e^{−st} times it (points,)."""
        return np.asarray(0.5 * self.error / np.abs(s - 2j * np.pi * self.frequency))


def without(history: TimeHistory, found: Sequence[Tone]) -> TimeHistory:
    """A record less its tones."""
    if not found:
        return history
    data, t = history.data.copy(), np.arange(len(history.data)) / history.rate
    for tone in found:
        data[:, tone.channel] -= (tone.amplitude * np.exp(2j * np.pi * tone.frequency * t)).real
    return replace(history, data=data)


def tones(history: TimeHistory) -> tuple[Tone, ...]:
    """Of all channels of motion, where one of them has one: what stands out in one is in the
    others, hidden by their motion. A force that was measured acts, hum or not."""
    n, rate = len(history.data), history.rate
    senses = [k for k, c in enumerate(history.channels) if c.quantity in MOTION]
    if n < PIECES * NEAR or not senses:
        return ()
    window = np.hanning(n)[:, None]
    spectra = np.fft.rfft(window * history.data[:, senses], axis=0)
    power = np.abs(spectra) ** 2
    out = []
    for f, low, high in _ranges(n, rate):
        around = [*range(low - FAR, low - NEAR), *range(high + NEAR, high + FAR)]
        beside = np.median(power[[k for k in around if 0 < k < len(power)]], axis=0)
        line = low + np.argmax(power[low:high], axis=0)
        clear = [i for i, k in enumerate(line) if power[k, i] > STANDS_OUT * beside[i]]
        steady = (_steady(history.data[:, senses[i]], float(line[i]) / n) for i in clear)
        at = [x for x in steady if x is not None and abs(x * rate / f - 1.0) <= OFF]
        if at:
            out += [Tone(k, at[0] * rate, *_amplitude(history.data[:, k], at[0])) for k in senses]
    return tuple(out)


def _ranges(n: int, rate: float) -> Iterator[tuple[float, int, int]]:
    """(Hz, first line, after the last): where hum may be, of the mains and their multiples as far
    as pieces of a record hold periods enough."""
    for f in sorted({m * k for m in MAINS for k in range(1, MULTIPLES + 1)}):
        low, high = (round(f * (1.0 + side) * n / rate) for side in (-OFF, OFF))
        if f < 0.49 * rate and f * n / rate > PIECES * LEAST and low - NEAR > 0:
            yield f, low - 1, high + 2


def _pieces(x: Real, cycles: float) -> Complex:
    """Complex amplitudes of pieces of a channel, at so many ``cycles`` a sample."""
    n = len(x) // PIECES
    turned = x[: PIECES * n] * np.exp(-2j * np.pi * cycles * np.arange(PIECES * n))
    window = np.hanning(n)
    return np.asarray(2.0 * turned.reshape(PIECES, n) @ window / window.sum())


def _steady(x: Real, cycles: float) -> float | None:
    """The cycles a sample of a tone of about so many ``cycles``; None where it does not keep its
    phase."""
    best, n = cycles, len(x) // PIECES
    k = np.arange(PIECES * n)
    heard = x[: PIECES * n] * np.tile(np.hanning(n), PIECES)
    for step in (1.0 / FINER, 1.0 / FINER**2):
        near = best + step * np.arange(-FINER, FINER + 1) / len(x)
        # from each frequency to the next every sample is turned by so much: no further exponentials
        turn = np.exp(-2j * np.pi * step / len(x) * k)
        now, sizes = heard * np.exp(-2j * np.pi * near[0] * k), []
        for _ in near:
            sizes.append(abs(now.sum()))
            now *= turn
        best = float(near[np.argmax(sizes)])
    found = _pieces(x, best)
    return best if abs(found.mean()) ** 2 >= STEADY * np.mean(np.abs(found) ** 2) else None


def _amplitude(x: Real, cycles: float) -> tuple[complex, float]:
    """Of a tone in a channel, and how much its pieces let it vary."""
    found = _pieces(x, cycles)
    mean = found.mean()
    return complex(mean), float(np.sqrt(np.mean(np.abs(found - mean) ** 2) / (PIECES - 1)))
