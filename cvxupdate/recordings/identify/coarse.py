"""The refinement on fewer lines: lines away from every mode say little about poles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.recordings.identify.lsfd import LinearFit, Setting
from cvxupdate.recordings.identify.model import Roots, frequency_and_damping
from cvxupdate.recordings.identify.refine import refine

_THIN = 8


def thinned(s: Setting, roots: Roots, least: int = 1000) -> Setting:
    """The same data with fewer lines: all within eight half-power widths of a mode, every eighth
    elsewhere, weighing as much as all.

    Costs keep their expectation, so a search on these lines ends near the optimum of all lines.
    """
    if s.frequency.size < least or not roots.value.size:
        return s
    f, zeta = frequency_and_damping(roots.value, roots.damping)
    near = np.any(
        np.abs(s.frequency[:, None] - f)
        < np.maximum(16.0 * zeta * f, 8.0 * np.diff(s.frequency).max()),
        axis=1,
    )
    rest = ~near & (np.cumsum(~near) % _THIN == 1)
    keep = near | rest
    weights = (
        np.where(
            near[:, None, None],
            1.0,
            np.sqrt(float(np.count_nonzero(~near)) / max(int(np.count_nonzero(rest)), 1)),
        )
        * s.weights
    )
    return replace(s, frequency=s.frequency[keep], H=s.H[keep], weights=weights[keep])


def refine_coarsely(
    s: Setting, roots: Roots, *, iterations: int, tolerance: float = 1e-3
) -> tuple[Roots, LinearFit]:
    """`refine` on `thinned` lines, then the linear fit on all."""
    if iterations:
        roots, _ = refine(thinned(s, roots), roots, iterations=iterations, tolerance=tolerance)
    return refine(s, roots, iterations=0)
