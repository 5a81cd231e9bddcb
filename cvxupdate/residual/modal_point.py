"""The modal comparison at one parameter vector: rows and their linear system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cvxupdate.fe.continued import Continued, continued_modes
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import DENSE, Modes, model_modes, natural_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.contraction import constant
from cvxupdate.residual.correlated import Joint, joined, joints
from cvxupdate.residual.derivatives import Derivatives, derivatives_of, stacked
from cvxupdate.residual.eigen import eigenvalue_derivatives
from cvxupdate.residual.exact_modal import exact_rows
from cvxupdate.residual.follow import follow
from cvxupdate.residual.misfit import least_misfit, scored_by_frequency
from cvxupdate.residual.modal_rows import Rows, eigenvalue_rows, measured_shapes, rows_of_shapes
from cvxupdate.residual.pairing import Start, highest_of, used_places
from cvxupdate.residual.repeated import aligned
from cvxupdate.residual.shape_forms import FORMS
from cvxupdate.residual.shape_gradients import Compared, Entries, ShapeRow, shape_gradients
from cvxupdate.residual.shape_rows import Index
from cvxupdate.system import LinearSystem


@dataclass(frozen=True)
class ModalResidual:
    """What is compared: a model, tables to fit and tables to score only, whether shapes count, and
    the initial pairing.

    ``count`` flexible modes are computed at every point; ``start`` pairs ``fit + hold_out`` in that
    order. ``muted`` are the (table, mode) whose shape is left out because its eigenvalue is
    repeated in the initial model, ``unseen`` those whose partner does not move any of the sensors
    there. ``form`` compares shapes (`residual.shape_forms`), their weights times ``shape_weight``;
    ``only_shapes`` leaves the eigenvalues without weight. ``continued``: modes come from those
    before (`fe.continued`), which may miss one that is not followed. ``repaired``: the fitted modes
    are paired anew at every point, by the least misfit: the objective is the lower envelope of all
    pairings. ``correlated``: the tables' covariances weigh the rows, else deviations alone.
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
    correlated: bool = False

    @property
    def tables(self) -> tuple[ModeTable, ...]:
        """Tables to fit, then tables to score."""
        return self.fit + self.hold_out

    @cached_property
    def constant_mass(self) -> bool:
        """Whether no parameter moves the mass matrix."""
        moved = derivatives_of(self.model, self.model.zero()).terms
        return not any(t.matrix == "M" for t in moved)

    def changed(self, **fields: Any) -> ModalResidual:
        """With other ``fields`` than model and tables: what depends on these stays worked out."""
        other, kept = replace(self, **fields), ("constant_mass", "_everywhere", "shape_table")
        other.__dict__.update({k: v for k, v in self.__dict__.items() if k in kept})
        return other

    @property
    def reducible(self) -> bool:
        """Whether a small model may stand for it: K linear in p, M constant."""
        return self._continues and self._everywhere is not None

    @cached_property
    def _everywhere(self) -> Derivatives | None:
        """∂K/∂p and ∂M/∂p where they are the same at every p."""
        if not constant(self.model):
            return None
        return stacked(derivatives_of(self.model, self.model.zero()), self.model.size)

    @cached_property
    def shape_table(self) -> tuple[ShapeRow, ...]:
        """Every measured shape that is compared: the recordings' part of each row."""
        return measured_shapes(self.model, self.fit, self.muted | self.unseen)

    @cached_property
    def _joined(self) -> dict[bytes, tuple[Joint, ...]]:
        """Joint rows by which measured modes are paired."""
        return {}

    def joints(self, places: Sequence[Index], shapes: Sequence[ShapeRow]) -> tuple[Joint, ...]:
        """The correlated rows of a point, factored once."""
        if not self.correlated or all(t.covariance is None for t in self.fit):
            return ()
        key = b"".join((q >= 0).tobytes() for q in places)
        if key not in self._joined:
            self._joined[key] = joints(
                self.fit, places, shapes, self.form, self.shape_weight, not self.only_shapes
            )
        return self._joined[key]

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
        known = self.start if before is None else before
        first, places = known.modes, known.places
        begin, highest = first, highest_of(places)
        for _ in range(2):  # again where one went among the modes that had not converged
            modes, found = self._modes(p, m, begin, highest)
            point = self.paired_at(p, m, modes, first, places)
            highest = highest_of(point.places)
            if found is None or highest < found.exact:
                return replace(point, solved=found)
            begin = found.modes
        return self.paired_at(p, m, self._anew(p, m), first, places)

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

    def paired_at(
        self, p: Real, m: Matrices, modes: Modes, first: Modes, places: Sequence[Index]
    ) -> ModalPoint:
        """The point with every measured mode found again among ``modes``."""
        fitted = used_places(places[: len(self.fit)])
        scored = np.setdiff1d(
            used_places(places[len(self.fit) :]), fitted
        )  # a fitted mode that was measured again goes with it
        modes = aligned(modes, m, first.shapes[:, np.concatenate([fitted, scored])])
        went = {-1: -1}
        for used in (fitted, scored) if len(scored) else (fitted,):
            found = follow(
                first.shapes[:, used],
                m.M,
                modes,
                np.array([v for v in went.values() if v >= 0], dtype=np.int64),
                first.eigenvalues[used] if self.model.exact else None,
            )
            went |= dict(zip(used.tolist(), found.tolist(), strict=True))
        moved = tuple(np.array([went[i] for i in q.tolist()], dtype=np.int64) for q in places)
        moved = scored_by_frequency(self.hold_out, self.start.loose, moved, modes)
        point = ModalPoint(self, p, m, modes, moved)
        if not self.repaired:
            return point
        shapes = point.compared_shapes() if self.shapes else []
        places_now = least_misfit(
            self.fit, moved, modes, shapes, FORMS[self.form], self.shape_weight
        )
        return ModalPoint(self, p, m, modes, places_now)


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
    def separate(self) -> Rows:
        """(model − measured, weights, labels) row by row: eigenvalues in (rad/s)², then shapes."""
        r = self.residual
        eigen = eigenvalue_rows(r.fit, self.places, self.modes, 0.0 if r.only_shapes else 1.0)
        labels, form = self.residual.model.labels, FORMS[r.form]
        shaped = rows_of_shapes(r.fit, self._shapes, self.modes, form, r.shape_weight, labels)
        values, weights = (np.concatenate([eigen[i], shaped[i]]) for i in (0, 1))
        return values, weights, (*eigen[2], *shaped[2])

    @cached_property
    def differences(self) -> Rows:
        """The rows to fit: those of `separate`, combined where their errors are correlated."""
        values, weights, labels = self.separate
        out, weighed = values.copy(), weights.copy()
        for joint in self.joints:
            out[joint.at] = joint.values(values, self._seen)
            weighed[joint.at] = 1.0
        return out, weighed, labels

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The rows whose errors are correlated."""
        return self.residual.joints(self.places, self._shapes)

    @cached_property
    def _shapes(self) -> list[ShapeRow]:
        return self.compared_shapes() if self.residual.shapes else []

    @property
    def _seen(self) -> list[Real]:
        return [self.modes.shapes[s.sensors, s.place] for s in self._shapes]

    def system(self) -> LinearSystem:
        """Linearised at this point: A p − b ≈ model(p) − measured."""
        (values, weights, labels), rows = self.differences, self._linear[0]
        form, raw = FORMS[self.residual.form], self.separate[0]
        A = joined(self.joints, form, self._shapes, self._seen, rows, raw)
        columns = tuple(q.name for q in self.residual.model.parameters)
        return LinearSystem(A, A @ self.p - values, weights, columns, labels)

    @cached_property
    def _linear(self) -> tuple[list[Real], list[Real]]:
        return self._rows(Entries() if self.joints else FORMS[self.residual.form])

    @property
    def solutions(self) -> list[Real]:
        """What the derivatives of the shapes were solved for, each (N, k)."""
        return self._linear[1]

    @property
    def paired(self) -> Index:
        """The modes of the model that are fitted, measured mode after measured mode."""
        return np.array(
            [i for k in range(len(self.residual.fit)) for i in self.places[k].tolist() if i >= 0],
            dtype=np.int64,
        )

    def _rows(self, form: Compared) -> tuple[list[Real], list[Real]]:
        """∂ of the eigenvalues and of every shape in ``form``; what the latter were solved for."""
        r = self.residual
        if r.model.exact:
            return exact_rows(r.model, self.p, self.modes, self.paired, form, self._shapes), []
        derivatives, at = r.derivatives(self.p), self.paired
        values, shapes = self.modes.eigenvalues[at], self.modes.shapes[:, at]
        rows = [eigenvalue_derivatives(values, shapes, derivatives)]
        if not r.shapes:
            return rows, []
        every = (self._shapes, self.modes, self.matrices, derivatives, self.solved)
        shaped, solutions = shape_gradients(form, *every)
        return rows + shaped, solutions

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
