"""Evidence, fits and effects of plain figures: what a rule is tried on without a structure behind
it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.results import Further
from cvxupdate.diagnose.settings import CLEAR
from cvxupdate.diagnose.types import Errors, Score
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.terms import Real
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import ChannelFault, Effect, EffectType, ModelChange
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place, at, channel_place
from cvxupdate.physics.quantity import factor
from tests.cases.three_masses import chain

CHAIN: Model = chain()
SMALL, LARGE, NOMINAL = Errors(0.01, 0.01), Errors(0.5, 0.5), Errors(0.6, 0.6)
NAN = float("nan")


@dataclass(frozen=True)
class PlainType(EffectType):
    """An effect type that can stand nowhere by itself."""

    name: str = "stiffness_change"  # type: ignore[misc]
    noun: str = "a change"  # type: ignore[misc]
    damping: bool = False  # type: ignore[misc]

    def candidates(self, context: SearchContext) -> list[Effect]:
        return []

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        return f"A factor {next(iter(values.values())):.3g} {at(effect.place)}."


@dataclass(frozen=True)
class RigType(PlainType):
    """What a rig does."""

    rig: bool = True  # type: ignore[misc]


def no_model() -> Model:
    raise ModelError("this effect has no model.")


def effect(
    name: str = "stiffness_change", count: int = 1, damping: bool = False, **place: Any
) -> Effect:
    """An effect with ``count`` unknowns at a place (node 1 where none is named); its figure is a
    factor."""
    type_ = PlainType(name, f"some {name.replace('_', ' ')}", damping)
    change = ModelChange(no_model, ((),) * count)
    return Effect(type_, Place(**(place or {"nodes": (1,)})), change, (factor(),))


def rig(name: str = "sensor_mass", **place: Any) -> Effect:
    """What a rig does, with one unknown."""
    return replace(effect(name, **place), type=RigType(name, "what a rig does"))


def fault(channel: str) -> Effect:
    """A wrong gain."""
    action = ChannelFault(Fault(channel, "gain"))
    return Effect(PlainType("sensor_fault"), channel_place(channel), action, (factor("gain"),))


def parameter(name: str, of: str = "stiffness", group: str | None = None, upper: float = 1.0):
    return Parameter(name, of, (), -upper, upper, 0.0, 1.0, "1", (1, 2), group)


@dataclass(frozen=True)
class PlainModel:
    """Parameters, and nothing that they move."""

    parameters: tuple[Parameter, ...] = ()


@dataclass(frozen=True)
class PlainSetting:
    """Nothing that is compared."""

    model: PlainModel = PlainModel()
    faults: tuple[Fault, ...] = ()
    level: int = 0

    @property
    def columns(self) -> tuple[str, ...]:
        return (*(q.name for q in self.model.parameters), *(f.label for f in self.faults))

    @property
    def scales(self) -> Real:
        return np.ones(len(self.columns))


UNASKED = Errors(float("nan"), float("nan"))


@dataclass(frozen=True)
class PlainFit:
    """Figures of a fit; ``excess`` is the misfit where none is given."""

    misfit: float
    beyond_noise: float | None = None
    damping_strain: float = 0.0
    errors: Errors = SMALL
    rows: int = 1000
    independent: float = 20.0
    p: np.ndarray = field(default_factory=lambda: np.zeros(0))
    deviations: np.ndarray = field(default_factory=lambda: np.zeros(0))
    setting: PlainSetting = PlainSetting()
    between_levels: Errors = UNASKED
    point: Any = None
    spent: bool = False
    noise_alone: float = 0.0

    @property
    def excess(self) -> float:
        return self.misfit if self.beyond_noise is None else self.beyond_noise

    @property
    def free(self) -> float:
        return self.independent

    def spare(self, first: int) -> float:
        return self.rows - first

    @property
    def cost(self) -> float:
        return self.misfit * self.rows

    @property
    def log_evidence(self) -> float:
        """Of a discrepancy as large as the misfit."""
        return -0.5 * self.independent * float(np.log(self.misfit))

    @property
    def noise_deviations(self) -> np.ndarray:
        return 0.5 * self.deviations


@dataclass(frozen=True)
class PlainEvidence:
    """Explained below ``limit`` of the misfit; `wide` is ``far`` where that is not None; a
    hypothesis of sensor faults evaluated is looked up in ``alone`` by its channels; nothing but
    nuisance parameters, fitted again, are ``beside`` where that is not None."""

    bases: tuple[PlainFit, ...] = (PlainFit(100.0, errors=LARGE),)
    nominal: Errors = NOMINAL
    noise: Errors = SMALL
    limit: float = 4.0
    file: Model | None = None
    mesh: float = 0.0
    far: PlainFit | None = None
    beside: PlainFit | None = None
    alone: Mapping[tuple[str, ...], PlainFit] = field(default_factory=dict)
    levels: int = 4
    model: Model = CHAIN
    told_by: str = "responses"
    names: tuple[str, ...] = ("stiffness_change", "added_mass")
    delay_unit: float = 1.0
    band: tuple[float, float] = (5.0, 75.0)
    hurried: bool = False
    jobs: int = 1
    unfinished: bool = False
    odd: str = ""
    stocky: bool = False
    resonances: int = 0
    drift: str | None = None
    approach: None = None
    next: bool = False
    everything: Sequence[Effect] = ()  # all candidates
    neighbours: Sequence[Effect] = ()
    one: Sequence[Effect] = ()  # and those that nothing tells apart
    undone: list[str] = field(default_factory=list)
    besides: Further = field(default_factory=Further)

    def further(self, fit: PlainFit) -> Further:
        return self.besides

    def by_modes(self, fewest: int = 0) -> None:
        return None

    def candidates(self, model: object, names: Sequence[str] | None = None) -> list[Effect]:
        return list(self.everything)

    def context(self, model: object) -> None:
        """Nothing stands on another model."""
        return

    def errors(self, fit: PlainFit) -> Errors:
        return fit.errors

    def leave(self, what: str, count: int = 0) -> None:
        self.undone.append(what)

    def held_out(self, fit: PlainFit) -> float:
        return 0.0

    def between_levels(self, fit: PlainFit) -> Errors:
        return fit.between_levels

    def apart(self, one: PlainFit, other: PlainFit, titles: tuple[str, str]) -> str:
        return f"Between {titles[0]} and {titles[1]}, measure." if self.next else ""

    def alike(self, fit: PlainFit, effect: Effect, strictly: bool = False) -> Sequence[Effect]:
        return self.one if strictly else self.neighbours

    def relative(self, errors: Errors) -> float:
        return errors.worst

    def allowance(self, model: object) -> float:
        return self.mesh

    def explained(self, fit: PlainFit, errors: Errors) -> bool:
        return fit.misfit <= self.limit

    def departs(self, fit: PlainFit) -> str:
        return self.odd

    def clear(self, fit: PlainFit) -> bool:
        return fit.excess <= CLEAR

    def wide(self) -> PlainFit:
        if self.far is None:
            raise ModelError("no structure.")
        return self.far

    def left(self, errors: Errors) -> str:
        held = "" if np.isnan(errors.hold_out) else f" and {errors.hold_out:.3g} (held out)"
        return f"{errors.fit:.3g} of the response{held}"

    def remains(self, fit: PlainFit) -> str:
        return "" if fit.misfit <= 1.0 else f"What is left is {fit.misfit:.3g}."

    def lines(self) -> list[str]:
        return ["A line of the evidence."]

    def setting(self, model: object, faults: Sequence[Fault], like: Any = None) -> PlainSetting:
        return PlainSetting(PlainModel(), tuple(faults))

    def at_level(self, setting: PlainSetting, level: int) -> PlainSetting:
        return replace(setting, level=level)

    def evaluated(self, setting: PlainSetting, p: np.ndarray) -> PlainFit:
        channels = tuple(f.channel for f in setting.faults)
        return self.alone[channels] if channels else self.bases[-1]

    def fitted(self, seed: Any, effort: str) -> PlainFit:
        channels = tuple(e.fault.channel for e in seed.effects if e.fault is not None)
        if channels:
            return supposed(self.alone[channels], *seed.effects).fit  # type: ignore[return-value]
        return self.bases[-1] if self.beside is None else self.beside


def supposed(
    fit: PlainFit, *effects: Effect, size: float | Sequence[float] = 0.5, std: float = 0.01
) -> Hypothesis:
    """Effects with a fit, each unknown ``size`` large (or one for each) with deviation ``std``."""
    columns = sum(e.columns for e in effects)
    faults = tuple(e.fault for e in effects if e.fault is not None)
    setting = PlainSetting(PlainModel(tuple(parameter(f"q{k}") for k in range(columns))), faults)
    p = np.full(len(setting.columns), size)
    return Hypothesis(effects, replace(fit, p=p, deviations=0.0 * p + std, setting=setting))  # type: ignore[arg-type]


def weighed(fit: PlainFit, *effects: Effect, freed: int = 0, **sizes: Any) -> Weighed:
    """A hypothesis with the errors of its fit."""
    return Weighed(supposed(fit, *effects, **sizes), fit.errors, freed)


def case_of(evidence: PlainEvidence, damping_only: bool = False) -> Case:
    """What judgements compare with."""
    return Case(evidence, weighed(evidence.bases[-1]), damping_only)  # type: ignore[arg-type]


def score(e: Effect, fraction: float, trusted: bool = True, exact: bool = False) -> Score:
    """A score with sizes of a tenth."""
    return Score(e, fraction, np.full(e.count, 0.1), exact, trusted)
