"""Lines and peaks: a first look at what a record or an FRF contains, before any identification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.peaks import prominent
from cvxupdate.recordings.quantiles import gamma_above
from cvxupdate.recordings.types import Complex, Real

BLOCK = 2**15
"""Samples of a block of `dominant_lines`."""
HIGHEST = 6160.0
"""dB of the largest amplitude that a floating-point number holds."""


@dataclass(frozen=True)
class Line:
    """A spectral line or a peak: ``frequency`` Hz, ``amplitude`` (of the sine, or |H|), ``ratio``
    to its surroundings (power)."""

    frequency: float
    amplitude: float
    ratio: float


def vertex(y: Real, k: int) -> tuple[float, float]:
    """Vertex of the parabola through y[k-1], y[k], y[k+1]: (offset from k in samples, within ±0.5,
    and the value there)."""
    if not 0 < k < len(y) - 1:
        return 0.0, float(y[k])
    a, b, c = float(y[k - 1]), float(y[k]), float(y[k + 1])
    curvature = a - 2.0 * b + c
    if curvature >= 0.0:
        return 0.0, b
    offset = float(np.clip(0.5 * (a - c) / curvature, -0.5, 0.5))
    return offset, b - 0.25 * (a - c) * offset


def dominant_lines(
    x: Real, rate: float, count: int = 5, false_alarm: float = 1e-3
) -> tuple[Line, ...]:
    """The strongest spectral peaks of a record, strongest first, refined by a parabola through the
    logarithms (Hann window).

    A peak counts when its power exceeds the running median around it by more than white noise would
    let any line of the record exceed it, but for a probability ``false_alarm``: one line's power
    averaged over n blocks is a gamma variable of shape n.
    """
    x = np.asarray(x, dtype=float)
    x = x[np.isfinite(x)]
    if x.size < 32 or np.ptp(x) == 0.0:
        return ()
    size = min(x.size, BLOCK)
    blocks = x.size // size
    return lines_of_power(
        block_power(x - np.mean(x), size) / blocks,
        blocks,
        size,
        rate,
        count=count,
        false_alarm=false_alarm,
    )


def block_power(x: Real, size: int) -> Real:
    """Sum over the blocks of ``size`` samples of ``|FFT|²`` under a Hann window, (size // 2 +
    1,)."""
    window = np.hanning(size + 1)[:-1]
    return np.asarray(
        sum(
            np.abs(np.fft.rfft(x[s : s + size] * window)) ** 2
            for s in range(0, x.size - size + 1, size)
        )
    )


def lines_of_power(
    power: Real, blocks: int, size: int, rate: float, *, count: int = 5, false_alarm: float = 1e-3
) -> tuple[Line, ...]:
    """`dominant_lines` from the mean of `block_power` over ``blocks`` blocks."""
    from scipy.ndimage import median_filter

    window = np.hanning(size + 1)[:-1]
    # neighbouring lines of a Hann spectrum share power, so the window is wide; at 0 Hz and Nyquist
    # the law is another, and they are left out
    inside = np.concatenate([power[2:4], power[2:-1], power[-2:-1]])
    around = (
        median_filter(inside, size=min(201, 2 * (len(power) // 2) - 1), mode="reflect")
        * blocks
        / gamma_above(0.5, blocks)
    )
    ratio = power / np.maximum(around, 1e-20 * power.max())
    threshold = gamma_above(false_alarm / len(power), blocks) / blocks
    inner = np.arange(2, len(power) - 1)
    peak = inner[
        (power[inner] >= power[inner - 1])
        & (power[inner] > power[inner + 1])
        & (ratio[inner] > threshold)
    ]
    log = np.log(np.maximum(power, np.finfo(float).tiny))
    found = []
    for k in peak[np.argsort(-power[peak])][:count]:
        offset, height = vertex(log, int(k))
        found.append(
            Line(
                (k + offset) * rate / size,
                2.0 * float(np.exp(height / 2.0)) / window.sum(),
                float(ratio[k]),
            )
        )
    return tuple(found)


def frf_peaks(
    frequency: Real,
    H: Complex,
    count: int = 5,
    prominence_db: float = 6.0,
    low: float = 0.0,
    high: float = np.inf,
) -> tuple[Line, ...]:
    """Peaks of the root sum square over all FRFs, in rising frequency: the ``count`` most prominent
    ones of at least ``prominence_db``.

    ``H`` (lines, …). Each is refined by a parabola through the logarithms of the three highest
    lines; a first look only, see `identify`.
    """
    use = (frequency >= low) & (frequency <= high)
    frequency, H = frequency[use], H[use]
    if len(frequency) < 3:
        return ()
    flat = H.reshape(len(H), -1)
    flat = np.where(np.isfinite(flat), flat, 0.0)
    top = max(float(np.abs(part).max(initial=0.0)) for part in (flat.real, flat.imag)) or 1.0
    power = np.sum(np.abs(flat / top) ** 2, axis=1)  # a damaged file may hold 1e300
    level = 20.0 * np.log10(top) + 10.0 * np.log10(np.maximum(power, np.finfo(float).tiny))
    places, above = prominent(level, prominence_db)
    best = np.sort(places[np.argsort(-above)][:count])
    prominence = dict(zip(places.tolist(), above.tolist(), strict=True))
    found = []
    for k in best:
        offset, height = vertex(level, int(k))
        step = frequency[k + 1] - frequency[k] if offset > 0 else frequency[k] - frequency[k - 1]
        found.append(
            Line(
                float(frequency[k] + offset * step),
                10.0 ** (min(height, HIGHEST) / 20.0),
                10.0 ** (min(prominence[int(k)], 300.0) / 10.0),
            )
        )
    return tuple(found)


def sine_fit(x: Real, rate: float, frequency: float) -> tuple[float, Complex, Real]:
    """A sine of unknown frequency through all channels: (frequency Hz, complex amplitudes
    (channels,), residual r.m.s. (channels,)).

    Least squares in frequency, amplitude, phase and offset by Gauss–Newton from a first guess (IEEE
    1057 four-parameter fit), the frequency being common to the channels, each weighted by its
    r.m.s. ``x`` (samples, channels). Amplitudes refer to cos at sample 0: x ≈ Re(a exp(i 2π f t)).
    """
    t = np.arange(len(x)) / rate
    scale = np.std(x, axis=0)
    y = x / np.where(scale > 0.0, scale, 1.0)
    for _ in range(30):
        c, s = np.cos(2.0 * np.pi * frequency * t), np.sin(2.0 * np.pi * frequency * t)
        basis = np.stack([c, s, np.ones_like(t)], axis=1)
        p = np.linalg.lstsq(basis, y, rcond=None)[0]
        slope = 2.0 * np.pi * t[:, None] * (-np.outer(s, p[0]) + np.outer(c, p[1]))
        left = y - basis @ p
        slope = slope - basis @ np.linalg.lstsq(basis, slope, rcond=None)[0]
        step = float(np.sum(slope * left) / max(np.sum(slope**2), np.finfo(float).tiny))
        step = float(np.clip(step, -0.1 * frequency, 0.1 * frequency))
        frequency += step
        if abs(step) < 1e-10 * frequency:
            break
    c, s = np.cos(2.0 * np.pi * frequency * t), np.sin(2.0 * np.pi * frequency * t)
    basis = np.stack([c, s, np.ones_like(t)], axis=1)
    p = np.linalg.lstsq(basis, x, rcond=None)[0]
    return frequency, np.asarray(p[0] - 1j * p[1]), np.sqrt(np.mean((x - basis @ p) ** 2, axis=0))


def decaying_sines(x: Real, rate: float, modes: int) -> tuple[tuple[float, float], ...]:
    """Undamped frequency (Hz) and damping of the ``modes`` sines in a free decay, by the matrix
    pencil (Hua & Sarkar, IEEE Trans. ASSP 38, 1990).

    ``x`` (samples,), with its offset removed and little above the highest frequency of interest
    (decimate it first); poles that do not decay, or do not oscillate, are left out.
    """
    half = len(x) // 2
    hankel = np.lib.stride_tricks.sliding_window_view(x, half)
    U, S, Vh = np.linalg.svd(hankel[:, :-1], full_matrices=False)
    order = min(2 * modes, len(S))
    pencil = (U[:, :order].T @ hankel[:, 1:] @ Vh[:order].T) / S[:order, None]
    poles = np.log(np.linalg.eigvals(pencil).astype(complex)) * rate
    found = [
        (float(abs(p)) / (2.0 * np.pi), float(-p.real / abs(p)))
        for p in poles
        if p.imag > 0.0 and p.real < 0.0
    ]
    return tuple(sorted(found))
