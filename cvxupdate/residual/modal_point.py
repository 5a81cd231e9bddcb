"""The modal comparison at one parameter vector: rows and their linear system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.fe.continued import Continued, continued_modes
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import DENSE, Modes, model_modes, natural_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.contraction import constant
from cvxupdate.residual.derivatives import Derivatives, derivatives_of, stacked
from cvxupdate.residual.eigen import eigenvalue_derivatives
from cvxupdate.residual.exact_modal import exact_rows
from cvxupdate.residual.follow import follow
from cvxupdate.residual.misfit import eigenvalue_row, least_misfit
from cvxupdate.residual.pairing import Start
from cvxupdate.residual.repeated import aligned
from cvxupdate.residual.shape_forms import FORMS, ModalScale, deviations
from cvxupdate.residual.shape_gradients import ShapeRow, shape_gradients
from cvxupdate.residual.shape_rows import Index, channel_rows, real_shapes
from cvxupdate.system import LinearSystem

UNSTATED = 0.05  # deviation of a shape's entries where the table has none, of the largest


@dataclass(frozen=True)
class ModalResidual:
    """What is compared: a model, tables to fit and tables to score only, whether shapes count, and
    the initial pairing.

    ``count`` flexible modes are computed at every point; ``start`` pairs ``fit + hold_out`` in that
    order. ``muted`` are the (table, mode) whose shape is left out because its eigenvalue is
    repeated in the initial model, ``unseen`` those whose partner does not move any of the sensors
    there. ``form`` compares shapes (`residual.shape_forms`), their weights times ``shape_weight``;
    ``only_shapes`` leaves the eigenvalues without weight. ``continued``: modes come from those
    before (`fe.continued`), which may miss one that is not followed. ``repaired``: the
    fitted modes are paired anew at every point, by the least misfit, so that the objective is the
    lower envelope of all pairings.
    """

    model: Model
    fit: tuple[ModeTable, ...]
    hold_out: tuple[ModeTable, ...]
    shapes: bool
    start: Start
    count: int
    muted: frozenset[tuple[int, int]] = frozenset()
    unseen: frozenset[tuple[int, int]] = frozenset()
    form: str = "scale"
    shape_weight: float = 1.0
    only_shapes: bool = False
    continued: bool = False
    repaired: bool = False

    @property
    def tables(self) -> tuple[ModeTable, ...]:
        """Tables to fit, then tables to score."""
        return self.fit + self.hold_out

    @cached_property
    def constant_mass(self) -> bool:
        """Whether no parameter moves the mass matrix."""
        moved = derivatives_of(self.model, self.model.zero()).terms
        return not any(t.matrix == "M" for t in moved)

    @cached_property
    def _everywhere(self) -> Derivatives | None:
        """∂K/∂p and ∂M/∂p where they are the same at every p."""
        if not constant(self.model):
            return None
        return stacked(derivatives_of(self.model, self.model.zero()), self.model.size)

    @cached_property
    def shape_table(self) -> tuple[ShapeRow, ...]:
        """Every measured shape that is compared, whatever mode of the model it is paired with
        (``place`` −1): the recordings' part of each row."""
        out = []
        for k, table in enumerate(self.fit):
            if table.shapes is None:
                continue
            rows, shapes = channel_rows(table, self.model), real_shapes(table.shapes)
            given = np.nan if table.shape_std is None else table.shape_std
            stated = np.broadcast_to(given, shapes.shape)
            for i in range(len(table.frequency)):
                ok = (rows >= 0) & np.isfinite(shapes[i])
                if (k, i) in self.muted | self.unseen or ok.sum() < 2:
                    continue
                where = f"{table.origin.source}: the mode at {table.frequency[i]:.5g} Hz"
                std = deviations(stated[i][ok], shapes[i][ok], UNSTATED, where)
                out.append(ShapeRow(k, i, -1, rows[ok], shapes[i][ok], std))
        return tuple(out)

    def derivatives(self, p: Real) -> Derivatives:
        """∂K/∂p and ∂M/∂p at ``p``."""
        fixed = self._everywhere
        return derivatives_of(self.model, p) if fixed is None else fixed

    def evaluate(self, p: Real, before: ModalPoint | None = None) -> ModalPoint:
        """The model's modes at ``p`` (n,), each measured mode followed from the point ``before``
        (None: from ``start``).

        Fitted modes are followed first, those to score among what is left; shapes of a repeated
        eigenvalue are turned to those before.

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
        begin, highest = first, _highest(places)
        for _ in range(2):  # again where one went among the modes that had not converged
            modes, found = self._modes(p, m, begin, highest)
            point = self._paired(p, m, modes, first, places)
            highest = _highest(point.places)
            if found is None or highest < found.exact:
                return replace(point, solved=found)
            begin = found.modes
        return self._paired(p, m, self._anew(p, m), first, places)

    def _modes(
        self, p: Real, m: Matrices, first: Modes, highest: int
    ) -> tuple[Modes, Continued | None]:
        """The modes, by continuation where that is wanted, worth while and safe."""
        if not self._continues:
            return model_modes(self.model, self.count, p, m), None
        found = continued_modes(m, first, min(highest + 2, len(first.eigenvalues)))
        return (self._anew(p, m), None) if found is None else (found.modes, found)

    @cached_property
    def _continues(self) -> bool:
        return (
            self.continued
            and self.model.size > DENSE
            and not self.start.modes.rigid
            and self.constant_mass
        )

    def _anew(self, p: Real, m: Matrices) -> Modes:
        """The modes from nothing; where K is known to be positive definite, nothing is rigid."""
        if self._continues:
            return natural_modes(m.K, m.M, self.count, np.zeros((self.model.size, 0)))
        return model_modes(self.model, self.count, p, m)

    def _paired(
        self, p: Real, m: Matrices, modes: Modes, first: Modes, places: Sequence[Index]
    ) -> ModalPoint:
        """The point with every measured mode found again among ``modes``."""
        fitted = used_places(places[: len(self.fit)])
        scored = np.setdiff1d(
            used_places(places[len(self.fit) :]), fitted
        )  # a fitted mode that was measured again goes with it
        modes = aligned(modes, m, first.shapes[:, np.concatenate([fitted, scored])])
        went = {-1: -1}
        for used in (fitted, scored):
            found = follow(
                first.shapes[:, used],
                m.M,
                modes,
                np.array([v for v in went.values() if v >= 0], dtype=np.int64),
                first.eigenvalues[used] if self.model.exact else None,
            )
            went |= dict(zip(used.tolist(), found.tolist(), strict=True))
        moved = tuple(np.array([went[i] for i in q.tolist()], dtype=np.int64) for q in places)
        point = ModalPoint(self, p, m, modes, moved)
        if not self.repaired:
            return point
        shapes = point.compared_shapes() if self.shapes else []
        places_now = least_misfit(
            self.fit, moved, modes, shapes, FORMS[self.form], self.shape_weight
        )
        return ModalPoint(self, p, m, modes, places_now)


def used_places(places: Sequence[Index]) -> Index:
    """Every mode of the model that some measured mode is paired with."""
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *places]))
    return every[every >= 0]


def _highest(places: Sequence[Index]) -> int:
    return int(used_places(places).max(initial=0))


@dataclass(frozen=True)
class ModalPoint:
    """The comparison at one parameter vector; ``places`` say which of ``modes`` each measured mode
    is, table by table; ``solved`` is what the modes were found with, where that is kept."""

    residual: ModalResidual
    p: Real
    matrices: Matrices
    modes: Modes
    places: tuple[Index, ...]
    solved: Continued | None = None

    def frequencies(self, table: int) -> Real:
        """Model frequencies (Hz) beside the measured modes of a table, NaN where unpaired."""
        at = self.places[table]
        return np.where(at >= 0, self.modes.frequencies[at], np.nan)

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(model − measured, weights, labels) of the rows to fit: eigenvalues in (rad/s)², then
        shapes.

        The deviation of an eigenvalue is 2 λ σ_f / f.
        """
        values, weights, labels = [np.zeros(0)], [np.zeros(0)], []
        heed = 0.0 if self.residual.only_shapes else 1.0
        for k, table in enumerate(self.residual.fit):
            for i, at in enumerate(self.places[k].tolist()):
                if at < 0:
                    continue
                measured, weight = eigenvalue_row(table, i)
                values.append(np.array([self.modes.eigenvalues[at] - measured]))
                weights.append(np.array([heed * weight]))
                labels.append(f"{table.origin.name}: {table.frequency[i]:.5g} Hz")
        form = FORMS[self.residual.form]
        for row in self.compared_shapes() if self.residual.shapes else ():
            found = form.rows(self.modes.shapes[row.sensors, row.place], row.measured, row.std)
            values.append(found.values)
            weights.append(self.residual.shape_weight * found.weights)
            table = self.residual.fit[row.table]
            of = f"{table.origin.name}: shape of {table.frequency[row.mode]:.5g} Hz"
            labels += [
                of if e < 0 else f"{of} at {self.residual.model.labels[row.sensors[e]]}"
                for e in found.entry.tolist()
            ]
        return np.concatenate(values), np.concatenate(weights), tuple(labels)

    def system(self) -> LinearSystem:
        """Linearised at this point: A p − b ≈ model(p) − measured."""
        values, weights, labels = self.differences
        A = np.vstack(self._exact_rows() if self.residual.model.exact else self._rows())
        columns = tuple(q.name for q in self.residual.model.parameters)
        return LinearSystem(A, A @ self.p - values, weights, columns, labels)

    @property
    def paired(self) -> Index:
        """The modes of the model that are fitted, measured mode after measured mode."""
        return np.array(
            [i for k in range(len(self.residual.fit)) for i in self.places[k].tolist() if i >= 0],
            dtype=np.int64,
        )

    def _exact_rows(self) -> list[Real]:
        r = self.residual
        shapes = self.compared_shapes() if r.shapes else []
        return exact_rows(r.model, self.p, self.modes, self.paired, FORMS[r.form], shapes)

    def _rows(self) -> list[Real]:
        derivatives = self.residual.derivatives(self.p)
        at = self.paired
        rows = [
            eigenvalue_derivatives(
                self.modes.eigenvalues[at], self.modes.shapes[:, at], derivatives
            )
        ]
        if self.residual.shapes:
            rows += shape_gradients(
                FORMS[self.residual.form],
                self.compared_shapes(),
                self.modes,
                self.matrices,
                derivatives,
                self.solved,
            )
        return rows

    def compared_shapes(self) -> list[ShapeRow]:
        """Every shape that is fitted, with deviation 0 where an entry is fixed by normalisation."""
        placed = ((s, int(self.places[s.table][s.mode])) for s in self.residual.shape_table)
        return [replace(s, place=at) for s, at in placed if at >= 0]

    def shape_rows(self) -> list[tuple[int, int, int, Index, Real, Real]]:
        """(table, measured mode, place, sensors, measured entries, deviations) of every shape that
        is fitted, the entries that are fixed by normalisation left out."""
        return [
            (s.table, s.mode, s.place, s.sensors[on], s.measured[on], s.std[on])
            for s in self.compared_shapes()
            for on in [s.std > 0.0]
        ]


def scaled_derivative(phi: Real, d: Real, x: Real, std: Real) -> Real:
    """∂(q φ)/∂p of the modal scale form for ∂φ/∂p = ``d``, (sensors, parameters)."""
    return np.asarray(ModalScale().derivative(phi, x, std) @ d)
