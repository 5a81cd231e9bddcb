"""The modes that an eigenstructure assignment asks for: measured ones, and further ones of the
model itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.shape_rows import Index, channel_rows, real_shapes

SHAPE_STD = 0.01  # of the largest translation (rotation), where no deviation was given
FREQUENCY_STD = 1e-3  # of the frequency, where none was given
DAMPING_STD = 0.05  # of the damping, where none was given
OWN_FREQUENCY_STD, OWN_SHAPE_STD = (
    0.05,
    0.1,
)  # of the model's own modes: how far a model that is to be corrected may be off


@dataclass(frozen=True)
class AssignedMode:
    """One mode to assign: (s² M + s C + K + i D) φ = 0.

    ``s`` is the complex rate (rad/s); with hysteretic damping s² = −λ with λ = ω² (1 + i η), η = 2
    ζ. ``shape`` (n,) holds the entries at the free DOFs ``at`` (n,), ``std`` (n,) their deviations,
    ``rate_std`` |δs| / |s|. ``real``: an undamped mode, whose equations leave C and D out.
    """

    label: str
    s: complex
    at: Index
    shape: NDArray[Any]
    std: Real
    rate_std: float
    real: bool

    def full(self, size: int) -> bool:
        """Whether every one of the model's ``size`` DOFs was measured."""
        return len(self.at) == size


def damping_kind(model: Model) -> str:
    """``"hysteretic"`` when the model has a structural damping matrix, ``"viscous"`` when it has a
    viscous one only, else ``"none"``."""
    m = model.matrices(model.zero())
    if abs(m.D).sum() > 0.0:
        return "hysteretic"
    changed = {
        name
        for j in range(len(model.parameters))
        for b in model.derivative(j)
        for name in ("C", "D")
        if getattr(b, name) is not None
    }
    if "D" in changed:
        return "hysteretic"
    return "viscous" if abs(m.C).sum() > 0.0 or changed else "none"


def rate(frequency: float, damping: float, kind: str) -> complex:
    """s of a mode from its frequency (Hz) and fraction of critical: s² = −ω² (1 + 2 i ζ)
    hysteretic, s = −ζω + iω√(1−ζ²) viscous."""
    omega = 2.0 * np.pi * frequency
    if kind == "viscous":
        return complex(omega * (-damping + 1j * np.sqrt(1.0 - damping**2)))
    return complex(1j * omega * np.sqrt(1.0 + 2j * damping))


def assigned_modes(
    model: Model, tables: Sequence[ModeTable], kind: str | None = None
) -> tuple[AssignedMode, ...]:
    """Every measured mode that has a shape, as a mode to assign.

    A mode whose damping was measured is assigned with its complex rate and shape when the model is
    damped; the others are assigned as undamped modes, their shapes turned to the most nearly real
    phase.

    Raises
    ------
    InputError
        When no mode has a shape.
    RecordingError
        For a channel at a node that the model does not have.
    """
    kind = damping_kind(model) if kind is None else kind
    out: list[AssignedMode] = []
    for table in tables:
        if table.shapes is None:
            continue
        rows = channel_rows(table, model)
        turned = real_shapes(table.shapes)
        for r, f in enumerate(table.frequency.tolist()):
            zeta = float(table.damping[r])
            damped = kind != "none" and np.isfinite(zeta)
            values = np.asarray(table.shapes[r]) if damped else turned[r]
            ok = (rows >= 0) & np.isfinite(values)
            if ok.sum() < 2:
                continue
            given = (
                np.full(len(rows), np.nan)
                if table.shape_std is None
                else np.broadcast_to(table.shape_std, np.shape(table.shapes))[r]
            )
            at, shape = rows[ok], values[ok]
            size = float(np.linalg.norm(shape))
            std = np.where(np.isfinite(given[ok]), given[ok], unstated(model, at, shape)) / size
            stated = not table.relative_only and np.isfinite(table.frequency_std[r])
            rates = [float(table.frequency_std[r]) / f if stated else FREQUENCY_STD]
            if damped:
                own = float(table.damping_std[r])
                rates.append(own if np.isfinite(own) else DAMPING_STD * zeta)
            out.append(
                AssignedMode(
                    f"{table.origin.name}: {f:.5g} Hz",
                    rate(f, zeta if damped else 0.0, kind),
                    at,
                    shape / size,
                    std,
                    float(np.hypot.reduce(rates)),
                    not damped,
                )
            )
    if not out:
        raise InputError(
            'method ceam needs measured mode shapes: a recording of kind "modes" with use = '
            '"fit" whose rows have a `shape`.'
        )
    return tuple(out)


def unstated(model: Model, at: Index, shape: NDArray[Any]) -> Real:
    """Deviations where none was given: 1 % of the largest translation, of the largest rotation."""
    turns = model.dof_kind[at] >= 3
    out = np.zeros(len(at))
    for chosen in (turns, ~turns):
        if chosen.any():
            largest = float(np.abs(shape[chosen]).max())
            out[chosen] = SHAPE_STD * (largest if largest > 0.0 else float(np.abs(shape).max()))
    return out


def self_assigned(
    model: Model,
    modes: Modes,
    wanted: Sequence[int],
    frequency_std: float = OWN_FREQUENCY_STD,
    shape_std: float = OWN_SHAPE_STD,
    label: str = "model",
) -> tuple[AssignedMode, ...]:
    """Modes of the model itself (flexible mode numbers from 0) to be kept, within deviations
    relative to their frequency and largest entry."""
    at = np.arange(model.size, dtype=np.int64)
    out = []
    for i in wanted:
        shape = modes.shapes[:, modes.rigid + i]
        shape = shape / np.linalg.norm(shape)
        f = float(modes.frequencies[modes.rigid + i])
        out.append(
            AssignedMode(
                f"{label}: own mode {i + 1}, {f:.5g} Hz",
                rate(f, 0.0, "none"),
                at,
                shape,
                unstated(model, at, shape) * shape_std / SHAPE_STD,
                frequency_std,
                True,
            )
        )
    return tuple(out)


def with_own_shapes(
    model: Model, modes: Modes, assigned: Sequence[AssignedMode], places: Sequence[int], kind: str
) -> tuple[AssignedMode, ...]:
    """The measured eigenvalues with the model's own shapes (first stage of the two-stage
    assignment, 6.4.1 case 6).

    ``places`` are the places among ``modes`` of the partners of ``assigned``; a mode without
    partner (−1) is left out.
    """
    at = np.arange(model.size, dtype=np.int64)
    out = []
    for mode, i in zip(assigned, places, strict=True):
        if i < 0:
            continue
        shape = modes.shapes[:, i] / np.linalg.norm(modes.shapes[:, i])
        s = mode.s if mode.real or kind != "none" else complex(1j * abs(mode.s))
        std = unstated(model, at, shape) * OWN_SHAPE_STD / SHAPE_STD
        out.append(
            AssignedMode(
                f"{mode.label}, the model's shape",
                complex(1j * abs(s)),
                at,
                shape,
                std,
                mode.rate_std,
                True,
            )
        )
    return tuple(out)


def impedance(m: Matrices, mode: AssignedMode) -> Any:
    """Z(s) = s² M + s C + K + i D, sparse; real (K − ω² M) for an undamped mode."""
    if mode.real:
        return m.K + float((mode.s**2).real) * m.M
    return mode.s**2 * m.M + mode.s * m.C + m.K + 1j * m.D
