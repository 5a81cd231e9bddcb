"""Modes just beyond the band's edges: too strong for a few residual terms, fitted along as full modes.

A mode near the band leaves a smooth misfit that biases the modes inside and makes the deviations large. When the misfit is
correlated along the lines, a mode above and one below the band are tried, and kept when Bayes' information criterion improves.
They are auxiliary: they carry the misfit away, their own parameters mean little.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.identify.lsfd import LinearFit, Setting
from cvxupdate.recordings.identify.model import Roots, frequency_and_damping, value_from_pole
from cvxupdate.recordings.identify.refine import refine
from cvxupdate.recordings.identify.uncertainty import line_correlation, reduced_chi_square
from cvxupdate.recordings.types import Complex, Real


def parameters(s: Setting, modes: int) -> tuple[int, int]:
    """Real parameters of one mode, and of the whole model."""
    _, outputs, inputs = s.H.shape
    one = 2 * outputs + 2 + 2 * (inputs - 1)
    return one, one * modes + sum(s.residuals) * outputs * inputs


def worth(s: Setting, fit: LinearFit, gain: float, count: int) -> bool:
    """Bayes' information criterion: does a ``gain`` in (scaled) cost pay for ``count`` parameters?

    Both the gain and the number of data are divided by the correlation of the lines, at most ten: beyond that it is misfit.
    """
    correlation = min(line_correlation(s, fit), 10.0)
    return gain / correlation > count * np.log(2.0 * s.H.size / correlation)


def _starts(s: Setting, roots: Roots, fit: LinearFit) -> list[tuple[Complex, Complex]]:
    """First guesses (pole, participation) above and below the band, from the strongest direction of the residuals."""
    low, high = float(s.frequency.min()), float(s.frequency.max())
    reach = 0.1 * (high - low)
    _, zeta = frequency_and_damping(roots.value, roots.damping)
    ratio = float(np.clip(np.median(zeta), 1e-4, 0.05)) if zeta.size else 0.01
    guesses = []
    for residual, f in ((fit.upper, high + reach), (fit.lower, low - reach if low > 2.0 * reach else 0.7 * low)):
        direction: Real = (
            np.linalg.svd(residual[0])[2][0] if residual.shape[0] else np.ones(s.H.shape[2])
        )
        pole = np.array([2.0 * np.pi * f * complex(-ratio, np.sqrt(1.0 - ratio**2))])
        guesses.append((value_from_pole(pole, roots.damping), direction[None, :].astype(np.complex128)))
    return guesses


def with_outside_modes(
    s: Setting, roots: Roots, fit: LinearFit, *, iterations: int, limit: int = 3
) -> tuple[Roots, LinearFit]:
    """Add up to ``limit`` auxiliary modes beyond the edges while they pay for their parameters."""
    low, high = float(s.frequency.min()), float(s.frequency.max())
    one, _ = parameters(s, 0)
    for _ in range(limit):
        small = fit.cost <= 1e-12 * float(np.sum(np.abs(s.weights * s.H) ** 2))
        if roots.value.size == 0 or small or line_correlation(s, fit) < 1.2:
            break
        before = frequency_and_damping(roots.value, roots.damping)[0]
        trials = []
        for value, participation in _starts(s, roots, fit):
            start = Roots(
                np.concatenate([roots.value, value]), np.concatenate([roots.participation, participation]), roots.damping
            )
            trials.append(refine(s, start, iterations=min(iterations, 4), tolerance=0.02))
        best = refine(s, min(trials, key=lambda trial: trial[1].cost)[0], iterations=iterations, tolerance=1e-3)
        f = frequency_and_damping(best[0].value, roots.damping)[0]
        if low <= f[-1] <= high or not np.all(np.abs(f[:-1] - before) < 0.02 * before):
            break
        scale = max(reduced_chi_square(s, best[1], parameters(s, best[0].value.size)[1]), 1e-300)
        if not worth(s, best[1], (fit.cost - best[1].cost) / scale, one):
            break
        roots, fit = best
    return refine(s, roots, iterations=iterations)
