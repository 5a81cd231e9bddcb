"""What model and reference state disagree on, mode by mode: common to both states, so it is taken
out of the tables of the other one, as the mesh's error is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cvxupdate.diagnose.modes.mixing import mixed
from cvxupdate.diagnose.settings import (
    COMMON,
    REPEATED,
    SHAPE_REPEATED,
    SHAPES_OFF,
    UNSTATED_SHAPE,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint, modal_residual
from cvxupdate.residual.shape_rows import channel_rows, real_shapes

ALIKE = 0.5  # MAC of a measured shape with the model's below which they are not of one mode


@dataclass(frozen=True)
class OneMode:
    """Of one mode of the model at the reference: measured over modelled frequency, less 1, with its
    deviation; the measured shape less the model's, both scaled to the model's largest entry of 1,
    and its deviation, for each DOF label; the measured damping ratio with its deviation (fractions
    of critical, NaN where none was)."""

    shift: float
    deviation: float
    shape: Mapping[str, tuple[float, float]]
    damping: tuple[float, float] = (float("nan"), float("nan"))


@dataclass(frozen=True)
class Common:
    """`OneMode` of every mode (its place among all of the model) that the reference has; ``open``:
    the part of any change that the model may get wrong, for the farther its frequencies are off,
    the more are its shapes, and with them what a change does. ``later``: modes that only held-out
    tables of the reference have, for what is held out of the other state."""

    modes: Mapping[int, OneMode]
    open: float
    later: Mapping[int, OneMode] = field(default_factory=dict)

    @property
    def held(self) -> Common:
        """For tables that are held out."""
        return replace(self, modes={**self.later, **self.modes})

    def without(self, table: ModeTable, places: Sequence[int], point: ModalPoint) -> ModeTable:
        """A table as a structure would have it that at the reference is what the model says, with
        deviations; modes that the reference does not have, and those that are paired with one of
        its modes but look like another (what came with a hidden oscillator), stay as they are, with
        NaN for the deviation that the reference brings (of shapes: where it has no such entry)."""
        f, std = table.frequency.copy(), np.full(len(table.frequency), np.nan)
        shapes = None if table.shapes is None else real_shapes(table.shapes).copy()
        spread = None if shapes is None else np.full(shapes.shape, np.nan)
        for i, at in enumerate(places):
            known = self.modes.get(int(at))
            if known is None or unlike(table, i, int(at), point):
                continue
            moved = self.open * abs(table.frequency[i] / _own(point, int(at)) - 1.0 - known.shift)
            f[i] = table.frequency[i] / (1.0 + known.shift)
            std[i] = f[i] * float(np.hypot(known.deviation, moved))
            if shapes is not None and spread is not None:
                shapes[i], spread[i] = _bent(table, shapes[i], known, int(at), point)
        return replace(table, frequency=f, frequency_std=std, shapes=shapes, shape_std=spread)

    def damping(self, places: Sequence[int]) -> Real:
        """Damping ratios and their deviations of the modes at some places, (2, places); NaN where
        the reference has none."""
        nothing = OneMode(0.0, 0.0, {})
        return (
            np.array([self.modes.get(int(at), nothing).damping for at in places]).reshape(-1, 2).T
        )


def common_of(model: Model, tables: Sequence[ModeTable]) -> Common:
    """Of the tables of the reference (deviations stated, the mesh's error taken out) beside a model
    as it stands; of a mode that several have, the first."""
    fit, hold = ([t for t in tables if (t.origin.use == "fit") == use] for use in (True, False))
    point = modal_residual(model, fit, hold, False).evaluate(model.zero())
    found: dict[int, OneMode] = {}
    later: dict[int, OneMode] = {}
    for k, table in enumerate((*fit, *hold)):
        turned = mixed(point, k, table, missed=0.0)
        for i, at in enumerate(point.places[k].tolist()):
            if at < 0 or at in found or at in later:
                continue
            shift = float(table.frequency[i] / _own(point, at)) - 1.0
            own = float(table.frequency_std[i] / table.frequency[i])
            deviation = float(np.sqrt(own**2 + REPEATED**2 + (COMMON * shift) ** 2))
            zeta = float(table.damping[i]), float(table.damping_std[i])
            one = OneMode(shift, deviation, _shape_of(table, i, at, point, turned[i]), zeta)
            (found if k < len(fit) else later)[at] = one
    off = float(np.sqrt(np.mean([m.shift**2 for m in found.values()]))) if found else 0.0
    return Common(found, min(1.0, COMMON + SHAPES_OFF * off), later)


def its_modes(start: ModalPoint, k: int, table: ModeTable) -> list[int]:
    """Modes of the model that those of a table are paired with; of a table that is held out by
    itself, for what came with a hidden oscillator stands for one of the model's in those that were
    fitted, and the reference may have that one in what is held out."""
    if k >= len(start.residual.fit):
        start, k = modal_residual(start.residual.model, (table,), (), False).evaluate(start.p), 0
    return start.places[k].tolist()


def _own(point: ModalPoint, at: int) -> float:
    return float(point.modes.frequencies[at])


def _modelled(table: ModeTable, at: int, point: ModalPoint) -> Real:
    """The model's shape at the channels of a table, NaN where it has no DOF; largest entry 1."""
    rows = channel_rows(table, point.residual.model)
    shape = np.where(rows >= 0, point.modes.shapes[rows, at], np.nan)
    return np.asarray(shape / np.nanmax(np.abs(shape), initial=1e-300))


def unlike(table: ModeTable, i: int, at: int, point: ModalPoint) -> bool:
    """Whether a measured shape is not that of the model's mode; False where there is none."""
    if table.shapes is None or not np.any(np.isfinite(table.shapes[i])):
        return False
    return not _scaled(real_shapes(table.shapes[i : i + 1])[0], _modelled(table, at, point))


def _scaled(measured: Real, modelled: Real) -> float:
    """The factor that brings a measured shape to the model's; 0 where they are not alike."""
    known = np.isfinite(measured) & np.isfinite(modelled)
    x, y = measured[known], modelled[known]
    across = float(x @ y)
    if across**2 < ALIKE * float(x @ x) * float(y @ y) or not across:
        return 0.0
    return across / float(x @ x)


def _shape_of(
    table: ModeTable, i: int, at: int, point: ModalPoint, turned: Real
) -> Mapping[str, tuple[float, float]]:
    """``turned``: how far identification may have turned it into others."""
    if table.shapes is None or not np.any(np.isfinite(table.shapes[i])):
        return {}
    measured, modelled = real_shapes(table.shapes[i : i + 1])[0], _modelled(table, at, point)
    factor = _scaled(measured, modelled)
    if not factor:
        return {}
    std = np.full(len(measured), UNSTATED_SHAPE) if table.shape_std is None else table.shape_std[i]
    off = factor * measured - modelled
    std = np.hypot(std, turned)
    spread = np.sqrt((factor * std) ** 2 + SHAPE_REPEATED**2 + (COMMON * off) ** 2)
    return {
        c.label: (float(v), float(s))
        for c, v, s in zip(table.channels, off, spread, strict=True)
        if np.isfinite(v)
    }


def _bent(
    table: ModeTable, shape: Real, known: OneMode, at: int, point: ModalPoint
) -> tuple[Real, Real]:
    """A measured shape without what the reference has of its own, and the deviations of that."""
    factor = _scaled(shape, _modelled(table, at, point))
    own = [known.shape.get(c.label, (np.nan, np.nan)) for c in table.channels]
    off, spread = np.array(own).T
    if not factor or np.all(np.isnan(off)):
        return shape, np.full(len(shape), np.nan)
    return shape - np.nan_to_num(off) / factor, np.abs(spread / factor)
