"""What a diagnosis shows beside its numbers: responses before and after, what remains against
noise, and where on the structure a cause may sit. It travels to the page and is not part of
diagnosis.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cvxupdate.physics.effect import Effect

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """One channel: magnitudes (n,) at ``frequency`` (Hz) as measured, modelled before and after,
    and its noise (one standard deviation).

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
