"""What a statistic exceeds with a given probability, by scipy.special: scipy.stats takes a second
to import, more than most commands need for everything else."""

from __future__ import annotations

import numpy as np
from scipy import special

from cvxupdate.recordings.types import Real


def normal_above(probability: float) -> float:
    """The standard normal law."""
    return -float(special.ndtri(probability))


def student_above(probability: float, freedoms: float) -> float:
    """Student's t."""
    return -float(special.stdtrit(freedoms, probability))


def chi_square_above(probability: float, freedoms: float) -> float:
    """χ² with so many degrees of freedom."""
    return float(special.chdtri(freedoms, probability))


def gamma_above(probability: float, shape: float) -> float:
    """The gamma law of unit scale."""
    return float(special.gammainccinv(shape, probability))


def fisher_two_above(probability: float, freedoms: float) -> float:
    """Fisher's F with 2 degrees of freedom in the numerator, of which 1 − F is a power:
    (1 + 2 x / ν)^(−ν / 2)."""
    return float(0.5 * freedoms * np.expm1(-2.0 / freedoms * np.log(probability)))


def binomial_reaches(count: int, draws: int, chance: float) -> float:
    """Probability that ``count`` or more of so many draws succeed."""
    return float(special.bdtrc(count - 1, draws, chance)) if count > 0 else 1.0


def excess_kurtosis(x: Real) -> float:
    """Fourth moment about the mean over the square of the second, less the 3 of a normal law; 0 of
    what is constant."""
    apart = np.asarray(x, dtype=float) - np.mean(x)
    second = float(np.mean(apart**2))
    return float(np.mean(apart**4)) / second**2 - 3.0 if second > 0.0 else 0.0
