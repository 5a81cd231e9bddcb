"""Fits of a model to tables of modes; of a large one in the coordinates of a space of few shapes,
where an iteration costs what it does of a small model, and then once in all of its DOFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit, fitted, fitted_at, taken
from cvxupdate.diagnose.modes.setting import ModesSetting
from cvxupdate.diagnose.modes.tables import settled
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS, STRONG, WIDE
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import DENSE, Modes
from cvxupdate.fe.synthesis.coordinates import Coordinates, coordinates_of
from cvxupdate.fe.synthesis.space import Space, space_of
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.another_pairing import nearest_pairing
from cvxupdate.residual.following import followed
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.shape_rows import channel_rows
from cvxupdate.update.trust_region import Options

OPTIONS = Options(1e-4, 25, 0.3)
TRUE = 1e-3  # relative growth of the weighted squares, from few coordinates to all DOFs


def space_around(point: ModalPoint, top: float) -> Space | None:
    """The space of a large model's shapes up to the highest frequency (Hz) in use, with the static
    answers at the sensors; None of a model that is no larger than such a space."""
    model, tables = point.residual.model, point.residual.tables
    sensors = _sensors(model, tables)
    if model.size <= DENSE or len(sensors) > DENSE // 2 or point.modes.rigid:
        return None
    used = max((int(q.max(initial=0)) for q in point.places), default=0)
    highest = max(top, float(point.modes.frequencies[used]))
    return space_of(model, model.zero(), highest, sensors, _far(model))


def fitted_from(
    setting: ModesSetting, start: Real, continued: bool = False, space: Space | None = None
) -> Fit:
    """Fitted from ``start``, in few coordinates where the nominal model has a ``space``;
    ``continued``: at finite sizes, to which modes are followed. Once more where the mesh's error
    of the modes that were found is another than it was taken for.

    Raises
    ------
    ModelError
        When the model is no structure at ``start``.
    """
    found = _fitted_from(setting, start, continued, space)
    tables = settled(setting.tables, found.point)
    if tables is None:
        return found
    again = _begun(found.setting, found.point)
    first = len(setting.residual.fit)
    moved = replace(again.residual, fit=tables[:first], hold_out=tables[first:])
    return _fitted_from(replace(again, residual=moved), found.p, False, space)


def _fitted_from(setting: ModesSetting, start: Real, continued: bool, space: Space | None) -> Fit:
    few = in_few(setting, space)
    if few is not None:
        try:
            found = _followed(few[0], start, continued)
            return _in_all(found, setting, few[1])
        except ModelError:
            pass  # where few coordinates fail, all may not
    return _followed(setting, start, continued)


def _followed(setting: ModesSetting, start: Real, continued: bool) -> Fit:
    if continued:
        setting = replace(setting, residual=followed(setting.residual, start))
    return paired(setting, start)


def paired(setting: ModesSetting, start: Real) -> Fit:
    """Fitted, and once more with the modes paired anew where that is another pairing: the better
    one counts, for every hypothesis alike; one that passes over more of the model's modes has to be
    strongly favoured, for there is always another that takes what an effect moves far."""
    found = fitted(setting, start, OPTIONS)
    near = nearest_pairing(found.point)
    if _alike(near, found.point):
        return replace(found, point=near)  # of those that are only scored
    again = fitted(_begun(setting, near), found.p, OPTIONS)
    return again if _likelier(again, found) else found


def taken_at(setting: ModesSetting, p: Real) -> Fit:
    """Without fitting: modes as they are followed to ``p``, or paired anew there where that leaves
    little and less, for to a point far from today's model one large step may mistake them; what
    goes on from there begins with these. Where much is left the nearest are no better a guess.

    Raises
    ------
    ModelError
        When the model is no structure there.
    """
    found = fitted_at(setting, p)
    near = nearest_pairing(found.point)
    if _alike(near, found.point):
        return found
    begun = _begun(setting, near)
    again = taken(begun, replace(near, residual=begun.residual))
    return again if again.misfit <= HOPELESS * EXPLAINED and _likelier(again, found) else found


def paired_at(setting: ModesSetting, p: Real) -> ModesSetting:
    """With modes paired as they are nearest at a point, however much that leaves.

    Raises
    ------
    ModelError
        When the model is no structure there.
    """
    return _begun(setting, nearest_pairing(fitted_at(setting, p).point))


def followed_at(setting: ModesSetting, p: Real) -> Fit:
    """Without fitting, at a point far from today's model: modes followed there step by step, or the
    nearest, whichever leaves less.

    Raises
    ------
    ModelError
        When the model is no structure there.
    """
    return fitted_at(replace(setting, residual=followed(setting.residual, p)), p)


def _alike(one: ModalPoint, other: ModalPoint) -> bool:
    """Whether the fitted modes are paired alike."""
    fit = range(len(one.residual.fit))
    return all(np.array_equal(one.places[k], other.places[k]) for k in fit)


def _likelier(again: Fit, found: Fit) -> bool:
    """Whether a fit by another pairing counts: strongly, where it passes over more modes."""
    gain = found.rows * np.log(max(found.cost, 1e-300) / max(again.cost, 1e-300))
    least = STRONG if passed_over(again.point) > passed_over(found.point) else 0.0
    return bool(gain > least)


def passed_over(point: ModalPoint) -> int:
    """How many of the model's flexible modes below the highest that is paired have no partner."""
    used = np.unique(np.concatenate(point.places[: len(point.residual.fit)]))
    used = used[used >= point.modes.rigid]
    return int(used[-1] + 1 - point.modes.rigid - len(used)) if len(used) else 0


def _begun(setting: ModesSetting, at: ModalPoint) -> ModesSetting:
    """With modes paired as they are at a point."""
    begin = replace(setting.residual.start, modes=at.modes, places=at.places)
    return replace(setting, residual=replace(setting.residual, start=begin))


def in_few(setting: ModesSetting, space: Space | None) -> tuple[ModesSetting, Coordinates] | None:
    """The same comparison in the coordinates of a space of few shapes, and these; None where it
    has none that is smaller."""
    if space is None:
        return None
    model, residual = setting.model, setting.residual
    own = space.grown(model, _far(model))
    if own is None:
        own = space_of(
            model, model.zero(), space.top, _sensors(model, residual.tables), _far(model)
        )
    few = coordinates_of(own, _sensors(model, residual.tables))
    if few is None or few.model.size > DENSE:
        return None
    start, M = residual.start, model.matrices(model.zero()).M
    shapes = few.lowered(start.modes.shapes, M)
    modes = Modes(start.modes.eigenvalues, shapes, start.modes.rigid)
    there = replace(residual, model=few.model, start=replace(start, modes=modes))
    return replace(setting, residual=there), few


def _in_all(found: Fit, setting: ModesSetting, few: Coordinates) -> Fit:
    """A fit in few coordinates taken in all DOFs; fitted on from there where it was off."""
    point: ModalPoint = found.point
    modes = Modes(point.modes.eigenvalues, few.lift @ point.modes.shapes, point.modes.rigid)
    before = replace(point, residual=setting.residual, modes=modes)
    fit = fitted_at(setting, point.p, before)
    if fit.cost <= (1.0 + TRUE) * found.cost:
        return fit
    again = fitted(_begun(setting, fit.point), fit.p, OPTIONS)
    return min(fit, again, key=lambda f: f.cost)


def _sensors(model: Model, tables: Sequence[ModeTable]) -> Index:
    """Rows of the free DOFs at which shapes were measured, each once."""
    rows = [channel_rows(t, model) for t in tables]
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *rows]))
    return every[every >= 0]


def _far(model: Model) -> list[int]:
    """Parameters that may go far: those of effects, and groups let go."""
    return [j for j, q in enumerate(model.parameters) if q.group is None or q.upper >= WIDE]
