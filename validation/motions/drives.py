"""How a structure is driven, and what recorders make of it: a clock four times as fast as theirs,
their anti-alias filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin

from validation.rigs.drawing import Generator

Real = NDArray[np.float64]
FINER = 4  # samples of the bench in one of the recorder's
QUIET = 40  # samples before the force begins
TAPS = 40 * FINER + 1  # of the anti-alias filter, without delay
PASSED = 0.42  # of the recorder's rate
PER_BAND = 3.2  # samples a second for each Hz of the band
SIMULATED = 500  # of a thousand seeds, from where on records are as simulations write them


@dataclass(frozen=True)
class Drive:
    """``kind`` (random, sweep, hammer) in a band (Hz), ``samples`` at ``rate`` (Hz). ``sudden``: at
    full strength from the first sample, and recorded without a filter, as simulations write it."""

    kind: str
    low: float
    top: float
    rate: float
    samples: int
    sudden: bool = False

    @property
    def fine(self) -> float:
        """The bench's clock, Hz."""
        return self.rate * FINER

    def force(self, rng: Generator) -> Real:
        """(FINER × samples,) of a peak about 2; another realisation each time."""
        n, fine = self.samples * FINER, self.fine
        t = np.arange(n) / fine
        quiet = 0 if self.sudden else QUIET * FINER
        if self.kind == "hammer":
            out = np.zeros(n)
            width = 0.7 / self.top
            hits = int(rng.integers(2, 5))
            gaps = quiet / fine + (t[-1] - quiet / fine) * np.arange(hits) / hits
            for begin in gaps * rng.uniform(1.0, 1.0 + 0.1 / hits, hits):
                u = (t - begin - 2.0 * width) / width
                pulse = np.where((u > 0.0) & (u < 1.0), np.sin(np.pi * u) ** 2, 0.0)
                out += 4.0 * rng.uniform(0.6, 1.0) * pulse
            return filtered(out)
        if self.kind == "sweep":
            u = np.maximum(t - quiet / fine, 0.0) / (t[-1] - quiet / fine)
            ratio = np.log(self.top / self.low)
            phase = 2.0 * np.pi * self.low * (t[-1] - quiet / fine) / ratio * np.expm1(ratio * u)
            out = 1.5 * np.sin(phase + rng.uniform(0.0, 2.0 * np.pi))
        else:
            f = np.fft.rfftfreq(n, 1.0 / fine)
            spectrum = np.fft.rfft(rng.standard_normal(n)) * ((f > self.low) & (f < self.top))
            out = np.fft.irfft(spectrum, n)
            out /= np.std(out)
        if self.sudden:
            return np.asarray(out)
        fade = np.clip((np.arange(n) - quiet) / (0.03 * n), 0.0, 1.0)
        return np.asarray(filtered(out * np.sin(0.5 * np.pi * fade) ** 2))

    def recorded(self, values: Real) -> Real:
        """At the recorder's samples."""
        return (values if self.sudden else filtered(values))[::FINER]


def filtered(values: Real) -> Real:
    """Through the anti-alias filter, (samples, …)."""
    taps = firwin(TAPS, PASSED * 2.0 / FINER)
    columns = values.reshape(len(values), -1).T
    out = np.array([np.convolve(c, taps, mode="same") for c in columns]).T
    return out.reshape(values.shape)


def drawn(rng: Generator, seed: int, first: float, top: float) -> Drive:
    """Sixty periods of the first mode, as far as a record may be long."""
    rate = float(f"{PER_BAND * top:.4g}")
    samples = int(np.clip(70.0 * rate / first, 1600, 5000))
    kind = ("random", "random", "random", "sweep", "hammer")[int(rng.integers(5))]
    sudden = kind != "hammer" and seed % 1000 >= SIMULATED
    return Drive(kind, 0.4 * first, top, rate, samples, sudden)
