"""Effects on a model: planting words on a parent that may carry others already, taking one out
again, and the figures that were found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from cvxupdate.diagnose.data import Data
from cvxupdate.diagnose.fit import Fit, fitted_at, prior_scales, setting_for
from cvxupdate.diagnose.residual import Setting
from cvxupdate.diagnose.screen import Score, delay_unit
from cvxupdate.diagnose.shortlist import Key
from cvxupdate.diagnose.signals import Real, Signal
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect as Candidate
from cvxupdate.physics.effect import plant
from cvxupdate.physics.fault import Fault


@dataclass(frozen=True)
class Effect:
    """A candidate planted on a model."""

    candidate: Candidate

    @property
    def key(self) -> Key:
        """What it is and where: two effects of one key are the same hypothesis (a hidden
        oscillator's tuning is refined in the fit)."""
        return self.candidate.key

    @property
    def columns(self) -> int:
        """Parameters on the model (a sensor fault has none there)."""
        return self.candidate.columns


@dataclass(frozen=True)
class Trial:
    """A model with effects, fitted (or about to be: ``start``)."""

    effects: tuple[Effect, ...]
    fit: Fit

    @property
    def keys(self) -> frozenset[Key]:
        """The set of what is supposed."""
        return frozenset(e.key for e in self.effects)

    @property
    def extra(self) -> int:
        """Parameters beyond the ordinary ones."""
        return sum(e.candidate.count for e in self.effects)

    @property
    def name(self) -> str:
        """For progress and tables."""
        return " and ".join(e.candidate.name for e in self.effects) or "ordinary parameters"

    @cached_property
    def figures(self) -> list[tuple[dict[str, float], dict[str, float]]]:
        """`figures`, worked out once: they need a linearisation."""
        return figures(self)


@dataclass(frozen=True)
class Hypothesis:
    """Effects planted, where the fit of them begins."""

    effects: tuple[Effect, ...]
    setting: Setting
    start: Real

    @property
    def keys(self) -> frozenset[Key]:
        """The set of what is supposed."""
        return frozenset(e.key for e in self.effects)

    @property
    def name(self) -> str:
        """For progress."""
        return " and ".join(e.candidate.name for e in self.effects)


@dataclass(frozen=True)
class Bench:
    """What stays fixed while hypotheses come and go: the file's model (for its damping), the
    ordinary one, recordings, supports, allowed words.

    ``release(node, kind)`` is the ordinary model without one support; ``zeta`` a typical damping
    ratio.
    """

    original: Model
    ordinary: Model
    data: Data
    supports: tuple[tuple[int, str], ...]
    release: Callable[[int, str], Model]
    words: tuple[str, ...]
    sensors: tuple[str, ...]
    zeta: float

    @cached_property
    def _freed(self) -> Callable[[int, str], Model]:
        """`release`, each support once."""
        return cache(self.release)

    def context(self, model: Model) -> SearchContext:
        """For placing words on ``model``, which is the ordinary one or grown from it."""
        m = model.matrices(model.zero())

        def released(node: int, kind: str) -> Model:
            return regrown(self._freed(node, kind), model)

        held = tuple((n, k) for n, k in self.supports if f"n{n}.{k}" not in model.place)
        return SearchContext(
            model,
            m.K,
            m.M,
            self.data.top,
            self.data.bottom,
            self.sensors,
            held,
            released,
            self.zeta,
            tuple(label for s in self.data.sharp if s.order == 2 for label in s.sensors),
        )

    def candidates(self, model: Model, words: Sequence[str] | None = None) -> list[Candidate]:
        """Every word at every place on ``model``."""
        return candidates_of(self.context(model), self.words if words is None else words)

    def setting(self, model: Model, signals: Sequence[Signal], faults: Sequence[Fault]) -> Setting:
        """The unknowns of ``model`` against ``signals``."""
        return setting_for(
            model,
            self.original,
            signals,
            self.data.top,
            self.data.bottom,
            faults,
            self.data.mesh_of(model),
        )


def regrown(released: Model, grown: Model) -> Model:
    """``grown`` (the ordinary model with physics added) on the DOFs of ``released`` (the ordinary
    model with a support set free)."""
    extra = [i for i, label in enumerate(grown.labels) if label not in released.place]
    labels = (*released.labels, *(grown.labels[i] for i in extra))
    place = {label: i for i, label in enumerate(labels)}
    to = np.array([*(place[label] for label in grown.labels), -1], dtype=np.int64)
    blocks = tuple(
        replace(
            b,
            dofs=np.where(b.dofs >= 0, to[b.dofs], released.blocks[k].dofs)
            if k < len(released.blocks)
            else to[b.dofs],
        )
        for k, b in enumerate(grown.blocks)
    )
    return replace(
        grown,
        labels=labels,
        dof_node=np.append(released.dof_node, grown.dof_node[extra]),
        dof_kind=np.append(released.dof_kind, grown.dof_kind[extra]),
        blocks=blocks,
    )


def planted(bench: Bench, parent: Trial, score: Score, signals: Sequence[Signal]) -> Hypothesis:
    """A further effect on a fitted parent, from its first-order size."""
    base, faults = parent.fit.setting.model, parent.fit.setting.faults
    put = plant(score.candidate, base, score.p, delay_unit(parent.fit.point))
    model, guess = put.model, put.start
    faults = faults if put.fault is None else (*faults, put.fault)
    setting = bench.setting(model, signals, faults)
    n, known = len(base.parameters), len(parent.fit.setting.faults)
    start = np.zeros(len(setting.columns))
    start[:n] = parent.fit.p[:n]
    fresh = model.parameters[n:]
    if fresh and len(guess) == len(fresh):
        lower, upper = (np.array([getattr(q, side) for q in fresh]) for side in ("lower", "upper"))
        nearest, farthest = (
            (lower, upper) if score.exact else (np.maximum(lower, -0.5), np.minimum(upper, 5.0))
        )
        start[n : n + len(fresh)] = np.clip(guess, nearest, farthest)
    if faults:
        tail = start[len(start) - len(faults) :]
        tail[:known] = parent.fit.p[len(parent.fit.p) - known :]
        if len(faults) > known:
            tail[known] = put.fault_start
    return Hypothesis((*parent.effects, Effect(put.effect)), setting, start)


def replanted(bench: Bench, model: Model, effect: Effect) -> tuple[Effect, Model] | None:
    """The same effect on another model; None where it cannot stand there."""
    c = effect.candidate.on(bench.context(model))
    if c is None:
        return None
    put = plant(c, model, np.zeros(c.count), 1.0)
    return Effect(put.effect), put.model


def as_drawn(bench: Bench, setting: Setting, p: Real) -> Real:
    """Unknowns with the effects' as they are, the ordinary ones and damping as the file has them:
    what is missing bends these, and where they truly lie, near the drawing, a fit finds its way and
    the next effect shows more clearly."""
    out = p.copy()
    out[: len(bench.ordinary.parameters)] = 0.0
    out[len(setting.model.parameters) : len(p) - len(setting.faults)] = 0.0
    return out


def unbent(bench: Bench, trial: Trial, signals: Sequence[Signal]) -> Trial:
    """The trial with unknowns `as_drawn`, against ``signals``; as fitted where that would be no
    structure."""
    setting = replace(trial.fit.setting, signals=tuple(signals))
    try:
        point = setting.evaluate(as_drawn(bench, setting, trial.fit.p))
    except ModelError:
        point = setting.evaluate(trial.fit.p)
    return Trial(trial.effects, fitted_at(setting, point))


def without(bench: Bench, trial: Trial, index: int) -> Trial | None:
    """The fitted trial with one effect taken out and everything else left where it was: what the
    rest alone leaves unexplained."""
    found, setting = trial.fit, trial.fit.setting
    ordinary = len(bench.ordinary.parameters)
    model = bench.ordinary
    values = list(found.p[:ordinary])
    effects: list[Effect] = []
    faults: list[Fault] = []
    fault_values: list[float] = []
    at, fault = ordinary, len(found.p) - len(setting.faults)
    for k, effect in enumerate(trial.effects):
        if effect.candidate.fault is not None:
            if k != index:
                faults.append(setting.faults[fault - (len(found.p) - len(setting.faults))])
                fault_values.append(float(found.p[fault]))
                effects.append(effect)
            fault += 1
            continue
        own = found.p[at : at + effect.columns]
        at += effect.columns
        if k == index:
            continue
        moved = replanted(bench, model, effect)
        if moved is None:
            return None
        effects.append(moved[0])
        model = moved[1]
        values += list(own)
    again = bench.setting(model, setting.signals, faults)
    p = np.zeros(len(again.columns))
    p[: len(values)] = values
    damping = found.p[len(setting.model.parameters) : len(found.p) - len(setting.faults)]
    room = len(p) - len(values) - len(faults)
    p[len(values) : len(values) + min(room, len(damping))] = damping[:room]
    if faults:
        p[len(p) - len(faults) :] = fault_values
    try:
        return Trial(tuple(effects), fitted_at(again, again.evaluate(p)))
    except ModelError:
        return None


def figures(trial: Trial) -> list[tuple[dict[str, float], dict[str, float]]]:
    """For every effect: the contract's parameters and their deviations (linearised, grown with the
    misfit)."""
    found = trial.fit
    setting, p = found.setting, found.p
    A, _ = found.point.system().weighted()
    scales = prior_scales(setting)
    H = A.T @ A + np.diag(1.0 / scales**2)
    grow = max(1.0, found.cost / max(1, len(A) - len(p)))
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(H)), 0.0) * grow)
    at = len(setting.model.parameters) - sum(e.columns for e in trial.effects)
    fault = len(p) - sum(e.candidate.fault is not None for e in trial.effects)
    out = []
    for effect in trial.effects:
        c = effect.candidate
        first = at if c.columns else fault
        own = slice(first, first + c.count)
        unit = setting.faults[fault - len(p)].unit if c.fault is not None else 1.0
        fresh = setting.model.parameters[own] if c.columns else ()
        out.append(c.reported(setting.model, fresh, p[own], spread[own], unit))
        at += effect.columns
        fault += c.fault is not None
    return out
