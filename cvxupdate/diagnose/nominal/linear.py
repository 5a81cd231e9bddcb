"""Evidence of structures that are linear and stay as they are."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from cvxupdate.diagnose.budget import Timed
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics.effect import MODES, Effect

SAME_MODE = 0.01  # of a frequency: what drives and sensors that weigh make of one mode


class Linear(Timed):
    """What it has no need to say."""

    fine: Mesh
    told_by: str
    drift, foretold = None, False

    @property
    def stocky(self) -> bool:
        """Of the mesh that is diagnosed."""
        return self.fine.stocky

    @cached_property
    def resonances(self) -> int:
        """Of tables, or of the modes that are identified in responses."""
        seen: Any = self if self.told_by == MODES else self.by_modes(1)
        if seen is None:
            return 0
        f = np.sort(np.concatenate([t.frequency for t in seen.tables.fit]))
        return 1 + int(np.sum(f[1:] > (1.0 + SAME_MODE) * f[:-1]))

    def departs(self, fit: Fit) -> str:
        """None: there is but one kind."""
        return ""

    def held_out(self, fit: Fit) -> float:
        """Nothing: another record is one more of the same."""
        return 0.0

    def between_levels(self, fit: Fit) -> Errors:
        """Not asked."""
        return Errors(float("nan"), float("nan"))

    def alike(self, fit: Fit, effect: Effect, strictly: bool = False) -> Sequence[Effect]:
        """None: all places are compared."""
        return ()

    def apart(self, one: Fit, other: Fit, titles: tuple[str, str]) -> str:
        """Not said."""
        return ""
