"""What the evidence of motion has of the linear evidence of the same recordings."""

from __future__ import annotations

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.types import Errors, LevelChange
from cvxupdate.fe.model import Model
from cvxupdate.physics.context import SearchContext


class OfLinear:
    """Of the ``linear`` evidence."""

    linear: ResponseEvidence

    @property
    def model(self) -> Model:
        """The nominal one with its nuisance parameters."""
        return self.linear.model

    @property
    def file(self) -> Model | None:
        """The model as it came, where a reference state was there to bring it to."""
        return self.linear.file

    @property
    def band(self) -> tuple[float, float]:
        """Hz."""
        return self.linear.band

    @property
    def delay_unit(self) -> float:
        """Of a sensor's delay, s."""
        return self.linear.delay_unit

    @property
    def noise(self) -> Errors:
        """Of noise alone."""
        return self.linear.noise

    @property
    def nominal(self) -> Errors:
        """Of the nominal model."""
        return self.linear.nominal

    def level_change(self) -> LevelChange | None:
        """Between runs at different drive levels."""
        return self.linear.level_change()

    def context(self, model: Model) -> SearchContext:
        """For placing effects."""
        return self.linear.context(model)

    def allowance(self, model: Model) -> float:
        """Of the mesh."""
        return self.linear.allowance(model)

    def departs(self, fit: Fit) -> str:
        """None: there is but one kind."""
        return ""

    def left(self, errors: Errors) -> str:
        """In words."""
        return self.linear.left(errors)

    def lines(self) -> list[str]:
        """What the mesh of the file is worth, and what time did not allow."""
        return self.linear.lines()
