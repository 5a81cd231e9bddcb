"""What is diagnosed: the recordings of responses at every level of smoothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.responses.lines import band_of, lines_of
from cvxupdate.diagnose.responses.signals import Signal, smooth
from cvxupdate.diagnose.settings import LEVELS
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory


@dataclass(frozen=True)
class Data:
    """Recordings at every level, and sharp ones for scoring."""

    fit: tuple[FrequencyResponse | TimeHistory, ...]
    hold_out: tuple[FrequencyResponse | TimeHistory, ...]
    levels: tuple[tuple[Signal, ...], ...]
    sharp: tuple[Signal, ...]
    sharp_hold_out: tuple[Signal, ...]
    top: float
    bottom: float
    mesh: MeshError = NONE
    sheared: MeshError = NONE

    @cached_property
    def sensors(self) -> tuple[str, ...]:
        """Labels of the channels that were measured."""
        return tuple(dict.fromkeys(label for s in self.sharp for label in s.sensors))

    @cached_property
    def accelerometers(self) -> tuple[str, ...]:
        """Those that measure accelerations."""
        heavy = (s for s in (*self.sharp, *self.sharp_hold_out) if s.order == 2)
        return tuple(dict.fromkeys(label for s in heavy for label in s.sensors))

    def mesh_of(self, model: Model) -> MeshError:
        """The mesh error of a hypothesis: where it lets beams deform in shear, that of beams which
        do."""
        return (
            self.sheared
            if self.sheared is not NONE and any(q.of == "shear" for q in model.parameters)
            else self.mesh
        )


def prepare(recordings: Sequence[FrequencyResponse | TimeHistory]) -> Data:
    """Transform every recording once."""
    fit_ = tuple(r for r in recordings if r.origin.use == "fit")
    hold = tuple(r for r in recordings if r.origin.use != "fit")
    bands = [band_of(r) for r in fit_]
    lines, held = lines_of(fit_), lines_of(hold)
    return Data(
        fit_,
        hold,
        tuple(tuple(smooth(x, e) for x in lines) for e in LEVELS),
        tuple(smooth(x, 0.0) for x in lines),
        tuple(smooth(x, 0.0) for x in held),
        max(b[1] for b in bands),
        min(b[0] for b in bands),
    )
