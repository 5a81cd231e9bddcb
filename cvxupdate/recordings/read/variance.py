"""The variance of FRFs that come from a file: from their coherence, and from the scatter between
neighbouring lines.

With coherence γ² and n averages the complex estimate H1 has (Bendat & Piersol, Random Data, 4th
ed., section 9.2.4; twice the variance of the magnitude, because the phase scatters as much)

    E|H - EH|² = 2 · (1 - γ²) / (2 n γ²) · |H|².

The coherence that an analyser writes comes from the same n averages and is too large by the degree
of freedom that H took: with it the divisor is n - 1 (as in `estimators.frf_variance`). A file
seldom says n. The scatter then does: the fourth difference over every second line,

    d_k = H_{k-4} - 4 H_{k-2} + 6 H_k - 4 H_{k+2} + H_{k+4},

has E|d|² = 70 V for independent lines and 67 V for Hann blocks of random excitation (lines two
apart are correlated by 1/36), while a smooth FRF leaves next to nothing in it away from narrow
peaks; the median over the lines (of an exponential variable: ln 2 times its mean) makes the peaks
harmless. So the divisor comes out within 5 % for either window (a few per cent low for fewer than
twenty averages), and as an effective number: overlapping blocks count for what they are worth.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.types import Complex, Real

_GAIN = 68.5  # between 67 (Hann) and 70 (rectangular)
_MEDIAN = float(np.log(2.0))
_WINDOW = 65  # lines of the running median


def scatter(H: Complex) -> Real:
    """|d|² / 68.5 of each line, (lines - 8, …): its mean is the variance where the FRF is smooth;
    its law is exponential."""
    with np.errstate(over="ignore", invalid="ignore"):  # a flipped bit may read 1e300: infinite
        d = H[:-8] - 4.0 * H[2:-6] + 6.0 * H[4:-4] - 4.0 * H[6:-2] + H[8:]
        return np.asarray(np.abs(d) ** 2 / _GAIN)


def _running_median(x: Real) -> Real:
    from scipy.ndimage import median_filter

    size = (min(_WINDOW, 2 * ((len(x) - 1) // 2) + 1), *([1] * (x.ndim - 1)))
    return np.asarray(median_filter(x, size=size, mode="nearest"))


def averages_from_scatter(H: Complex, coherence: Real) -> float:
    """The divisor (effective averages less one), from scatter against coherence; ``H`` and
    ``coherence`` (lines, functions). NaN if undecided."""
    inner = coherence[4:-4]
    with np.errstate(divide="ignore", invalid="ignore"):
        per_average = (1.0 - inner) / inner * np.abs(H[4:-4]) ** 2
        ratio = scatter(H) / per_average
    ratio = ratio[np.isfinite(ratio) & (per_average > 0.0)]
    if ratio.size < 32:
        return float("nan")
    middle = float(np.median(ratio))
    return max(_MEDIAN / middle, 1.0) if middle > 0.0 else float("nan")


def variance_of_frf(
    H: Complex, coherence: Real | None, averages: float | None = None
) -> tuple[Real | None, float]:
    """Variance of the complex estimate, shape of ``H`` (lines, responses, references), and the
    divisor used (averages less one).

    ``coherence`` has the shape of ``H``, NaN where it was not recorded. A function with coherence
    gets the formula above. One without, beside others of its reference that have it, gets their
    mean variance (a sensor's noise is much the same on all) times the ratio of its own scatter to
    theirs. Where no function has coherence the running median of the scatter (65 lines) is taken:
    it overstates the variance on peaks narrower than about ten lines, which only makes them count
    for less. Fewer than 24 lines give (None, NaN): nothing can be said.
    """
    if H.shape[0] < 24 or not np.all(np.isfinite(H)):
        return None, float("nan")
    lines, responses, references = H.shape
    flat = H.reshape(lines, -1)
    rough = scatter(flat)
    smooth = np.empty((lines, flat.shape[1]))
    smooth[4:-4] = _running_median(rough) / _MEDIAN
    smooth[:4], smooth[-4:] = smooth[4], smooth[-5]
    floor = 1e-14 * np.maximum(
        np.mean(np.abs(flat) ** 2, axis=0), np.finfo(float).tiny
    )  # rounding of single precision
    if coherence is None or np.all(np.isnan(coherence)):
        return np.maximum(smooth, floor).reshape(H.shape), float("nan")
    gamma = np.clip(coherence.reshape(lines, -1), 1e-6, 1.0)
    known = ~np.all(np.isnan(gamma), axis=0)
    gamma = np.where(
        np.isnan(gamma) & known, np.nanmedian(np.where(known, gamma, 1.0), axis=0), gamma
    )
    n = (
        max(averages - 1.0, 1.0)
        if averages is not None
        else averages_from_scatter(flat[:, known], gamma[:, known])
    )
    if not np.isfinite(n):
        return np.maximum(smooth, floor).reshape(H.shape), float("nan")
    variance = np.where(known, (1.0 - gamma) / (n * gamma) * np.abs(flat) ** 2, np.nan).reshape(
        H.shape
    )
    rough3 = rough.reshape(-1, responses, references)
    known2 = known.reshape(responses, references)
    for s in range(references):
        have = np.flatnonzero(known2[:, s])
        for r in np.flatnonzero(~known2[:, s]):
            if have.size == 0:
                variance[:, r, s] = smooth.reshape(H.shape)[:, r, s]
                continue
            shape = np.mean(variance[:, have, s], axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = rough3[:, r, s] / shape[4:-4]
            ratio = ratio[np.isfinite(ratio)]
            variance[:, r, s] = shape * (float(np.median(ratio)) / _MEDIAN if ratio.size else 1.0)
    return np.maximum(variance, floor.reshape(responses, references)), float(n)
