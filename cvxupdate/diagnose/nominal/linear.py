"""Evidence of structures that are linear and stay as they are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

from cvxupdate.diagnose.budget import Timed
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics.effect import Effect

# Of a frequency: what drives and sensors that weigh make of one mode between recordings.
SAME = 0.01


def different(frequencies: Iterable[float]) -> int:
    """How many modes there are among natural frequencies (Hz) of several recordings."""
    seen: list[float] = []
    for f in sorted(frequencies):
        if not seen or f > (1.0 + SAME) * seen[-1]:
            seen.append(f)
    return len(seen)


class Linear(Timed):
    """What it has no need to say."""

    fine: Mesh
    drift, foretold = None, False

    @property
    def stocky(self) -> bool:
        """Of the mesh that is diagnosed."""
        return self.fine.stocky

    @cached_property
    def resonances(self) -> int:
        """Of the modes that are identified in responses."""
        seen = self.by_modes(1)
        return 0 if seen is None else different(f for t in seen.tables.fit for f in t.frequency)

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
