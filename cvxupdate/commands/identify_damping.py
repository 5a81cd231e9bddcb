"""Damping to begin with, of measured modes on a model: the damping matrix of each mode (3.44)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.commands.identified import MeasuredDamping, Mode, ModeSetResult
from cvxupdate.commands.identify_frf import complexity, labels_of, laws_of
from cvxupdate.errors import CvxupdateError, RecordingError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.types import ModeTable

LARGEST = 300
"""DOFs up to which the damping matrices of single modes are written as text, 1 MB each."""


def with_measured_damping(
    sets: Sequence[ModeSetResult], model: Model, expansion: str = "null-space"
) -> list[ModeSetResult]:
    """Each set with `measured_damping`, where it has shapes and ratios and the model is small
    enough; else as it was."""
    out = []
    for s in sets:
        try:
            found = measured_damping(s, model, expansion) if model.size <= LARGEST else None
        except CvxupdateError as error:
            s, found = (
                replace(s, notes=(*s.notes, f"no damping matrix of its modes: {error}")),
                None,
            )
        out.append(s if found is None else replace(s, measured=found))
    return out


def measured_damping(
    s: ModeSetResult, model: Model, expansion: str = "null-space"
) -> MeasuredDamping | None:
    """The damping matrices of the modes of ``s`` whose ratio is known, with their measured shapes
    (3.44); None where none is, or the shapes are known at fewer than two DOFs of the model.

    Raises
    ------
    CvxupdateError
        For a channel that is not on the model, or shapes that cannot be expanded.
    """
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.residual.ceam_expand import expand
    from cvxupdate.residual.ceam_modes import assigned_modes
    from cvxupdate.residual.shape_rows import channel_rows

    known = [k for k, m in enumerate(s.modes) if m.damping > 0.0 < m.frequency]
    table = _table(s, known)
    if not known or int(np.sum(channel_rows(table, model) >= 0)) < 2:
        return None
    m = model.matrices()
    modes = model_modes(model, min(model.size, len(known) + 6))
    assigned = assigned_modes(model, [table], "none")
    if len(assigned) < len(known):
        return None
    Phi = np.column_stack([np.real(expand(a, m, expansion, modes)) for a in assigned])
    M_Phi = np.asarray(m.M @ Phi)
    mass = np.einsum("ij,ij->j", Phi, M_Phi)
    Phi, M_Phi = Phi / np.sqrt(mass), M_Phi / np.sqrt(mass)
    zeta = np.array([s.modes[k].damping for k in known])
    omega = 2.0 * np.pi * table.frequency
    likeness = np.abs(Phi.T @ M_Phi) - np.eye(len(known))
    return MeasuredDamping(
        model.labels,
        table.frequency,
        zeta,
        (M_Phi * np.sqrt(2.0 * omega * zeta)).T,
        float(likeness.max(initial=0.0)),
        1 + max(int(b.ids.max(initial=0)) for b in model.blocks),
    )


def _table(s: ModeSetResult, known: Sequence[int]) -> ModeTable:
    """The modes ``known`` as a table without damping, at places that are one DOF each."""
    from cvxupdate.recordings.types import Channel, ModeTable, Origin

    at = [k for k, d in enumerate(s.dofs) if d and "(" not in s.labels[k]]
    nothing = np.full(len(known), np.nan)
    shapes: NDArray[Any] = s.shapes[np.ix_(known, at)]
    return ModeTable(
        Origin(s.recording, s.recording),
        np.array([s.modes[k].frequency for k in known]),
        nothing,
        nothing,
        nothing,
        tuple(Channel(s.nodes[k], s.dofs[k], s.quantity) for k in at),
        shapes,
        None,
        np.zeros(len(known), dtype=np.int64),
    )


def of_table(table: ModeTable) -> ModeSetResult:
    """A table of modes as it is: nothing to identify, but its damping to begin with.

    Raises
    ------
    RecordingError
        Where no ratio is known.
    """
    from cvxupdate.correlate.mac import mac

    if not np.any(table.damping > 0.0):
        raise RecordingError(
            "a table of modes without damping ratios; there is nothing to identify"
        )
    count = len(table.frequency)
    shaped = table.shapes is not None
    shapes = np.asarray(table.shapes, dtype=complex) if shaped else np.zeros((count, 0), complex)
    channels = table.channels if shaped else ()
    seen = np.nan_to_num(shapes)
    mpc, mpd = complexity(seen)
    figures = (
        table.frequency,
        np.full(count, np.nan) if table.relative_only else table.frequency_std,
        table.damping,
        table.damping_std,
        mpc,
        mpd,
    )
    std = np.full(shapes.shape, np.nan)
    return ModeSetResult(
        recording=table.origin.name,
        kind="modes",
        method="table",
        band=(float(table.frequency.min()), float(table.frequency.max())),
        modes=tuple(
            Mode(*(float(v) for v in row), pair=int(pair))
            for *row, pair in zip(*figures, table.pairs, strict=True)
        ),
        shapes=shapes,
        shape_std=std if table.shape_std is None else np.broadcast_to(table.shape_std, std.shape),
        labels=labels_of(channels),
        nodes=tuple(c.node for c in channels),
        dofs=tuple(c.dof for c in channels),
        quantity=channels[0].quantity if channels else "displacement",
        auto_mac=mac(seen.T, seen.T) if shaped else np.eye(count),
        diagram=None,
        spectrum_lines=np.zeros(0),
        spectrum=np.zeros((0, 0)),
        spectrum_says="",
        fit=None,
        normal=(),
        laws=laws_of(table),
        notes=("a table of modes: nothing was identified, its damping ratios are taken",),
    )
