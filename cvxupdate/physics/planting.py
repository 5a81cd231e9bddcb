"""Effects on a model, and actions whose parameters only exist once sizes are known
(`cvxupdate.physics.internal_force`)."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from cvxupdate.fe.model import Model
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place


@dataclass(frozen=True)
class Planted:
    """An effect (`cvxupdate.physics.effect.Effect`) on a model: where its parameters begin
    (columns,), its fault, where that begins."""

    effect: Any
    model: Model
    start: Real
    fault: Fault | None = None
    fault_start: float = 0.0


class Planting(Protocol):
    """A further way to act: parameters of the model that only exist once sizes are known."""

    @property
    def count(self) -> int:
        """Number of unknowns."""

    @property
    def columns(self) -> int:
        """Those that are parameters of the model."""

    @property
    def detail(self) -> tuple[Hashable, ...]:
        """What tells it from others at its place."""

    def label(self, place: Place) -> str:
        """Where, for tables."""

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """False where another effect says it better (band in Hz)."""

    def plant(self, effect: Any, model: Model, guess: Real, delay_unit: float) -> Planted:
        """On a model, from sizes ``guess`` (count,)."""

    def moved(self, effect: Any, context: SearchContext) -> Any:
        """The same `Effect` at the same place of another model; None where it cannot stand."""
