"""How every mode loses energy: in proportion to its velocity, to its displacement, or to some of
both.

Materials, joints and bolts lose the same in every cycle however fast it is (hysteretic, a loss
factor); fluids, dashpots and many programs' modal damping lose more in a faster one (viscous). At a
resonance of its own a mode does not tell them apart, beside it they differ: the share κ that is
hysteretic is one number for all (Nashif, Jones and Henderson 1985, 4.2; Ewins 2000, 2.4 to 2.6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.synthesis.products import Complex
from cvxupdate.fe.terms import Real


@dataclass(frozen=True)
class Loss:
    """Damping ``ratios`` ζ (m,) and the share ``hysteretic`` κ (0 to 1): the dynamic stiffness of a
    mode with unit mass is s² + 2 ζ ω (1 − κ) s + λ (1 + 2 i ζ κ), λ = ω²."""

    ratios: Real
    hysteretic: float = 0.0

    def viscous(self, lam: Real) -> Real:
        """2 ζ ω (1 − κ) (m,) of modes with eigenvalues ``lam`` (…, m), in 1/s."""
        return np.asarray(2.0 * (1.0 - self.hysteretic) * self.ratios * np.sqrt(lam))

    def stiffness(self, lam: Real) -> Real | Complex:
        """λ (1 + 2 i ζ κ) (…, m) in 1/s²; real where all is viscous."""
        if not self.hysteretic:
            return lam
        return np.asarray(lam * (1.0 + 2j * self.hysteretic * self.ratios))

    def first(self, count: int) -> Loss:
        """Of the lowest ``count`` modes."""
        return Loss(self.ratios[:count], self.hysteretic)
