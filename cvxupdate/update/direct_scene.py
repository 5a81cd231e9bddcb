"""What the direct methods are given: measured modes at all DOFs, and the model's beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate import mac
from cvxupdate.direct.methods import Request
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.ceam_expand import expand
from cvxupdate.residual.ceam_modes import AssignedMode, assigned_modes, unstated
from cvxupdate.residual.pairing import pairing_modes, start_pairing
from cvxupdate.residual.shape_rows import channel_rows, real_shapes
from cvxupdate.spec import Spec
from cvxupdate.update.measured_modes import modal_tables

SURPLUS = 6
"""Modes computed beyond the measured ones, among which partners are sought."""
Real = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Scene:
    """The model with its modes, the tables to fit and to hold out, the ``places`` of the model's
    mode of each measured one that has no shape (−1 where it has one), and the ``request``;
    ``shaped`` says whether shapes were measured."""

    model: Model
    modes: Modes
    tables: tuple[ModeTable, ...]
    places: tuple[Index, ...]
    request: Request
    shaped: bool

    @property
    def partial(self) -> bool:
        """Whether shapes had to be expanded."""
        return any(
            t.shapes is not None and len(np.unique(channel_rows(t, self.model))) < self.model.size
            for t in self.tables
        )


def scene(spec: Spec, model: Model, recordings: Sequence[Recording]) -> Scene:
    """The scene of a problem.

    Raises
    ------
    InputError
        Where there is no table of modes to fit, or a mode finds no partner.
    """
    if spec.update is None:
        raise InputError(f"{spec.path}: there is no [update] table. Add one with a method.")
    fit, held = modal_tables(recordings)
    tables = (*fit, *held)
    shaped = any(t.shapes is not None for t in fit)
    rule = spec.update.pairing if spec.update.pairing in ("fixed", "frequency") else "auto"
    bare = [t for t in tables if t.shapes is None]
    found: list[Index] = []
    modes = model_modes(model, min(model.size, _enough(tables)))
    if bare:
        wide = pairing_modes(model, bare, rule)
        modes = wide if len(wide.eigenvalues) > len(modes.eigenvalues) else modes
        first = sum(t.origin.use == "fit" for t in bare)
        found = list(start_pairing(model, modes, bare, rule, first).places)
    places = tuple(
        found.pop(0) if t.shapes is None else np.full(len(t.frequency), -1, dtype=np.int64)
        for t in tables
    )
    m = model.matrices()
    request = (
        _with_shapes(model, m, modes, fit, spec.update.expansion)
        if shaped
        else _without(model, m, modes, fit, places)
    )
    return Scene(model, modes, tables, places, request, shaped)


def _enough(tables: Sequence[ModeTable]) -> int:
    return sum(len(t.frequency) for t in tables) + SURPLUS


def _normal(shapes: NDArray[Any], M: Real) -> NDArray[Any]:
    """At unit modal mass, φᵀ M φ = 1."""
    return np.asarray(shapes / np.sqrt(np.einsum("ij,ij->j", shapes, M @ shapes)))


def _with_shapes(
    model: Model, m: Matrices, modes: Modes, fit: Sequence[ModeTable], expansion: str
) -> Request:
    M = np.asarray(m.M.toarray())
    assigned = assigned_modes(model, [_undamped(t) for t in fit])
    Phi = _normal(np.column_stack([_full(a, m, expansion, modes) for a in assigned]), M)
    partners = _partners(mac(modes.shapes, Phi))
    eigenvalues = np.array([abs(a.s) ** 2 for a in assigned])
    damped = assigned_modes(model, fit, "hysteretic")
    zeta = np.array([_ratio(a.s) for a in damped])
    waves = None
    if np.any(zeta > 0.0):
        wide = [np.asarray(expand(a, m, expansion, modes), dtype=complex) for a in damped]
        waves = _normal(np.column_stack(wide).astype(complex), M)
    return Request(
        np.asarray(m.K.toarray()),
        M,
        Phi,
        eigenvalues,
        _own(modes, M, partners, Phi),
        np.asarray(modes.eigenvalues)[partners],
        partners,
        zeta,
        waves,
        np.column_stack([_deviation(model, a, x) for a, x in zip(assigned, Phi.T, strict=True)]),
        2.0 * eigenvalues * np.array([a.rate_std for a in assigned]),
    )


def _without(
    model: Model, m: Matrices, modes: Modes, fit: Sequence[ModeTable], places: Sequence[Index]
) -> Request:
    """Of frequencies alone: the model's shapes stand where none was measured."""
    M = np.asarray(m.M.toarray())
    partners = np.concatenate([p[p >= 0] for p in places[: len(fit)]])
    f = np.concatenate([t.frequency[p >= 0] for t, p in zip(fit, places, strict=False)])
    if not len(partners):
        raise InputError("method direct: no measured mode has a partner among the model's.")
    own = _own(modes, M, partners, None)
    return Request(
        np.asarray(m.K.toarray()),
        M,
        own,
        (2.0 * np.pi * f) ** 2,
        own,
        np.asarray(modes.eigenvalues)[partners],
        partners,
    )


def _own(modes: Modes, M: Real, partners: Index, Phi: Real | None) -> Real:
    own = _normal(modes.shapes[:, partners], M)
    if Phi is None:
        return np.asarray(own)
    return np.asarray(own * np.where(np.einsum("ij,ij->j", own, M @ Phi) < 0.0, -1.0, 1.0))


def _ratio(s: complex) -> float:
    """ζ of a hysteretic rate, s² = −ω² (1 + 2 i ζ)."""
    square = -(s**2)
    return 0.5 * square.imag / square.real


def _deviation(model: Model, mode: AssignedMode, shape: Real) -> Real:
    """Deviations (N,) of a full shape: those measured at its scale; where nothing was measured, a
    part in a hundred of the largest translation or rotation, and no less than the mean one
    measured."""
    out = unstated(model, np.arange(model.size, dtype=np.int64), shape)
    scale = float(np.linalg.norm(shape[mode.at]))
    measured = mode.std * scale
    out = np.maximum(out, float(np.mean(measured)) if not mode.full(model.size) else 0.0)
    out[mode.at] = measured
    return np.asarray(out)


def _undamped(table: ModeTable) -> ModeTable:
    """Real shapes and no damping: what most of these methods take."""
    shapes = None if table.shapes is None else real_shapes(table.shapes)
    return replace(table, shapes=shapes, damping=np.full(len(table.frequency), np.nan))


def _full(mode: AssignedMode, m: Matrices, expansion: str, modes: Modes) -> Real:
    return np.asarray(np.real(expand(mode, m, expansion, modes)), dtype=np.float64)


def _partners(likeness: Real) -> Index:
    """For each measured mode a mode of the model of its own, of the largest MACs in sum."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(-likeness.T)
    out = np.empty(likeness.shape[1], dtype=np.int64)
    out[rows] = columns
    return out
