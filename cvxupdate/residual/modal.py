"""Modes against modes: eigenvalues (2.100), and mode shapes (2.99) where they were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.eigen import eigenvalue_derivatives, shape_derivatives
from cvxupdate.residual.pairing import Index, Start, channel_rows, follow, needed_modes, real_shapes, start_pairing
from cvxupdate.system import LinearSystem

REPEATED = 1e-6  # relative distance of eigenvalues below which a single shape means nothing


@dataclass(frozen=True)
class ModalResidual:
    """What is compared: a model, tables to fit and tables to score only, whether shapes count, and the initial pairing.

    ``count`` modes are computed at every point; ``start`` pairs ``fit + hold_out`` in that order.
    """

    model: Model
    fit: tuple[ModeTable, ...]
    hold_out: tuple[ModeTable, ...]
    shapes: bool
    start: Start
    count: int

    @property
    def tables(self) -> tuple[ModeTable, ...]:
        """Tables to fit, then tables to score."""
        return self.fit + self.hold_out

    def evaluate(self, p: Real, before: ModalPoint | None = None) -> ModalPoint:
        """The model's modes at ``p`` (n,), each measured mode followed from the point ``before`` (None: the initial model).

        Raises
        ------
        ModelError
            When the model at ``p`` is no structure (indefinite mass, a mechanism).
        """
        m = self.model.matrices(p)
        modes = model_modes(self.model, self.count, p, m)
        if before is None:
            first = self.start.modes
            shapes = first.shapes
            places = list(self.start.places)
        else:
            first, shapes, places = before.modes, before.modes.shapes, list(before.places)
        paired = np.unique(np.concatenate([q[q >= 0] for q in places])) if places else np.zeros(0, dtype=np.int64)
        went = dict(zip(paired.tolist(), follow(shapes[:, paired], m.M, modes).tolist(), strict=True))
        moved = tuple(np.array([went.get(int(i), -1) for i in q], dtype=np.int64) for q in places)
        return ModalPoint(self, np.asarray(p, dtype=float), m, modes, moved)


@dataclass(frozen=True)
class ModalPoint:
    """The comparison at one parameter vector; ``places`` say which of ``modes`` each measured mode is, table by table."""

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
        """(model − measured, weights, labels) of the rows to fit: eigenvalues in (rad/s)², then shape entries.

        The deviation of an eigenvalue is 2 λ σ_f / f. A shape is scaled to the measured one by least squares (the modal scale factor 2.3).
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
            for k, i, at, rows, x, std in self._shape_rows():
                scaled, _ = _scaled(self.modes.shapes[rows, at], x, std)
                values.append((scaled - x).tolist())
                weights.append((1.0 / std).tolist())
                table = self.residual.fit[k]
                labels += [f"{table.origin.name}: shape of {table.frequency[i]:.5g} Hz at {self.residual.model.labels[r]}" for r in rows]
        return np.array([v for part in values for v in part]), np.array([w for part in weights for w in part]), tuple(labels)

    def system(self) -> LinearSystem:
        """Linearised at this point: A p − b ≈ model(p) − measured."""
        model = self.residual.model
        derivatives = [model.derivative(j, self.p) for j in range(len(model.parameters))]
        at = np.array([i for k in range(len(self.residual.fit)) for i in self.places[k].tolist() if i >= 0], dtype=np.int64)
        rows = [eigenvalue_derivatives(self.modes.eigenvalues[at], self.modes.shapes[:, at], derivatives)]
        if self.residual.shapes:
            for _, _, i, sensors, x, std in self._shape_rows():
                phi = self.modes.shapes[:, i]
                d = shape_derivatives(self.matrices, float(self.modes.eigenvalues[i]), phi, sensors, derivatives)
                rows.append(_scaled_derivative(phi[sensors], d, x, std))
        A = np.vstack(rows)
        values, weights, labels = self.differences
        return LinearSystem(A, A @ self.p - values, weights, tuple(q.name for q in model.parameters), labels)

    def _shape_rows(self) -> list[tuple[int, int, int, Index, Real, Real]]:
        """(table, measured mode, place, sensors, measured entries, deviations) of every shape that is fitted."""
        out = []
        for k, table in enumerate(self.residual.fit):
            if table.shapes is None:
                continue
            rows, shapes = channel_rows(table, self.residual.model), real_shapes(table.shapes)
            deviations = np.full(shapes.shape, np.nan) if table.shape_std is None else np.broadcast_to(table.shape_std, shapes.shape)
            for i, at in enumerate(self.places[k].tolist()):
                if at < 0 or _repeated(self.modes.eigenvalues, at):
                    continue
                ok = (rows >= 0) & np.isfinite(shapes[i])
                if ok.sum() < 2:
                    continue
                unstated = 0.05 * np.nanmax(np.abs(shapes[i]))  # 5 % of the largest entry
                std = np.where(np.isfinite(deviations[i]), deviations[i], unstated)
                out.append((k, i, at, rows[ok], shapes[i][ok], std[ok]))
        return out


def _repeated(eigenvalues: Real, at: int) -> bool:
    gap = np.abs(np.delete(eigenvalues, at) - eigenvalues[at])
    return bool(gap.size and gap.min() < REPEATED * eigenvalues[at])


def _scaled(phi: Real, x: Real, std: Real) -> tuple[Real, float]:
    """φ scaled to x by weighted least squares, and the factor."""
    w = 1.0 / std**2
    q = float(np.sum(w * phi * x) / np.sum(w * phi**2))
    return q * phi, q


def _scaled_derivative(phi: Real, d: Real, x: Real, std: Real) -> Real:
    """∂(q φ)/∂p, the scale factor's own change included, (sensors, parameters)."""
    w = 1.0 / std**2
    _, q = _scaled(phi, x, std)
    dq = ((w * (x - 2.0 * q * phi)) @ d) / np.sum(w * phi**2)
    return q * d + np.outer(phi, dq)


def modal_residual(model: Model, fit: Sequence[ModeTable], hold_out: Sequence[ModeTable], shapes: bool, pairing: str = "auto") -> ModalResidual:
    """Pair the measured modes with those of the initial model (p = 0).

    Raises
    ------
    ModelError, InputError, RecordingError
        A model without modes, a pairing that cannot be made, a channel that is not on the model.
    """
    tables = (*fit, *hold_out)
    wanted = needed_modes(tables)
    modes = model_modes(model, wanted, model.zero())
    if not len(modes.eigenvalues):
        raise ModelError("the model has no natural modes: it carries no mass. Add density or lumped masses.")
    start = start_pairing(model, modes, tables, pairing)
    # A rigid-body mode may become a flexible one when a support stiffness grows from zero.
    return ModalResidual(model, tuple(fit), tuple(hold_out), shapes, start, wanted + modes.rigid)
