"""The first steps beside a model that is far off."""

from __future__ import annotations

from typing import Protocol

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.types import Seed


class Approach(Protocol):
    """A comparison that no figure can dominate, however far off the model is."""

    def rigged(self, parent: Hypothesis) -> Hypothesis | None:
        """A parent with all that a rig does, as yet of no size; None where there is no such
        thing."""

    def beside(self, parent: Hypothesis, count: int) -> list[Seed]:
        """The ``count`` effects that bring a fitted parent nearest, as it is."""

    def taken(self, seed: Seed, effort: str) -> tuple[Fit, float]:
        """Fitted by that comparison, and what it leaves (0: nothing)."""

    def left(self, h: Hypothesis) -> float:
        """What it leaves of a hypothesis as it is."""
