"""What an effect is: a type of physics at a place, and what it does there: a change of the model, a
hidden oscillator, a fault of channels, an internal force that no matrix says (`Action`)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank
from cvxupdate.physics.draft import Writer
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place, at
from cvxupdate.physics.planting import Planted, Planting
from cvxupdate.physics.quantity import Quantity as Quantity

RESPONSES, MODES, RATIOS, MOTION = "responses", "modes", "damping ratios", "motion"
TUNED = (0.8, 1.1)  # of the band's bottom and top: a hidden oscillator beyond is a spring or a mass
EXCHANGED = 0.1  # largest departure of an exchange's gain from 1
LIGHTEST, HEAVIEST = 1e-4, 0.2  # of the structure's mass: a hidden oscillator's


class EffectType(ABC):
    """One kind of physics: all that is particular to it.

    ``name`` is the contract's, ``noun`` what it is in a sentence; ``damping``: it only takes out
    energy; ``unlimited``: beyond some size more of it changes nothing; ``total``: its bound is all
    there is of it; ``rig``: hardly a test is without it (only so, where not ``sought``); ``mount``:
    a structure stands on it or hangs from it; ``theory``: programs have or leave it out;
    ``told_by`` which recordings tell it (motion: those whose level counts); ``writers`` how what
    it adds is written, by the kind of element.
    """

    name: ClassVar[str]
    noun: ClassVar[str]
    damping: ClassVar[bool] = False
    unlimited: ClassVar[bool] = False
    total: ClassVar[bool] = False
    rig: ClassVar[bool] = False
    mount: ClassVar[bool] = False
    theory: ClassVar[bool] = False
    sought: ClassVar[bool] = True
    told_by: ClassVar[frozenset[str]] = frozenset({RESPONSES, MODES})
    writers: ClassVar[tuple[tuple[str, Writer], ...]] = ()

    @abstractmethod
    def candidates(self, context: SearchContext) -> list[Effect]:
        """The effect at every place where it can stand, with its matrices, bounds and signs."""

    def at(self, place: Place, context: SearchContext) -> Sequence[Effect]:
        """All, or without those elsewhere where each takes long."""
        return self.candidates(context)

    @abstractmethod
    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """One sentence that a technician understands; ``values`` are the contract's figures."""

    def sizeless(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The sentence of what is there without a size that is told; "" where nothing is."""
        return ""

    def plainly(self, values: Mapping[str, float], deviations: Mapping[str, float]) -> bool:
        """Whether figures say no more than those of a plainer effect at the same place do."""
        return False


@dataclass(frozen=True, eq=False)
class ModelChange:
    """Parameters on the model, which are zero where it has no effect.

    ``grow`` makes the `model` that carries them last; ``tangent`` gives for each its derivative
    blocks on the DOFs of the model without them. ``members`` are the elements of a set;
    ``additive``: K and M move in proportion, and those of a set as the sum of its members';
    ``series``: a compliance beside that of its place: sizes p act as p / (1 + p); ``cubic``:
    stiffness goes with (1 + p)³; ``along``: its directions at any size, where the tangent does not
    tell; ``start``: all its unknowns from the size of the first; ``others``: further starts;
    ``nodes`` on which it acts, of the whole structure, where they are known.
    """

    grow: Callable[[], Model]
    tangent: tuple[tuple[DerivativeBlock, ...], ...]
    members: tuple[int, ...] = ()
    additive: bool = False
    series: bool = False
    cubic: bool = False
    along: LowRank | None = None
    start: Callable[[float], Real] | None = None
    others: Callable[[Real], Sequence[Real]] | None = None
    nodes: tuple[int, ...] = ()

    @cached_property
    def model(self) -> Model:
        """Made when it is first asked for: most candidates are only screened."""
        return self.grow()

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.tangent)

    columns = count  # all are parameters of the model

    @property
    def detail(self) -> tuple[Hashable, ...]:
        """What tells it from others at its place."""
        return ()

    def label(self, place: Place) -> str:
        """Where, for tables."""
        return f"at {place.short}"

    def stiffness_of(self, sizes: Real) -> Real:
        """What K moves by, in units of the tangent's, where M moves by ``sizes``."""
        return ((1.0 + sizes) ** 3 - 1.0) / 3.0 if self.cubic else sizes

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """Whatever its size."""
        return True

    def plant(self, effect: Effect, model: Model, guess: Real, delay_unit: float) -> Planted:
        """On the model that it was made for."""
        start = guess if len(guess) == self.count else np.zeros(self.count)
        return Planted(effect, self.model, start)

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """The candidate of the same kind at the same place of another model."""
        there = effect.type.at(effect.place, context)
        return next((o for o in there if o.key == effect.key), None)


@dataclass(frozen=True, eq=False)
class HiddenOscillator:
    """A mass on a spring and dashpot at a DOF (``row``), tuned to ``frequency`` (Hz) with damping
    ratio ``zeta`` (0: no dashpot); ``attach`` makes the model; ``mass`` (kg) is what its parameters
    are relative to, 0 until it is planted."""

    row: int
    frequency: float
    zeta: float
    attach: Callable[[Model, int, float, float, float], Model]
    mass: float = 0.0

    detail: ClassVar[tuple[Hashable, ...]] = ()  # its tuning is refined in the fit

    @property
    def count(self) -> int:
        """Number of unknowns: mass, stiffness and, where there is one, dashpot."""
        return 3 if self.zeta > 0.0 else 2

    columns = count  # all are parameters of the model

    def label(self, place: Place) -> str:
        """Where, for tables."""
        return f"at {place.short}"

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """Tuned inside the band: below it is a spring to nothing, above it a mass."""
        tuned = np.sqrt(max(values["k"], 0.0) / max(values["m"], 1e-12)) / (2.0 * np.pi)
        return bool(TUNED[0] * bottom <= tuned <= TUNED[1] * top)

    def plant(self, effect: Effect, model: Model, guess: Real, delay_unit: float) -> Planted:
        """On any model; its first-order size is its mass, the parameters begin at zero."""
        whole = max(model.total_mass(), 1e-9)
        mass = self.mass or float(np.clip(guess[0], LIGHTEST * whole, HEAVIEST * whole))
        grown = self.attach(model, self.row, self.frequency, mass, self.zeta)
        return Planted(
            replace(effect, action=replace(self, mass=mass)), grown, np.zeros(self.count)
        )

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """The same tuning at the same DOF of another model."""
        row = context.model.place.get(f"n{effect.place.nodes[0]}.{effect.place.dof}")
        return None if row is None else replace(effect, action=replace(self, row=row))


@dataclass(frozen=True, eq=False)
class ChannelFault:
    """One or two channels are wrong, the structure is not."""

    fault: Fault

    count: ClassVar[int] = 1
    columns: ClassVar[int] = 0

    @property
    def detail(self) -> tuple[Hashable, ...]:
        """Which channels, and what they suffer from."""
        return (self.fault.how, *self.fault.labels)

    def label(self, place: Place) -> str:
        """Where, for tables."""
        return f"({self.fault.how}) at {self.fault.spot}"

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """An exchange is one in full or none."""
        return self.fault.how != "swap" or abs(values["gain"] - 1.0) <= EXCHANGED

    def plant(self, effect: Effect, model: Model, guess: Real, delay_unit: float) -> Planted:
        """Beside any model; an exchange begins as a whole one."""
        begun = 0.0 if self.fault.how == "swap" else float(guess[0])
        return Planted(effect, model, np.zeros(0), replace(self.fault, unit=delay_unit), begun)

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """Channels are what they are."""
        return effect


Action = ModelChange | HiddenOscillator | ChannelFault | Planting


@dataclass(frozen=True, eq=False)
class Effect:
    """An effect type at a place: ``figures`` are reported; ``sign`` +1 where its first unknown is
    not negative; ``limits`` bound each unknown; ``spot``: where, in words (empty: its place's)."""

    type: EffectType
    place: Place
    action: Action
    figures: tuple[Quantity, ...]
    sign: int = 0
    limits: tuple[float, float] = (0.0, 0.0)
    spot: str = ""

    @property
    def physics(self) -> str:
        """The contract's name of it."""
        return self.type.name

    @property
    def key(self) -> tuple[Hashable, ...]:
        """What it is and where: effects of one key are the same hypothesis."""
        return (self.physics, self.place, *self.action.detail)

    @property
    def name(self) -> str:
        """A short label, for tables and progress."""
        return f"{self.physics} {self.action.label(self.place)}"

    @property
    def title(self) -> str:
        """ "an added mass at node 5 (x)"."""
        return f"{self.type.noun} {self.spot or at(self.place)}"

    @property
    def count(self) -> int:
        """Number of its unknowns."""
        return self.action.count

    @property
    def columns(self) -> int:
        """How many of them are parameters of the model; none of a channel's fault."""
        return self.action.columns

    @property
    def change(self) -> ModelChange | None:
        """Its action where that is a change of the model."""
        return self.action if isinstance(self.action, ModelChange) else None

    @property
    def fault(self) -> Fault | None:
        """Its fault where it is one of channels."""
        return self.action.fault if isinstance(self.action, ChannelFault) else None

    def says(self, values: Mapping[str, float]) -> str:
        """The sentence, with its figures."""
        return self.type.says(self, values)

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """False where another effect says it better (band in Hz)."""
        return self.action.tenable(values, bottom, top)

    def on(self, context: SearchContext) -> Effect | None:
        """The same effect on another model; None where it cannot stand there."""
        return self.action.moved(self, context)

    def reported(
        self,
        model: Model,
        parameters: Sequence[Parameter | None],
        x: Sequence[float] | Real,
        dx: Sequence[float] | Real,
        unit: float = 1.0,
    ) -> tuple[dict[str, float], dict[str, float]]:
        """The contract's figures and deviations, of unknowns ``x`` (count,) with deviations ``dx``;
        ``parameters`` are their own on ``model``, ``unit`` the seconds of a delay."""
        values, deviations = dict[str, float](), dict[str, float]()
        for q in self.figures:
            own = parameters[q.index] if parameters else None
            size, deviation = float(x[q.index]), float(dx[q.index])
            values[q.name], deviations[q.name] = q.value(model, own, size, deviation, unit)
        return values, deviations
