"""What the unknowns of a hypothesis cost of its evidence."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.physics.alike import OWN


def price(unknowns: float, figures: float) -> float:
    """What unknowns cost of the logarithm of the evidence: half the logarithm of the figures that
    were compared, each (Bayes' information criterion; Kass and Raftery 1995)."""
    return 0.5 * unknowns * float(np.log(max(2.0, figures)))


def unknowns_of(h: Hypothesis) -> float:
    """Those of its effects, and of what members of a class have of their own, which other
    hypotheses have not, as much as the recordings tell."""
    own = [j for j, q in enumerate(h.fit.setting.model.parameters) if q.group == OWN]
    return h.unknowns + (h.fit.determined(own) if own else 0.0)
