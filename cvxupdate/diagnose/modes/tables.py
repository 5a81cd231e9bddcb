"""Tables of modes to fit and to score, weighted by noise and by what a sound model may miss."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.modes.common import Common, its_modes
from cvxupdate.diagnose.modes.identified import Identified
from cvxupdate.diagnose.modes.kinds import chi_square
from cvxupdate.diagnose.modes.mixing import mixed, off_nodes
from cvxupdate.diagnose.nominal.mesh import MeshError
from cvxupdate.diagnose.settings import (
    ANOTHER_MODE,
    FEWEST_RATIOS,
    FREQUENCY_DISCREPANCY,
    LIKELY,
    REPEATED,
    SETTLED,
    SHAPE_DISCREPANCY,
    UNSTATED_FREQUENCY,
    UNSTATED_SHAPE,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint, modal_residual


@dataclass(frozen=True)
class Tables:
    """Tables to fit and to score only: frequencies moved to where the mesh would have them,
    standard deviations widened by the discrepancy of a sound model. ``measured``: those to fit and
    to score as they were, deviations of noise alone in every entry. ``before``: of each table to
    fit, damping ratios and their deviations at the reference state, (2, modes), NaN where it has
    none; empty without a reference. ``gone``: rows of each table to fit that were left out, each
    with why (`cvxupdate.diagnose.modes.foreign`). ``seen``: tables to fit that were identified from
    FRFs, as they were, with what these say beside; empty of tables in a file; ``later``: the same
    of FRFs that were held out. ``mesh``: what was taken out of their frequencies, by the modes of
    the nominal model; None where the reference state has its own say. ``told``: what else was
    taken out of them, in words."""

    fit: tuple[ModeTable, ...]
    hold: tuple[ModeTable, ...]
    measured: tuple[ModeTable, ...]
    before: tuple[Real, ...] = ()
    gone: Mapping[int, Mapping[int, str]] = field(default_factory=dict)
    seen: tuple[Identified, ...] = ()
    later: Callable[[], Sequence[Identified]] = tuple
    mesh: MeshError | None = None
    told: tuple[str, ...] = ()

    @property
    def left_out(self) -> list[str]:
        """The rows that were left out, in words."""
        return [says for rows in self.gone.values() for says in rows.values()]

    def pairs(self, table: int, places: Sequence[int], rigid: int) -> list[int]:
        """Numbers of the flexible modes that the rows of a table in the file are paired with, 0 for
        none: ``places`` among the model's modes, ``rigid`` of them rigid, without rows left out."""
        out = [int(at) - rigid + 1 if at >= 0 else 0 for at in places]
        for row in sorted(self.gone.get(table, ())):
            out.insert(row, 0)
        return out

    @property
    def top(self) -> float:
        """The highest frequency to fit, Hz."""
        return max(float(t.frequency.max()) for t in self.fit)

    @property
    def bottom(self) -> float:
        """The lowest, Hz."""
        return min(float(t.frequency.min()) for t in self.fit)

    @property
    def shapes(self) -> bool:
        """Whether any mode to fit has a shape."""
        return any(t.shapes is not None for t in self.fit)

    @property
    def heavy(self) -> tuple[str, ...]:
        """Labels of channels whose sensors may weigh: shapes in a file are displacements, whatever
        measured them."""
        kinds = ("acceleration",) if self.seen else ("acceleration", "displacement")
        channels = [c for t in self.measured for c in t.channels if c.quantity in kinds]
        return tuple(dict.fromkeys(c.label for c in channels))

    @property
    def kinds(self) -> int:
        """How many kinds of figures there are to test by themselves: frequencies, shapes, damping
        ratios where there are enough for a pattern."""
        ratios = sum(int(np.sum(t.damping > 0.0)) for t in self.fit)  # NaN is not
        return 1 + self.shapes + (ratios >= FEWEST_RATIOS)

    @property
    def noise(self) -> float:
        """R.m.s. relative error of the held-out frequencies that their deviations alone explain
        nineteen times in twenty; NaN where none are."""
        std = np.concatenate([np.zeros(0), *(t.frequency_std / t.frequency for t in self.hold)])
        if not len(std):
            return float("nan")
        return float(np.sqrt(np.mean(std**2) * chi_square(LIKELY, len(std)) / len(std)))

    def noise_parts(self, point: ModalPoint) -> Real:
        """The part of each row's weighted square that noise alone makes, (rows,)."""
        parts: list[Real] = []
        for k, table in enumerate(self.fit):
            paired = point.places[k] >= 0
            parts.append((self.measured[k].frequency_std / table.frequency_std)[paired] ** 2)
        if point.residual.shapes:
            for k, i, _, rows, _, std in point.shape_rows():
                narrow = self.measured[k].shape_std
                own = np.full(len(rows), UNSTATED_SHAPE) if narrow is None else narrow[i]
                parts.append((np.resize(own[: len(rows)], len(rows)) / std) ** 2)
        return np.concatenate([np.zeros(0), *parts])


def prepared(
    model: Model,
    tables: Sequence[ModeTable],
    mesh: MeshError,
    common: Common | None = None,
    beside: bool = False,
) -> Tables:
    """The mesh's own error is no physics (`cvxupdate.diagnose.nominal.mesh`), nor is what model and
    reference state disagree on (``common``), nor how far sensors stand ``beside`` their nodes; the
    modes of ``model`` say which shift is whose."""
    fit, hold = (
        tuple(t for t in tables if (t.origin.use == "fit") == use) for use in (True, False)
    )
    start = modal_residual(model, fit, hold, False).evaluate(model.zero())
    moved, measured = [], []
    for k, t in enumerate((*fit, *hold)):
        shift = _shift(start, k, mesh, t)
        plain = _stated(t)
        measured.append(plain)
        there = _off_mesh(plain, shift)
        shape = np.hypot(SHAPE_DISCREPANCY, off_nodes(start, k, plain) if beside else 0.0)
        shape = np.hypot(shape, mixed(start, k, plain))
        missed = FREQUENCY_DISCREPANCY * np.ones(len(shift)), shape
        if common is not None:
            its = common if k < len(fit) else common.held
            without = its.without(there, its_modes(start, k, t), start)
            there, missed = _beside(there, without, missed, mixed(start, k, plain, missed=REPEATED))
        moved.append(_widened(there, missed, mesh.rest(shift)))
    places = [start.places[k].tolist() for k in range(len(fit))]
    before = () if common is None else tuple(common.damping(at) for at in places)
    first, rest = tuple(moved[: len(fit)]), tuple(moved[len(fit) :])
    return Tables(first, rest, tuple(measured), before, mesh=mesh if common is None else None)


def _stated(table: ModeTable) -> ModeTable:
    """With a standard deviation in every entry."""
    std = UNSTATED_FREQUENCY * table.frequency if table.relative_only else table.frequency_std
    shape = table.shape_std
    if table.shapes is not None:
        known = np.full(table.shapes.shape, np.nan)
        known = known if shape is None else np.broadcast_to(shape, table.shapes.shape)
        shape = np.where(np.isfinite(known), known, UNSTATED_SHAPE)
    return replace(table, frequency_std=std, shape_std=shape, relative_only=False)


def _beside(
    table: ModeTable, moved: ModeTable, missed: tuple[Real, Any], mixed: Real
) -> tuple[ModeTable, tuple[Real, Any]]:
    """A table without what is common to the reference (``moved``), deviations its own; and what a
    sound model may still miss of frequencies (relative) and shapes: what the reference leaves open
    where it has the mode, and how far identification ``mixed`` modes, else as of any model."""
    frequency, shape = missed
    own = moved.frequency_std / moved.frequency
    of_shapes: Any = shape
    if moved.shape_std is not None:
        known = np.isfinite(moved.shape_std)
        of_shapes = np.where(known, np.hypot(moved.shape_std, mixed), shape)
    there = replace(moved, frequency_std=table.frequency_std, shape_std=table.shape_std)
    return there, (np.where(np.isfinite(own), own, frequency), of_shapes)


def _widened(table: ModeTable, missed: tuple[Real, Any], mesh: Real) -> ModeTable:
    """With what a sound model may miss, and what damping at single places does to undamped modes:
    of second order in their ratios, for frequencies and for the real part of shapes (Rayleigh 1877,
    102; Ewins 2000, 2.7)."""
    damped = np.nan_to_num(table.damping) ** 2
    discrepancy = (missed[0] ** 2 + mesh**2 + damped**2) * table.frequency**2
    shape = table.shape_std
    return replace(
        table,
        frequency_std=np.sqrt(table.frequency_std**2 + discrepancy),
        shape_std=None
        if shape is None
        else np.sqrt(shape**2 + missed[1] ** 2 + damped[:, None] ** 2),
    )


def stated_of(tables: Sequence[ModeTable]) -> list[ModeTable]:
    """Tables with a deviation in every entry, of noise alone."""
    return [_stated(t) for t in tables]


def stated_tables(
    model: Model, tables: Sequence[ModeTable], mesh: MeshError
) -> tuple[ModeTable, ...]:
    """Tables with a deviation in every entry, of noise alone, the mesh's error taken out."""
    start = modal_residual(model, tables, (), False).evaluate(model.zero())
    return tuple(_off_mesh(t, _shift(start, k, mesh, t)) for k, t in enumerate(stated_of(tables)))


def _shift(start: ModalPoint, k: int, mesh: MeshError, table: ModeTable) -> Real:
    """That of the mode each is paired with, or of the one that is nearest where that is another
    mode by far: a model that is so much off says nothing of this one."""
    own = np.nan_to_num(start.frequencies(k))
    far = np.abs(own - table.frequency) > ANOTHER_MODE * table.frequency
    at = mesh.at(np.where(far, table.frequency, own))
    return np.asarray(np.where(own > 0.0, at, 0.0))


def settled(tables: Tables, point: ModalPoint) -> tuple[ModeTable, ...] | None:
    """The tables of a fitted model, without the mesh's error of its own modes: an effect may turn
    them into others than those it was told by. None where they move by less than `SETTLED`."""
    mesh, every = tables.mesh, point.residual.tables
    if mesh is None or not mesh.labels or not len(mesh.frequencies):
        return None
    model, modes = point.residual.model, point.modes
    sharp = mesh.taken_out(model, modes, mesh.rows(model)).eigenvalues
    swings = modes.eigenvalues > 0.0
    to = np.sqrt(np.where(swings, sharp / np.where(swings, modes.eigenvalues, 1.0), 1.0))
    out, moves = [], False
    for at, raw, now in zip(point.places, tables.measured, every, strict=True):
        f = np.where(at >= 0, raw.frequency / to[at], now.frequency)
        moves = moves or bool(np.any(np.abs(f - now.frequency) > SETTLED * now.frequency_std))
        out.append(replace(now, frequency=f))
    return tuple(out) if moves else None


def _off_mesh(table: ModeTable, shift: Real) -> ModeTable:
    to = 1.0 + shift
    return replace(table, frequency=table.frequency / to, frequency_std=table.frequency_std / to)


def errors_of(point: ModalPoint, tables: Sequence[ModeTable], fitted: bool) -> Real:
    """Relative errors of the frequencies of the fitted or the held-out modes of ``tables``, which
    are paired as those of the point."""
    first = len(point.residual.fit)
    errors: list[float] = []
    for k, table in enumerate(tables):
        if (k < first) == fitted:
            f = point.frequencies(k)
            errors += ((f - table.frequency) / table.frequency)[np.isfinite(f)].tolist()
    return np.array(errors)


def metrics_of(drawn: ModalPoint, found: ModalPoint, tables: Tables) -> dict[str, Any]:
    """The contract's metrics: of the file as it came beside what was measured, and of a diagnosed
    model beside what it was fitted to."""
    moved = found.residual.tables
    out: dict[str, Any] = {}
    for key, use in (("fit", True), ("hold_out", False)):
        before = 100.0 * np.abs(errors_of(drawn, tables.measured, use))
        after = 100.0 * np.abs(errors_of(found, moved, use))
        out[key] = {}
        if len(before) and len(after):
            for name, f in (("mean", np.mean), ("max", np.max)):
                values = {"before": float(f(before)), "after": float(f(after))}
                out[key][f"frequency_error_percent_{name}"] = values
    return out


def rms(errors: Real) -> float:
    """NaN where there are none."""
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")
