"""Modes against modes: eigenvalues (2.100), and mode shapes (2.99) where they were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.eigen import (
    derivatives_of,
    eigenvalue_derivatives,
    shape_derivatives,
    splitting,
)
from cvxupdate.residual.pairing import MARGIN, Start, follow, pairing_modes, start_pairing
from cvxupdate.residual.repeated import aligned, clusters, oriented, turned
from cvxupdate.residual.shape_rows import Index, channel_rows, real_shapes, shape_entries, visible
from cvxupdate.system import LinearSystem


@dataclass(frozen=True)
class ModalResidual:
    """What is compared: a model, tables to fit and tables to score only, whether shapes count, and
    the initial pairing.

    ``count`` flexible modes are computed at every point; ``start`` pairs ``fit + hold_out`` in that
    order. ``muted`` are the (table, mode) whose shape is left out because its eigenvalue is
    repeated in the initial model, ``unseen`` those whose partner does not move any of the sensors
    there.
    """

    model: Model
    fit: tuple[ModeTable, ...]
    hold_out: tuple[ModeTable, ...]
    shapes: bool
    start: Start
    count: int
    muted: frozenset[tuple[int, int]] = frozenset()
    unseen: frozenset[tuple[int, int]] = frozenset()

    @property
    def tables(self) -> tuple[ModeTable, ...]:
        """Tables to fit, then tables to score."""
        return self.fit + self.hold_out

    def evaluate(self, p: Real, before: ModalPoint | None = None) -> ModalPoint:
        """The model's modes at ``p`` (n,), each measured mode followed from the point ``before``
        (None: from ``start``).

        The fitted modes are followed first, then those to score among what is left. Shapes of a
        repeated eigenvalue are turned to those before.

        Raises
        ------
        ModelError
            When the model at ``p`` is no structure (indefinite mass, a mechanism).
        """
        p = np.asarray(p, dtype=float)
        m = self.model.matrices(p)
        first, places = (
            (self.start.modes, self.start.places)
            if before is None
            else (before.modes, before.places)
        )
        modes = model_modes(self.model, self.count, p, m)
        fitted = _used(places[: len(self.fit)])
        scored = np.setdiff1d(
            _used(places[len(self.fit) :]), fitted
        )  # a fitted mode that was measured again goes with it
        modes = aligned(modes, m, first.shapes[:, np.concatenate([fitted, scored])])
        went = {-1: -1}
        for used in (fitted, scored):
            found = follow(
                first.shapes[:, used],
                m.M,
                modes,
                np.array([v for v in went.values() if v >= 0], dtype=np.int64),
            )
            went |= dict(zip(used.tolist(), found.tolist(), strict=True))
        moved = tuple(np.array([went[i] for i in q.tolist()], dtype=np.int64) for q in places)
        return ModalPoint(self, p, m, modes, moved)


def _used(places: Sequence[Index]) -> Index:
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *places]))
    return every[every >= 0]


@dataclass(frozen=True)
class ModalPoint:
    """The comparison at one parameter vector; ``places`` say which of ``modes`` each measured mode
    is, table by table."""

    residual: ModalResidual
    p: Real
    matrices: Matrices
    modes: Modes
    places: tuple[Index, ...]

    def frequencies(self, table: int) -> Real:
        """Model frequencies (Hz) beside the measured modes of a table, NaN where unpaired."""
        at = self.places[table]
        return np.where(at >= 0, self.modes.frequencies[at], np.nan)

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(model − measured, weights, labels) of the rows to fit: eigenvalues in (rad/s)², then
        shape entries.

        The deviation of an eigenvalue is 2 λ σ_f / f. A shape is scaled to the measured one by
        least squares (the modal scale factor 2.3).
        """
        values, weights, labels = [], [], []
        for k, table in enumerate(self.residual.fit):
            for i, at in enumerate(self.places[k].tolist()):
                if at < 0:
                    continue
                measured = (2.0 * np.pi * table.frequency[i]) ** 2
                values.append([self.modes.eigenvalues[at] - measured])
                weights.append([table.frequency[i] / (2.0 * measured * table.frequency_std[i])])
                labels.append(f"{table.origin.name}: {table.frequency[i]:.5g} Hz")
        if self.residual.shapes:
            for k, i, at, rows, x, std in self.shape_rows():
                scaled, _ = _scaled(self.modes.shapes[rows, at], x, std)
                values.append((scaled - x).tolist())
                weights.append((1.0 / std).tolist())
                table = self.residual.fit[k]
                labels += [
                    f"{table.origin.name}: shape of {table.frequency[i]:.5g} Hz at "
                    f"{self.residual.model.labels[r]}"
                    for r in rows
                ]
        return (
            np.array([v for part in values for v in part]),
            np.array([w for part in weights for w in part]),
            tuple(labels),
        )

    def system(self) -> LinearSystem:
        """Linearised at this point: A p − b ≈ model(p) − measured."""
        model = self.residual.model
        derivatives = derivatives_of(model, self.p)
        at = np.array(
            [i for k in range(len(self.residual.fit)) for i in self.places[k].tolist() if i >= 0],
            dtype=np.int64,
        )
        rows = [
            eigenvalue_derivatives(
                self.modes.eigenvalues[at], self.modes.shapes[:, at], derivatives
            )
        ]
        if self.residual.shapes:
            for _, _, i, sensors, x, std in self.shape_rows():
                phi = self.modes.shapes[:, i]
                others = next(
                    (self.modes.shapes[:, at[at != i]] for at in clusters(self.modes) if i in at),
                    None,
                )
                d = shape_derivatives(
                    self.matrices,
                    float(self.modes.eigenvalues[i]),
                    phi,
                    sensors,
                    derivatives,
                    others,
                )
                rows.append(scaled_derivative(phi[sensors], d, x, std))
        A = np.vstack(rows)
        values, weights, labels = self.differences
        return LinearSystem(
            A, A @ self.p - values, weights, tuple(q.name for q in model.parameters), labels
        )

    def shape_rows(self) -> list[tuple[int, int, int, Index, Real, Real]]:
        """(table, measured mode, place, sensors, measured entries, deviations) of every shape that
        is fitted."""
        out = []
        for k, table in enumerate(self.residual.fit):
            if table.shapes is None:
                continue
            rows, shapes = channel_rows(table, self.residual.model), real_shapes(table.shapes)
            deviations = (
                np.full(shapes.shape, np.nan)
                if table.shape_std is None
                else np.broadcast_to(table.shape_std, shapes.shape)
            )
            for i, at in enumerate(self.places[k].tolist()):
                if at < 0 or (k, i) in self.residual.muted | self.residual.unseen:
                    continue
                ok = (rows >= 0) & np.isfinite(shapes[i])
                if ok.sum() < 2:
                    continue
                unstated = 0.05 * np.nanmax(np.abs(shapes[i]))  # 5 % of the largest entry
                std = np.where(np.isfinite(deviations[i]), deviations[i], unstated)
                out.append((k, i, at, rows[ok], shapes[i][ok], std[ok]))
        return out


def _scaled(phi: Real, x: Real, std: Real) -> tuple[Real, float]:
    """φ scaled to x by weighted least squares, and the factor."""
    w = 1.0 / std**2
    q = float(np.sum(w * phi * x) / np.sum(w * phi**2))
    return q * phi, q


def scaled_derivative(phi: Real, d: Real, x: Real, std: Real) -> Real:
    """∂(q φ)/∂p, the scale factor's own change included, (sensors, parameters)."""
    w = 1.0 / std**2
    _, q = _scaled(phi, x, std)
    dq = ((w * (x - 2.0 * q * phi)) @ d) / np.sum(w * phi**2)
    return q * d + np.outer(phi, dq)


def modal_residual(
    model: Model,
    fit: Sequence[ModeTable],
    hold_out: Sequence[ModeTable],
    shapes: bool,
    pairing: str = "auto",
    given: Sequence[Index] | None = None,
) -> ModalResidual:
    """Pair the measured modes with those of the initial model (p = 0); ``given`` are places of the
    fitted ones that are known already.

    Raises
    ------
    ModelError, InputError, RecordingError
        A model without modes, a pairing that cannot be made, a channel that is not on the model.
    """
    tables = (*fit, *hold_out)
    modes = pairing_modes(model, tables, pairing)
    if not len(modes.eigenvalues):
        raise ModelError(
            "the model has no natural modes: it carries no mass. Add density or lumped masses."
        )
    modes, known = oriented(modes, model, fit)
    start = start_pairing(model, modes, tables, pairing, len(fit), given)
    used = _used(start.places)
    if not len(_used(start.places[: len(fit)])) and any(len(t.frequency) for t in fit):
        raise InputError(
            "no measured mode can be compared: the model has rigid-body modes only. Refine "
            "the model, or hold it."
        )
    # Modes that are rigid today count too: a support stiffness that grows from zero makes them
    # flexible.
    count = int(used.max(initial=0)) + 1 + MARGIN
    repeated = [at for at in clusters(modes) if np.isin(at, used).any()]
    modes = _turned(model, modes, [at for at in repeated if int(at[0]) not in known])
    several = {int(i) for at in repeated for i in at}
    muted = frozenset(
        (k, i)
        for k, places in enumerate(start.places)
        for i, at in enumerate(places.tolist())
        if at in several
    )
    return ModalResidual(
        model,
        tuple(fit),
        tuple(hold_out),
        shapes,
        replace(start, modes=modes),
        count,
        muted,
        _unseen(model, modes, fit, start.places),
    )


def _turned(model: Model, modes: Modes, repeated: Sequence[Index]) -> Modes:
    """The modes of each repeated eigenvalue turned to those that the parameters split it into."""
    if not repeated or not model.parameters:
        return modes
    derivatives = derivatives_of(model, model.zero())
    for at in repeated:
        mean = float(modes.eigenvalues[at].mean())
        modes = turned(modes, at, splitting(mean, modes.shapes[:, at], derivatives))
    return modes


def _unseen(
    model: Model, modes: Modes, fit: Sequence[ModeTable], places: Sequence[Index]
) -> frozenset[tuple[int, int]]:
    """The (table, mode) with a shape whose partner moves none of the sensors: scaled to the
    measured shape, its rounding would pass for one."""
    out = set()
    for k, table in enumerate(fit):
        for i, at in enumerate(places[k].tolist()):
            rows, _ = shape_entries(model, table, i)
            if at >= 0 and len(rows) and not visible(modes.shapes[:, [at]], rows)[0]:
                out.add((k, i))
    return frozenset(out)
