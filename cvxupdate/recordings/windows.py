"""Windows, their effective number of averages, and the damping an exponential window adds.

Sources: F. J. Harris, Proc. IEEE 66 (1978) 51; P. D. Welch, IEEE Trans. Audio Electroacoust. 15
(1967) 70 (overlap); D. J. Ewins, *Modal Testing* (2000) section 3.7 (force and exponential
windows).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, Real

_COSINES = {
    "rectangular": (1.0,),
    "hann": (0.5, 0.5),
    "hamming": (0.54, 0.46),
    "blackman": (0.42, 0.5, 0.08),
    "blackman-harris": (0.35875, 0.48829, 0.14128, 0.01168),
    "flat-top": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
}


def window(name: str, length: int) -> Real:
    """Periodic cosine-sum window of ``length`` samples: rectangular, hann, hamming, blackman,
    blackman-harris, flat-top.

    Raises
    ------
    RecordingError
        When the name is not one of these.
    """
    if name not in _COSINES:
        raise RecordingError(f"unknown window {name!r}; choose one of {', '.join(_COSINES)}")
    phase = 2.0 * np.pi * np.arange(length) / length
    terms = [(-1) ** k * a * np.cos(k * phase) for k, a in enumerate(_COSINES[name])]
    return np.asarray(np.sum(terms, axis=0) * np.ones(length))


def exponential_window(length: int, rate: float, decay: float) -> Real:
    """``exp(-decay t)``, shape (length,); ``decay`` in 1/s. It moves every pole by exactly
    ``-decay`` (`without_decay`)."""
    return np.asarray(np.exp(-decay * np.arange(length) / rate))


def force_window(length: int, rate: float, width: float, taper: float = 0.2) -> Real:
    """One over the first ``width`` seconds, then a cosine taper of ``taper * width`` seconds to
    zero, shape (length,)."""
    t = np.arange(length) / rate
    fall = max(taper * width, 1.0 / rate)
    return np.asarray(0.5 * (1.0 + np.cos(np.pi * np.clip((t - width) / fall, 0.0, 1.0))))


def without_decay(poles: Complex, decay: float) -> Complex:
    """Poles (rad/s) of the structure, from those of a record that was multiplied by ``exp(-decay
    t)``.

    Multiplication by ``exp(-decay t)`` shifts the Laplace variable, so input and output (both
    windowed, a structure at rest before the record) are related by ``H(s + decay)``: all poles move
    left by ``decay`` and nothing else changes.
    """
    return poles + decay


def effective_averages(taper: Real, step: int, blocks: int) -> float:
    """Independent averages that ``blocks`` overlapping blocks are worth (white noise; Welch 1967).

    ``taper`` (block,) is the window, ``step`` the samples between starts of blocks. Equals
    ``blocks`` without overlap.
    """
    length = taper.size
    power = float(taper @ taper)
    shifts = np.arange(1, min(blocks, -(-length // step)))
    if shifts.size == 0:
        return float(blocks)
    overlap = np.array(
        [float(taper[: length - s * step] @ taper[s * step :]) / power for s in shifts]
    )
    return float(blocks / (1.0 + 2.0 * np.sum((1.0 - shifts / blocks) * overlap**2)))


def find_impacts(
    force: Real, *, block: int, pretrigger: int = 0, threshold: float = 0.2
) -> NDArray[np.int64]:
    """First sample of each block of an impact test, shape (hits,).

    A hit starts where \\|force\\| first exceeds ``threshold`` times its maximum; the next is looked
    for one block later.

    Raises
    ------
    RecordingError
        When no hit is followed by a complete block.
    """
    above = np.flatnonzero(np.abs(force) > threshold * np.max(np.abs(force), initial=0.0))
    starts: list[int] = []
    free = 0
    for sample in above:
        if sample >= free:
            start = int(sample) - pretrigger
            if start >= 0 and start + block <= force.size:
                starts.append(start)
            free = int(sample) + block - pretrigger
    if not starts:
        raise RecordingError(
            f"no impact followed by {block} samples was found in the force; use a shorter block, "
            "a lower threshold, or frf_from_time for continuous excitation"
        )
    return np.array(starts, dtype=np.int64)
