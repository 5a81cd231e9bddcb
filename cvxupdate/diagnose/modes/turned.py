"""Imaginary parts of measured shapes: what damping at single places turns against the rest.

To first order in damping the complex shape of mode r is φ_r - i Σ_q φ_q φ_qᵀ(ω_r C + D)φ_r /
(ω_q² - ω_r²), q ≠ r (Lancaster 1966; Ewins 2000, 2.7): linear in the size of a dashpot, other at
every place, and nothing of proportional damping (Caughey 1960). What the modes beyond those known
add is static.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.modes.complexity import deviations
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.block import Index
from cvxupdate.fe.factor import factored
from cvxupdate.physics.effect import ModelChange
from cvxupdate.recordings.phase import rotated
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.repeated import REPEATED
from cvxupdate.residual.shape_rows import channel_rows

APART = 3.0  # half-power bandwidths that another mode is away, for the first order to do


@dataclass(frozen=True)
class Row:
    """One measured shape: its mode among the model's, the DOFs (channels,) of its channels, how all
    modes move these (``sensed``, (channels, modes)), its imaginary parts over their deviations
    ``off`` (channels,), what scales the model's shape to it over the same deviations ``unit``
    (channels,)."""

    mode: int
    dofs: Index
    sensed: Real
    off: Real
    unit: Real


@dataclass(frozen=True)
class Turned:
    """Imaginary parts of shapes beside the modes of a model (`ModalPoint`)."""

    point: ModalPoint
    rows: tuple[Row, ...]

    @property
    def off(self) -> Real:
        """All of them over their deviations, (n,)."""
        return np.concatenate([np.zeros(0), *(r.off for r in self.rows)])

    def rate(self, change: ModelChange) -> Real:
        """What one unit of an effect's parameter makes of them, (n,)."""
        phi, out = self._grounded, []
        for row in self.rows:
            omega, force = np.sqrt(self.point.modes.eigenvalues[row.mode]), np.zeros(len(phi))
            for b in change.tangent[0]:
                for part, by in ((b.C, omega), (b.D, 1.0)):
                    if part is not None:
                        local = np.einsum("eij,ej->ei", part, phi[b.dofs, row.mode])
                        np.add.at(force, b.dofs, by * local)
            out.append(self._turned(row, force[:-1]))
        return np.concatenate([np.zeros(0), *out])

    def _turned(self, row: Row, force: Real) -> Real:
        """What a force of damping (N,) in one mode makes of the imaginary parts at its sensors, its
        best phase taken out."""
        modes, moving = self.point.modes, np.flatnonzero(force)
        share = modes.shapes[moving].T @ force[moving]
        apart = modes.eigenvalues - modes.eigenvalues[row.mode]
        apart[np.abs(apart) <= REPEATED * modes.eigenvalues[row.mode]] = np.inf  # and itself
        own = row.sensed[:, row.mode]
        moved = -(row.sensed @ (share / apart))
        if self._flexibility is not None:
            flexible = self._flexibility[:, moving] @ force[moving]
            at = np.minimum(self._sensors.searchsorted(row.dofs), len(flexible) - 1)
            moved -= np.where(row.dofs >= 0, flexible[at], 0.0)
            moved += row.sensed @ (share / modes.eigenvalues)
        moved -= own * (own @ moved) / max(float(own @ own), 1e-300)
        return np.asarray(moved * row.unit)

    @cached_property
    def _grounded(self) -> Real:
        """The modes' shapes, and a last row for DOF −1, the ground."""
        shapes = self.point.modes.shapes
        return np.vstack([shapes, np.zeros((1, shapes.shape[1]))])

    @cached_property
    def _sensors(self) -> Index:
        """Free DOFs with a sensor, ascending."""
        every = np.concatenate([np.zeros(0, dtype=np.int64), *(r.dofs for r in self.rows)])
        return np.unique(every[every >= 0])

    @cached_property
    def _flexibility(self) -> Real | None:
        """K⁻¹ at the sensors, (sensors, N); None of a structure that is free to move."""
        if self.point.modes.rigid or not len(self._sensors):
            return None
        K = self.point.matrices.K
        unit = np.zeros((K.shape[0], len(self._sensors)))
        unit[self._sensors, np.arange(len(self._sensors))] = 1.0
        return np.asarray(factored(K, "the stiffness matrix").solve(unit).T)


def turned_of(point: ModalPoint, measured: Sequence[ModeTable]) -> Turned | None:
    """Of the complex shapes of the tables fitted at a point, ``measured`` with the deviations of
    noise alone; without modes that have another near them. None where there are none."""
    rows = []
    modes, model = point.modes, point.residual.model
    omega = np.sqrt(np.maximum(modes.eigenvalues, 0.0))
    for table, places in zip(measured, point.places, strict=False):
        if table.shapes is None or not np.iscomplexobj(table.shapes):
            continue
        turned, std = rotated(table.shapes), deviations(table)
        dofs = channel_rows(table, model)
        for i, at in enumerate(places.tolist()):
            if at < 0 or _crowded(omega, at, float(table.damping[i])):
                continue
            known = np.isfinite(turned[i])
            sensed = _at(modes.shapes, dofs[known])
            own = sensed[:, at]
            scale = float(turned[i].real[known] @ own) / max(float(own @ own), 1e-300)
            off = turned[i].imag[known] / std[i][known]
            rows.append(Row(at, dofs[known], sensed, off, scale / std[i][known]))
    return Turned(point, tuple(rows)) if rows else None


def _crowded(omega: Real, at: int, zeta: float) -> bool:
    others = np.delete(omega, at)
    wide = APART * 2.0 * (zeta if np.isfinite(zeta) else 0.0) * omega[at]
    return bool(np.any(np.abs(others - omega[at]) < wide))


def _at(shapes: Real, dofs: Index) -> Real:
    """Rows of shapes; what a support holds does not move."""
    return np.where(dofs[:, None] >= 0, shapes[dofs], 0.0)
