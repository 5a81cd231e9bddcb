"""How many of the effects in question will still be listed once more was measured.

To first order responses move along columns: those of the nuisance parameters, and one for each
effect in question at its size. Sums of their products over rows say, for any set of responses, what
the best refit of one effect leaves of another, nuisance parameters and all, on old and new rows
together. The diagnosis will weigh that as it weighs everything: by the logarithm of the misfit per
row, times half the figures that are independent (a frequency and a damping ratio for each mode, a
gain for each channel), less the price of unknowns. So a set that says little dilutes, and four
responses are not four times one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from cvxupdate.diagnose.settings import STRONG
from cvxupdate.diagnose.types import Real

RIDGE = 1e-12  # of a column's own square: below, nothing of it is left
NEVER = 1e-9  # of an effect's square: what another one takes up entirely
FLOOR = 0.01  # of the likeliest: an effect whose size is taken to first order may do better


@dataclass(frozen=True)
class Products:
    """``gram`` (nuisance + effects, the same) of weighted columns over ``rows``, of so many
    ``channels``; those of several recordings add."""

    gram: Real
    rows: float
    channels: int

    def __add__(self, other: Products) -> Products:
        return Products(
            self.gram + other.gram, self.rows + other.rows, self.channels + other.channels
        )


@dataclass(frozen=True)
class Scale:
    """How what is left is weighed: ``modes`` in the band, ``misfit`` per row that the true effect
    leaves, ``likely`` (effects,) before, ``unknowns`` (effects,) of each; ``priors`` (nuisance,)
    precision of the nuisance parameters."""

    modes: int
    misfit: float
    likely: Real
    unknowns: Real
    priors: Real

    def figures(self, known: Products) -> float:
        """Independent ones."""
        return float(min(known.rows, 2 * self.modes + known.channels))

    def gaps(self, known: Products) -> Real:
        """By how much the evidence for the true effect (first index) will exceed that for another
        one refitted (second), without the price of unknowns, (effects, effects)."""
        n = len(self.priors)
        whole = known.gram
        inner = whole[:n, :n] + np.diag(self.priors)
        S = whole[n:, n:] - whole[n:, :n] @ np.linalg.solve(inner, whole[:n, n:])
        own = np.maximum(np.diag(S), RIDGE * np.maximum(np.diag(whole)[n:], 1e-300))
        rest = own[:, None] - S**2 / own[None, :]
        rest = np.where(rest > NEVER * own[:, None], rest, 0.0)
        return gap_of(rest, known.rows, self.misfit, self.figures(known))

    def listed(self, known: Products) -> Real:
        """Probability that the other one (second index) will still be listed beside the true one
        (first): that the evidence, whose deviation is √(2 gap), is no strong one."""
        return still_listed(self.gaps(known), self.unknowns, self.figures(known))

    def left(self, known: Products, among: int | None = None) -> float:
        """How many others are expected to be listed beside the true one (``among`` the first so
        many effects only)."""
        some = slice(among)
        return others_listed(self.listed(known)[some, some], self.likely[some])

    def separations(self, known: Products, among: int) -> list[float]:
        """Of each pair of the first effects, in deviations: √(2 gap), whichever is true the worse
        one."""
        return separations_of(self.gaps(known)[:among, :among])


def gap_of(rest: Real, rows: float, misfit: float, figures: float) -> Real:
    """By how much the evidence for what is true exceeds that for what leaves ``rest`` weighted
    squares more once refitted, without the price of unknowns: half the ``figures`` times the
    logarithm of the misfit per row over the least, ``misfit``."""
    return np.asarray(0.5 * figures * np.log1p(rest / max(1.0, rows) / misfit))


def still_listed(gaps: Real, unknowns: Real, figures: float) -> Real:
    """Probability (effects, effects) that the other one (second index) is listed beside the true
    one (first): that the evidence, whose deviation is √(2 gap), is no strong one."""
    price = 0.5 * np.log(max(2.0, figures))
    told = gaps + price * (unknowns[None, :] - unknowns[:, None])
    out = ndtr((0.5 * STRONG - told) / np.sqrt(np.maximum(2.0 * gaps, 1.0)))
    np.fill_diagonal(out, 0.0)
    return np.asarray(out)


def others_listed(listed: Real, likely: Real) -> float:
    """How many others are expected beside the true one."""
    return float(likely @ listed.sum(axis=1) / likely.sum())


def separations_of(gaps: Real) -> list[float]:
    """Of each pair, in deviations: √(2 gap), whichever is true the worse one."""
    n = len(gaps)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    return [float(np.sqrt(2.0 * min(gaps[i, j], gaps[j, i]))) for i, j in pairs]


def likelihoods(misfits: Real, unknowns: Real, figures: float, least: float) -> Real:
    """How likely effects are for what was recorded, one together: by Bayes' information criterion
    at the level of discrepancy that the best explanation leaves (misfit ``least``)."""
    logs = -0.5 * figures * np.log(np.maximum(misfits, least) / least)
    logs -= 0.5 * np.log(max(2.0, figures)) * (unknowns - np.min(unknowns))
    likely = np.maximum(np.exp(logs - np.max(logs)), FLOOR)
    return np.asarray(likely / likely.sum())
