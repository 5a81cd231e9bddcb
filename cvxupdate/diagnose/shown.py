"""What a diagnosis shows beside its numbers: responses before and after, what remains against
noise, and where on the structure a cause may sit. It travels to the page and is not part of
diagnosis.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate.result import Geometry
from cvxupdate.physics.effect import Effect

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """One channel: magnitudes (n,) at ``frequency`` (Hz) as measured, modelled before and after,
    and its noise (one standard deviation); ``phases`` likewise, in degrees, of the three.

    ``driven`` are the DOFs of the force (one for an FRF); ``per_force`` says that it is an FRF (SI
    per N), else the spectrum of the response (SI s).
    """

    recording: str
    use: str
    sensor: str
    driven: tuple[str, ...]
    quantity: str
    per_force: bool
    frequency: Real
    measured: Real
    before: Real
    after: Real
    noise: Real
    phases: tuple[Real, Real, Real] | None = None


@dataclass(frozen=True)
class Spectrum:
    """What remains of all channels of the recordings of one ``use``, each relative to its own
    r.m.s., in bins of ``frequency`` (Hz)."""

    use: str
    frequency: Real
    before: Real
    after: Real
    noise: Real


@dataclass(frozen=True)
class ModeError:
    """A measured mode (Hz) and the model's error before and after, as fractions; NaN where no mode
    of the model belongs to it."""

    frequency: float
    use: str
    before: float
    after: float


@dataclass(frozen=True)
class Shown:
    """Everything to be drawn; ``nodes`` and ``elements`` → the fraction of the mismatch that the
    best effect there could explain, to first order."""

    curves: tuple[Curve, ...] = ()
    spectra: tuple[Spectrum, ...] = ()
    modes: tuple[ModeError, ...] = ()
    nodes: dict[int, float] = field(default_factory=dict)
    elements: dict[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ModeBeside:
    """A mode: ``measured`` (Hz, None beside responses, which state none), the model's ``before``
    and ``after`` (None where it has no partner), their MAC with the measured shape, their shapes
    (nodes, 3); ``motion`` is what was measured: (row of the geometry, 0..2 for x..z, value), on
    the scale of the last shape."""

    recording: str
    use: str
    measured: float | None
    before: float | None
    after: float | None = None
    mac_before: float | None = None
    mac_after: float | None = None
    shape_before: Real | None = None
    shape_after: Real | None = None
    motion: tuple[tuple[int, int, complex], ...] = ()


@dataclass(frozen=True)
class Beside:
    """Both models beside the recordings: the structure to draw on, where sensors and forces sit
    (labels), modes; (effect, why) of what was not tried."""

    geometry: Geometry | None
    sensors: tuple[str, ...] = ()
    forces: tuple[str, ...] = ()
    modes: tuple[ModeBeside, ...] = ()
    untried: tuple[tuple[str, str], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The entries ``modes`` (Hz) and ``not_tried`` of diagnosis.json."""
        numbers = ("recording", "use", "measured", "before", "after", "mac_before", "mac_after")
        return {
            "modes": [{key: getattr(m, key) for key in numbers} for m in self.modes],
            "not_tried": [{"physics": name, "why": why} for name, why in self.untried],
        }


def places(scores: Sequence[tuple[Effect, float]]) -> tuple[dict[int, float], dict[int, float]]:
    """The best fraction at every node and at every element; a set of elements stands for its
    elements only where it is one element."""
    nodes: dict[int, float] = {}
    elements: dict[int, float] = {}
    for effect, fraction in scores:
        place = effect.place
        if effect.fault is not None or not np.isfinite(fraction) or fraction <= 0.0:
            continue
        single = place.elements if len(place.elements) == 1 else ()
        target, ids = (nodes, place.nodes) if place.nodes else (elements, single)
        for i in ids:
            target[i] = max(target.get(i, 0.0), float(fraction))
    return nodes, elements
