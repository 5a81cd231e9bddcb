"""How a model that is far off is brought near."""

from __future__ import annotations

from typing import Any, Protocol

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.types import Seed
from cvxupdate.physics.effect import Effect


class Approach(Protocol):
    """A comparison that no figure can dominate, however far off the model is."""

    @property
    def known(self) -> dict[object, Any]:
        """What was worked out once, and will be asked for again."""

    def begun(self) -> Hypothesis:
        """What sets grow on: the model with nominal nuisance parameters and what theory wants."""

    def rigged(self, parent: Hypothesis, held: bool = False) -> Hypothesis | None:
        """A parent with all that a rig does, as yet of no size (``held``: supports that it lets
        give way do so as it says); None where there is no such thing."""

    def alike(self, parent: Hypothesis) -> Hypothesis | None:
        """A parent with the fewest things that a rig may be, as yet of no size; None where that is
        nothing else."""

    def mounted(self, parent: Hypothesis, count: int) -> list[Seed]:
        """A parent on the ``count`` fixtures or cords that bring it nearest, with all else that a
        rig does."""

    def beside(self, parent: Hypothesis, count: int) -> list[Seed]:
        """The ``count`` effects that bring a fitted parent nearest, as it is."""

    def shaker(self, parent: Hypothesis) -> Effect | None:
        """What a shaker may bring where it drives a parent; None where nothing does, or the parent
        has that."""

    def taken(self, seed: Seed, effort: str) -> tuple[Fit, float]:
        """Fitted by that comparison, and what it leaves (0: nothing)."""

    def remember(self, seed: Seed, effort: str, found: tuple[Fit, float]) -> None:
        """What was taken from there, which will be asked for again."""

    def left(self, h: Hypothesis) -> float:
        """What it leaves of a hypothesis as it is."""

    def another_way(self, h: Hypothesis) -> list[Seed]:
        """The same with one of its changes another way at its place."""

    def with_drive(self, h: Hypothesis) -> Hypothesis | None:
        """The same where what stands at the drive goes with it, of which what was fitted says
        nothing; None where nothing does."""

    def shaken(self, h: Hypothesis) -> Seed | None:
        """The same with a shaker where it drives, as yet of no size; None where there is something
        already, or nothing was held out that is driven from elsewhere."""
