"""Modes that do not pay for their parameters, or rest on a single line, dropped one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.identify.coarse import refine_coarsely
from cvxupdate.recordings.identify.criterion import parameters, worth
from cvxupdate.recordings.identify.lsfd import LinearFit, Setting, lsfd
from cvxupdate.recordings.identify.model import Roots, frequency_and_damping
from cvxupdate.recordings.identify.uncertainty import reduced_chi_square


def part_of(roots: Roots, keep: NDArray[np.bool_] | NDArray[np.int64]) -> Roots:
    """Some of the modes."""
    return Roots(roots.value[keep], roots.participation[keep], roots.damping)


def pruned(s: Setting, roots: Roots, fit: LinearFit, iterations: int) -> tuple[Roots, LinearFit]:
    """Drop modes one by one, weakest first, while Bayes' information criterion gets better without
    them.

    Noise that is correlated along the lines (exponential window, local polynomials) looks like
    modes: lines count as fewer.
    """
    while roots.value.size:
        one, every = parameters(s, roots.value.size)
        scale = max(reduced_chi_square(s, fit, every), 1e-300)
        weakest = int(np.argmin(fit.gain))
        if worth(s, fit, float(fit.gain[weakest]) / scale, one):
            break
        roots, fit = refine_coarsely(
            s,
            part_of(roots, np.delete(np.arange(roots.value.size), weakest)),
            iterations=iterations,
        )
    return roots, fit


def on_several_lines(
    s: Setting, roots: Roots, fit: LinearFit, iterations: int
) -> tuple[Roots, LinearFit]:
    """Without modes narrower than the lines are apart that rest on a single one, weakest first: a
    pole beside a line takes up its noise in all responses at once. A mode shows on its neighbours,
    too."""
    while roots.value.size:
        f, zeta = frequency_and_damping(roots.value, roots.damping)
        near = np.argmin(np.abs(s.frequency[:, None] - f), axis=0)
        spacing = np.gradient(s.frequency)[near]
        one, every = parameters(s, f.size)
        scale = max(reduced_chi_square(s, fit, every), 1e-300)
        gains = np.full(f.size, np.inf)
        for k in np.flatnonzero(2.0 * zeta * f < spacing):
            rest = s.weights.copy()
            rest[near[k]] = 0.0
            gains[k] = lsfd(replace(s, weights=rest), roots).gain[k]
        weakest = int(np.argmin(gains))
        if not np.isfinite(gains[weakest]) or worth(s, fit, float(gains[weakest]) / scale, one):
            break
        kept = part_of(roots, np.delete(np.arange(f.size), weakest))
        roots, fit = refine_coarsely(s, kept, iterations=iterations)
    return roots, fit
