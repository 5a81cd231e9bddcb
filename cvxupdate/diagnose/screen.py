"""The short list: how much of the residual each word at each place could explain, to first order, beside the ordinary parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.fit import bounds_of, prior_scales
from cvxupdate.diagnose.forward import Changes
from cvxupdate.diagnose.residual import Fault, ResponsePoint
from cvxupdate.diagnose.signals import Complex, Real
from cvxupdate.physics.base import Candidate

AT_BOUND = 1e-3  # of a bound: that near counts as on it


@dataclass(frozen=True)
class Score:
    """A candidate's share of the residual that it explains (0..1) and its first-order size ``p``, with the side it may take respected."""

    candidate: Candidate
    share: float
    p: Real


@dataclass(frozen=True)
class Left:
    """What the ordinary unknowns cannot take up of a point's residual.

    ``residual`` (rows + priors,) weighted; ``basis`` an orthonormal basis of what they can take up; ``rows`` those of the recordings.
    """

    residual: Real
    basis: Real
    rows: int

    def freed(self, J: Real) -> Real:
        """Weighted columns (rows, n) freed of what the ordinary unknowns can take up, (rows + priors, n)."""
        padded = np.vstack([J, np.zeros((len(self.residual) - self.rows, J.shape[1]))])
        return np.asarray(padded - self.basis @ (self.basis[: self.rows].T @ J))


def left_over(point: ResponsePoint, rows: NDArray[np.bool_] | None = None) -> Left:
    """`Left` at a point, of all rows or of some. Ordinary unknowns that have reached a bound take up nothing."""
    A, _ = point.system().weighted()
    values, weights, _ = point.differences
    r = -weights * values
    if rows is not None:
        A, r = A[rows], r[rows]
    bounds = bounds_of(point.setting)
    free = (point.p > bounds.lower + AT_BOUND * np.abs(bounds.lower)) & (point.p < bounds.upper - AT_BOUND * np.abs(bounds.upper))
    scales = prior_scales(point.setting)[free]
    Q, _ = np.linalg.qr(np.vstack([A[:, free], np.diag(1.0 / scales)]))
    residual = np.concatenate([r, -point.p[free] / scales])
    return Left(residual - Q @ (Q.T @ residual), Q, len(r))


def screen(point: ResponsePoint, candidates: Sequence[Candidate]) -> list[Score]:
    """Scores in the order of ``candidates``.

    Residual and columns are weighted and freed of what the ordinary unknowns (with their priors) can take up; a candidate's share is the part of
    the squared residual that its own best size removes.
    """
    left = left_over(point)
    total = float(left.residual @ left.residual)
    out = []
    for c, J in zip(candidates, columns_of(point, candidates), strict=True):
        if J is None:
            out.append(Score(c, 0.0, np.zeros(c.extra)))
            continue
        Jp = left.freed(J)
        norms = np.linalg.norm(Jp, axis=0)
        if np.any(norms <= 1e-12 * np.maximum(np.linalg.norm(J, axis=0), 1e-300)):
            out.append(Score(c, 0.0, np.zeros(c.extra)))
            continue
        best, *_ = np.linalg.lstsq(Jp / norms, left.residual, rcond=1e-8)
        best = best / norms
        if c.sign > 0 and best[0] < 0.0:
            out.append(Score(c, 0.0, np.zeros(len(best))))
            continue
        rest = left.residual - Jp @ best
        out.append(Score(c, 1.0 - float(rest @ rest) / total, best))
    return out


def columns_of(point: ResponsePoint, candidates: Sequence[Candidate]) -> Iterator[Real | None]:
    """Weighted columns (rows, n) of each candidate in turn; None where it has none."""
    flat = [1.0 / s.scale().reshape(-1) for s in point.setting.signals]
    single: dict[tuple[str, int], list[Complex]] = {}
    for c in candidates:
        parts = [single[(c.physics, e)] for e in c.members if (c.physics, e) in single] if len(c.members) > 1 and c.additive else []
        if parts and len(parts) == len(c.members):  # a set of elements moves as the sum of its members
            columns = [[np.sum(pieces, axis=0) for pieces in zip(*parts, strict=True)]]
        else:
            columns = _columns(point, c)
        if len(c.members) == 1 and c.additive and columns:
            single[(c.physics, c.members[0])] = columns[0]
        yield np.stack([_stack(col, flat) for col in columns], axis=1) if columns else None


def _stack(columns: Sequence[Complex], weights: Sequence[Real]) -> Real:
    parts = []
    for c, w in zip(columns, weights, strict=True):
        flat = c.reshape(-1)
        parts += [w * flat.real, w * flat.imag]
    return np.concatenate(parts)


def _columns(point: ResponsePoint, c: Candidate) -> list[list[Complex]]:
    """For every column of the candidate: rows of every signal."""
    if c.channel is not None:
        return [_sensor_column(point, c)]
    if c.tuned is not None:
        return [_tuned_column(point, c.tuned)]
    out = []
    for blocks in c.tangent:
        if not blocks:
            return []
        change = Changes.of([blocks], point.modes, point.low)
        out.append([r.rows(change.columns(r, g)[0]) for r, g in zip(point.responses, point.green, strict=True)])
    return out


def _sensor_column(point: ResponsePoint, c: Candidate) -> list[Complex]:
    fault = Fault(c.channel or "", c.sensor or "", delay_unit(point), c.other)
    return [r.rows(fault.rate(0.0, r.signal, point.faulty(r.signal, r.raw))) for r in point.responses]


def delay_unit(point: ResponsePoint) -> float:
    """A delay that turns the phase by one radian at the top of the band, s."""
    return 1.0 / (2.0 * np.pi * point.setting.top)


def _tuned_column(point: ResponsePoint, tuned: tuple[int, float, float]) -> list[Complex]:
    """A hidden oscillator of one gram-like unit of mass: dynamic mass s² (2ζωs + ω²) / (s² + 2ζωs + ω²) at its DOF."""
    row, frequency, zeta = tuned
    omega = 2.0 * np.pi * frequency
    out = []
    for r, g in zip(point.responses, point.green, strict=True):
        s = r.signal.s
        soft = 2.0 * zeta * omega * s + omega**2
        out.append(r.rows(-(r.drive * s**2 * soft / (s**2 + soft))[:, None, None] * g.left[row][:, :, None] * g.right[row][:, None, :]))
    return out
