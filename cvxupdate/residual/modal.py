"""Modes against modes: eigenvalues (2.100), and mode shapes (2.99) where they were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.eigen import derivatives_of, splitting
from cvxupdate.residual.modal_point import ModalPoint, ModalResidual
from cvxupdate.residual.pairing import MARGIN, pairing_modes, start_pairing, used_places
from cvxupdate.residual.repeated import clusters, oriented, turned
from cvxupdate.residual.shape_forms import ModalScale
from cvxupdate.residual.shape_rows import Index, shape_entries, visible

__all__ = ["ModalPoint", "ModalResidual", "modal_residual", "scaled_derivative"]


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
    used = used_places(start.places)
    if not len(used_places(start.places[: len(fit)])) and any(len(t.frequency) for t in fit):
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


def scaled_derivative(phi: Real, d: Real, x: Real, std: Real) -> Real:
    """∂(q φ)/∂p of the modal scale form for ∂φ/∂p = ``d``, (sensors, parameters)."""
    return np.asarray(ModalScale().derivative(phi, x, std) @ d)
