"""Is it one decay rate for every mode? Mass-proportional damping, or an exponential window left in
the data."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import ModeTable, Real

_HYPOTHESES = {
    -1.0: (
        "constant decay rate",
        "damping × frequency is nearly the same for all modes: one decay rate of {rate:.3g} "
        "± {std:.2g} 1/s (spread {spread:.0%}), that is mass-proportional damping alpha = "
        "{alpha:.3g} ± {alpha_std:.2g} 1/s, or an exponential window of that decay whose "
        "damping was not taken out",
    ),
    0.0: (
        "constant ratio",
        "the damping ratio is nearly the same for all modes ({ratio:.3g}, spread "
        "{spread:.0%}): hysteretic (structural) damping of the material",
    ),
    1.0: (
        "stiffness proportional",
        "the damping ratio grows with frequency (spread {spread:.0%}): "
        "stiffness-proportional damping",
    ),
}


@dataclass(frozen=True)
class DecayRates:
    """Decay rate of every mode and the law they follow.

    Attributes
    ----------
    rates : (modes,) 1/s, ``damping × 2 pi frequency``. rate, rate_std : their weighted centre and
    its deviation.
    exponent, exponent_std : of ``damping ~ frequency**exponent``: -1 for one rate, 0 for one ratio,
    1 for stiffness-proportional.
    spread : robust relative scatter of the modes about the chosen law. verdict : name of the law,
    or ``"none"``.
    alpha, alpha_std : 1/s, of ``C = alpha M``. outliers : modes (from 0) off the law by more than
    3.5 robust deviations.
    says : the finding as a sentence.
    """

    rates: Real
    rate: float
    rate_std: float
    exponent: float
    exponent_std: float
    spread: float
    verdict: str
    alpha: float
    alpha_std: float
    outliers: tuple[int, ...]
    says: str


def _robust_line(x: Real, y: Real, variance: Real) -> tuple[float, float]:
    """Slope of y(x) and its deviation by iteratively reweighted least squares (Huber, 1.345;
    scatter from the residuals)."""
    design = np.column_stack([np.ones_like(x), x])
    weights = 1.0 / variance
    slope, scale, residual = np.nan, np.nan, np.zeros_like(y)
    for _ in range(30):
        root = np.sqrt(weights)
        solution = np.linalg.lstsq(root[:, None] * design, root * y, rcond=None)[0]
        residual = y - design @ solution
        scale = max(1.4826 * float(np.median(np.abs(residual / np.sqrt(variance)))), 1e-12)
        weights = (
            np.minimum(
                1.0, 1.345 * scale * np.sqrt(variance) / np.maximum(np.abs(residual), 1e-300)
            )
            / variance
        )
        slope = float(solution[1])
    # Huber's covariance: clipped residuals over the fraction that is not clipped, n - 2 degrees of
    # freedom
    clipped = np.clip(residual / np.sqrt(variance), -1.345 * scale, 1.345 * scale)
    kept = float(np.mean(np.abs(clipped) < 1.345 * scale))
    spread = float(clipped @ clipped) / (x.size - 2) / max(kept, 0.5) ** 2
    deviation = float(
        np.sqrt(np.linalg.pinv(design.T @ (design / variance[:, None]))[1, 1] * spread)
    )
    return slope, deviation


def decay_rates(table: ModeTable) -> DecayRates:
    """Test the law that the modes' damping follows: one decay rate, one ratio, or proportional to
    stiffness.

    For every law ``damping × frequency**k`` should be one number; the law with the smallest robust
    scatter (median absolute deviation about the median, relative) wins, and is accepted when that
    scatter is below 0.25 and the fitted exponent lies within 0.35, or three of its deviations, of
    the law's. The stated deviations of the damping weigh the fit where known. The rate is the
    median, its deviation 1.25 robust scatter / root of the number of modes (Ewins section 2.4.3;
    Table 9.1).

    Raises
    ------
    RecordingError
        When fewer than three modes have a known, positive damping.
    """
    known = np.isfinite(table.damping) & (table.damping > 0.0) & (table.frequency > 0.0)
    f, zeta = table.frequency[known], table.damping[known]
    if f.size < 3:
        raise RecordingError(
            f"{table.origin.name}: {f.size} modes with a known damping are too few to test a "
            "law; at least 3 are needed"
        )
    variance = _log_variance(table.damping_std[known], zeta)
    exponent, exponent_std = _robust_line(np.log(f), np.log(zeta), variance)
    spreads = {k: _mad(np.log(zeta) - k * np.log(f)) for k in _HYPOTHESES}
    best = min(spreads, key=lambda k: (round(spreads[k], 6), abs(exponent - k)))
    spread = spreads[best]
    rates = 2.0 * np.pi * f * zeta
    rate = float(np.median(rates))
    rate_std = 1.2533 * _mad(rates) / float(np.sqrt(f.size))
    fits = spread < 0.25 and abs(exponent - best) <= max(0.35, 3.0 * exponent_std)
    off = np.log(zeta) - best * np.log(f)
    off_law = np.abs(off - np.median(off)) > 3.5 * max(spread, 0.03)
    found = DecayRates(
        2.0 * np.pi * table.frequency * table.damping,
        rate,
        rate_std,
        exponent,
        exponent_std,
        spread,
        _HYPOTHESES[best][0] if fits else "none",
        2.0 * rate,
        2.0 * rate_std,
        tuple(int(i) for i in np.flatnonzero(known)[off_law]) if fits else (),
        "",
    )
    return replace(found, says=_sentence(found, best, float(np.median(zeta))))


def _sentence(found: DecayRates, best: float, ratio: float) -> str:
    if found.verdict == "none":
        return (
            f"the damping follows no single law: damping ~ frequency^({found.exponent:.2f} ± "
            f"{found.exponent_std:.2f}), scatter {found.spread:.0%} about the nearest one"
        )
    says = _HYPOTHESES[best][1].format(
        rate=found.rate,
        std=found.rate_std,
        spread=found.spread,
        alpha=found.alpha,
        alpha_std=found.alpha_std,
        ratio=ratio,
    )
    if found.outliers:
        says += "; off the law: mode " + ", ".join(str(i + 1) for i in found.outliers)
    return says


def _mad(x: Real) -> float:
    """Median absolute deviation, scaled to the standard deviation of a normal law."""
    return 1.4826 * float(np.median(np.abs(x - np.median(x))))


def _log_variance(std: Real, zeta: Real) -> Real:
    """Variance of log damping from the stated deviations; 10 % where none is known."""
    relative = np.where(np.isfinite(std) & (std > 0.0), std / zeta, np.nan)
    usual = np.nanmedian(np.append(relative, 0.1))
    # a law of damping never holds to better than some per cent: the floor keeps one mode from
    # ruling
    return np.asarray(np.where(np.isfinite(relative), relative, usual) ** 2 + 0.03**2)
