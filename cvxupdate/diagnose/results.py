"""What a diagnosis ends with: findings, what the evidence says beside its search, and the model
that is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.settings import (
    AS_LIKELY,
    LEAST_SIZE,
    SEEN_SIZE,
    STATED,
    SURE_OF_PLACE,
)
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place, listed
from cvxupdate.physics.units import quantity

Real = NDArray[np.float64]


def in_words(effect: Effect, values: Mapping[str, float], deviations: Mapping[str, float]) -> str:
    """What an effect says, and which of several figures it does not tell: those that are less than
    twice their deviations. One that is there without a size says so, and so does a single spring
    that is told to be soft and not how soft: what a hinge leaves goes with its stiffness."""
    first = effect.figures[0] if effect.figures else None
    if first is not None and first.nothing is not None:
        size = abs(values[first.name] - first.nothing)
        untold = effect.type.sizeless(effect, values)
        if untold and size < SEEN_SIZE * deviations.get(first.name, 0.0):
            return untold
    vague = [n for n, x in values.items() if abs(x) < LEAST_SIZE * deviations.get(n, 0.0)]
    if vague and len(values) == 1 and first is not None and first.nothing is None and first.unit:
        most = values[first.name] + LEAST_SIZE * deviations[first.name]
        told = f"all that is told is less than {quantity(most, first.unit)}"
        return f"{effect.says(values)} (It may be as good as free: {told}.)"
    if len(values) < 2 or not vague:
        return effect.says(values)
    return (
        f"{effect.says(values)} ({listed(vague)} {'is' if len(vague) == 1 else 'are'} hardly told.)"
    )


def or_elsewhere(
    effect: Effect, confidence: float, others: Sequence[Effect], behind: Sequence[float] = ()
) -> str:
    """Where else the same may be for all that the recordings say, of an effect at one node that is
    likelier not there, or hardly likelier there than elsewhere (``behind``: how many times less
    likely each of the others is); nothing to say of others."""
    own = effect.place
    nodes = [
        e.place.nodes[0]
        for e, odds in zip(others, behind or (1.0,) * len(others), strict=True)
        if e.physics == effect.physics
        and len(e.place.nodes) == 1
        and replace(e.place, nodes=own.nodes) == own
        and (confidence < STATED or odds < np.exp(AS_LIKELY))
    ]
    if confidence >= SURE_OF_PLACE or len(own.nodes) != 1 or not nodes:
        return ""
    which = "node " if len(nodes) == 1 else "one of nodes "
    return f" (Or at {which}{listed(sorted(nodes))}: which of them is hardly told.)"


@dataclass(frozen=True)
class Finding:
    """One effect: where, how large, how sure, and what the recordings cannot tell from it.

    ``title``: effect and place as a thing ("an added mass at node 5"); ``noise_deviations``: of
    the recordings alone, where ``deviations`` includes what the model leaves open; ``explains``:
    its part of the misfit beyond noise, 0 to 1; ``behind``: how many times less likely each
    ``equivalent`` is (none: all are as likely); ``in_file``: the place by the numbers of the file,
    where the mesh that was diagnosed has others.
    """

    physics: str
    place: Place
    title: str
    parameters: Mapping[str, float]
    deviations: Mapping[str, float]
    noise_deviations: Mapping[str, float]
    confidence: float
    explains: float
    equivalent: tuple[Effect, ...]
    says: str
    behind: tuple[float, ...] = ()
    in_file: Place | None = None

    @classmethod
    def of(
        cls,
        effect: Effect,
        values: Mapping[str, float],
        spread: Mapping[str, float],
        confidence: float,
        *,
        noise: Mapping[str, float] | None = None,
        explains: float = 1.0,
        equivalent: tuple[Effect, ...] = (),
        behind: tuple[float, ...] = (),
    ) -> Finding:
        """An effect with its figures as found, in its own words; ``spread``: their deviations, of
        noise alone (``noise``) the same where none are given."""
        return cls(
            effect.physics,
            effect.place,
            effect.title,
            values,
            spread,
            spread if noise is None else noise,
            confidence,
            explains,
            equivalent,
            in_words(effect, values, spread) + or_elsewhere(effect, confidence, equivalent, behind),
            behind,
        )

    @property
    def alternatives(self) -> tuple[str, ...]:
        """The equivalents in words that are about as likely as what is found."""
        return tuple(e.title for e, odds in self._weighed() if odds < np.exp(AS_LIKELY))

    @property
    def unlikelier(self) -> tuple[str, ...]:
        """Those against which the recordings say something, but nothing strong."""
        return tuple(
            f"{e.title} ({odds:.0f} times less likely)"
            for e, odds in self._weighed()
            if odds >= np.exp(AS_LIKELY)
        )

    def _weighed(self) -> list[tuple[Effect, float]]:
        odds = self.behind or (1.0,) * len(self.equivalent)
        return list(zip(self.equivalent, odds, strict=True))

    def to_json(self) -> dict[str, Any]:
        """The contract's entry of ``findings``."""
        return {
            "physics": self.physics,
            "location": (self.in_file or self.place).to_json(),
            "parameters": dict(self.parameters),
            "standard_deviation": dict(self.deviations),
            "noise_deviation": dict(self.noise_deviations),
            "confidence": self.confidence,
            "explains": self.explains,
            "equivalent": [
                {"physics": e.physics, "location": e.place.to_json(), "odds": round(odds, 2)}
                for e, odds in self._weighed()
            ],
            "says": self.says,
        }


@dataclass(frozen=True)
class Updated:
    """A diagnosed model, for the problem file: its parameters ``p``, and beside them modal
    damping ratios ``zeta`` of the flexible modes, a decay rate ``alpha`` (1/s) of all modes,
    sensor ``faults`` with their unknowns, the flexible mode of each row of each table
    (``pairs``), the share of that damping that is ``hysteretic``, the parts of each edge on which
    the model is to be taken (``refine``; None: as the file says) and what its sheets have of solids
    there."""

    model: Model
    p: Real
    zeta: Real | None = None
    alpha: float | None = None
    faults: tuple[tuple[Fault, float], ...] = ()
    pairs: Mapping[int, Sequence[int]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    hysteretic: float = 0.0
    refine: int | None = None
    solid: bool | Literal["sheared", "turning"] = True


@dataclass(frozen=True)
class Damper:
    """An effect that explains a pattern of damping: its size in units of its parameter with
    deviation, the strain that it leaves, and at how many ``places`` its type was tried;
    ``pattern``: what one unit of it does to each ratio and imaginary part, in units of their
    scatter."""

    effect: Effect
    size: float
    deviation: float
    strain: float
    places: int = 1
    pattern: Real = field(default_factory=lambda: np.zeros(0))

    def acts_like(self, other: Damper, least: float) -> bool:
        """Whether the same effect at another place of its kind does the same to all that was
        measured, to a squared cosine of ``least``."""
        mine, its = self.effect, other.effect
        kinds = [(e.physics, e.place.dof, len(e.place.nodes), e.place.groups) for e in (mine, its)]
        across = float(self.pattern @ other.pattern) if len(self.pattern) else 0.0
        norms = float(self.pattern @ self.pattern) * float(other.pattern @ other.pattern)
        return kinds[0] == kinds[1] and across > 0.0 and across**2 >= least * norms


@dataclass(frozen=True)
class Gain:
    """How many times too large a sensor reads (``how``: "gain"), or all responses to some drives
    seem ("force"), with deviation and probability; the ``channels`` by their labels."""

    how: str
    channels: tuple[str, ...]
    value: float
    deviation: float
    confidence: float


@dataclass(frozen=True)
class Further:
    """What the evidence says beside its search: one rate of decay ``alpha`` (1/s, with deviation)
    of all modes, with its probability ``sure``; or the ``strain`` of the pattern of damping ratios
    of so many ``modes`` against what is ``known`` of them (with that of imaginary parts of shapes,
    where these are complex beyond chance: how many and their squares, ``turned``), and what brings
    it down by more than chance, best first; ``most``: the strain of ratios that chance leaves at
    the worst. Of modes that were identified from FRFs, ``gains`` of channels, and what speaks
    against a model that explains their frequencies and shapes (``against``, in words; empty:
    nothing); whether modal constants, which were not fitted, bear that model out (``borne_out``),
    and of recordings that were held out among them (``foretold``); of a model with nothing added,
    whether they are its own (``met``)."""

    lines: tuple[str, ...] = ()
    alpha: tuple[float, float] | None = None
    strain: float = 0.0
    modes: int = 0
    dampers: tuple[Damper, ...] = ()
    sure: float = 0.0
    known: str = "the file's pattern"
    most: float = float("inf")
    gains: tuple[Gain, ...] = ()
    against: str = ""
    borne_out: bool = False
    foretold: bool = False
    met: bool = False
    turned: tuple[int, float] = (0, 0.0)
