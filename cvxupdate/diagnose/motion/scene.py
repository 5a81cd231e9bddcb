"""A model at a point, what its recordings say beyond it, and whether a force at one place could be
it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.motion.point import MotionPoint
from cvxupdate.diagnose.motion.smoother import Beyond
from cvxupdate.diagnose.responses.first_order import linearised
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.diagnose.screen.projection import Linearised, Projection
from cvxupdate.fe.synthesis.pieces import sensor_rows

NUISANCE_PLACES = 40  # places at which nuisance parameters are fitted beside any force


@dataclass(frozen=True)
class Scene:
    """A point, what its runs say beyond it, and the projected residual."""

    point: MotionPoint
    beyond: tuple[Beyond, ...]
    nuisance: Linearised
    left: Projection

    @classmethod
    def of(cls, point: MotionPoint) -> Scene:
        """At a point whose signals are sharp (their points are their rows)."""
        names = dict.fromkeys(s.name for s in point.setting.signals)
        beyond = tuple(Beyond.of(point, point.setting.runs[name]) for name in names)
        nuisance = linearised(point)
        return cls(point, beyond, nuisance, Projection.of(nuisance))

    def reaches(self, shapes: Real) -> list[Complex]:
        """Weighted receptances (points, sensors, places) of every signal from directions with modal
        ``shapes`` (modes, places)."""
        out = []
        for s in self.point.setting.signals:
            at = self._at(s)
            lam = np.maximum(self.point.modes.eigenvalues, 0.0)
            slow = 2.0 * self.point.damping * np.sqrt(lam) + self.point.further
            inverse = 1.0 / (s.s[:, None] ** 2 + slow * s.s[:, None] + lam)
            weight = (s.s**s.order)[:, None] / s.scale()[:, :, 0]
            both = at.T[:, :, None] * shapes[:, None, :]  # (modes, sensors, places)
            values = inverse @ both.reshape(len(lam), -1)
            out.append(weight[:, :, None] * values.reshape(len(s.s), at.shape[0], -1))
        return out

    def _at(self, s: Signal) -> Real:
        shapes = self.point.modes.shapes
        phi = np.vstack([shapes, np.zeros((1, shapes.shape[1]))])
        return np.asarray(phi[sensor_rows(self.point.setting.model, s.sensors)])

    def residuals(self) -> list[Complex]:
        """Weighted, measured less modelled (points, sensors), of every signal."""
        modelled = self.point.modelled()
        return [
            ((s.Y - y) / s.scale())[:, :, 0]
            for s, y in zip(self.point.setting.signals, modelled, strict=True)
        ]

    def left_by_force(self, shapes: Real) -> Real:
        """(places,): the part of the squared residual (0 to 1) that no force at a place alone could
        explain, whatever it did, the nuisance parameters fitted beside it; NaN with one sensor,
        which any force satisfies. Places far off by the residual as it is are left at that."""
        residuals, reaches = self.residuals(), self.reaches(shapes)
        if all(r.shape[1] == 1 for r in residuals):
            return np.full(shapes.shape[1], np.nan)
        whole = sum(float(np.sum(np.abs(r) ** 2)) for r in residuals)
        taken = np.zeros(shapes.shape[1])
        for r, H in zip(residuals, reaches, strict=True):
            size = np.maximum(np.sum(np.abs(H) ** 2, axis=1), 1e-300)
            taken += np.sum(np.abs(np.einsum("smp,sm->sp", np.conj(H), r)) ** 2 / size, axis=0)
        left = 1.0 - taken / max(whole, 1e-300)
        for k in np.argsort(left, kind="stable")[:NUISANCE_PLACES]:
            alone = self._left_beside([H[:, :, k] for H in reaches], residuals)
            left[k] = alone / max(self.left.total, 1e-300)
        return left

    def _left_beside(self, reach: Sequence[Complex], residuals: Sequence[Complex]) -> float:
        """Squares left by any force at a place with the nuisance parameters beside it."""
        at, rows = 0, []
        A, p, scales = self.nuisance.A, self.nuisance.p, self.nuisance.scales
        for H, r in zip(reach, residuals, strict=True):
            n = r.size
            both = np.concatenate(
                [
                    (A[at : at + n] + 1j * A[at + n : at + 2 * n]).reshape(*r.shape, -1),
                    r[:, :, None],
                ],
                axis=2,
            )
            at += 2 * n
            unit = H / np.maximum(np.linalg.norm(H, axis=1, keepdims=True), 1e-300)
            both = (
                both - unit[:, :, None] * np.einsum("sm,smc->sc", np.conj(unit), both)[:, None, :]
            )
            flat = both.reshape(n, -1)
            rows += [flat.real, flat.imag]
        M = np.vstack([*rows, np.hstack([np.diag(1.0 / scales), -(p / scales)[:, None]])])
        G = M.T @ M
        best = np.linalg.lstsq(G[:-1, :-1], G[:-1, -1], rcond=None)[0]
        return float(max(G[-1, -1] - best @ G[:-1, -1], 0.0))
