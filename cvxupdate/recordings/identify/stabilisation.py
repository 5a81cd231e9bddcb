"""Stabilisation diagram: which poles keep their place from one model order to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.recordings.identify.plscf import PoleSet
from cvxupdate.recordings.types import Complex, Real


@dataclass(frozen=True)
class Criteria:
    """What makes two poles of different order the same: relative difference of frequency below
    ``frequency``, relative difference of damping below ``damping`` (plus ``damping_floor``,
    fraction of critical), and modal assurance of the participations above ``participation`` (with
    several references); fractions of critical damping up to ``max_damping`` are physical.
    ``fraction``: a mode must be found in this fraction of the orders (at least ``least``)."""

    frequency: float = 0.01
    damping: float = 0.5
    damping_floor: float = 0.001
    participation: float = 0.8
    max_damping: float = 0.2
    fraction: float = 0.3
    least: int = 4


@dataclass(frozen=True)
class Stabilisation:
    """All physical poles of all orders, ready to plot.

    ``order``, ``frequency`` (Hz), ``damping`` (fraction of critical), ``stable`` (same pole in the
    order below) are (poles,); ``pole`` (poles,) rad/s and ``participation`` (poles, references).
    """

    order: NDArray[np.int64]
    frequency: Real
    damping: Real
    stable: NDArray[np.bool_]
    pole: Complex
    participation: Complex


def participation_mac(a: Complex, b: Complex) -> Real:
    """Modal assurance between rows of a (n, references) and of b (m, references), (n, m); none with
    a row of zeros."""

    def unit(rows: Complex) -> Complex:
        size = np.linalg.norm(rows, axis=1, keepdims=True)
        return np.asarray(rows / np.where(size > 0.0, size, 1.0))

    return np.asarray(np.abs(np.conj(unit(a)) @ unit(b).T) ** 2)


def same(p: Complex, Lp: Complex, q: Complex, Lq: Complex, c: Criteria) -> NDArray[np.bool_]:
    """Which poles p (n,) are the same as which q (m,), by the criteria; (n, m)."""
    fp, fq = np.abs(p), np.abs(q)
    zp, zq = -p.real / fp, -q.real / fq
    near = np.abs(fp[:, None] - fq) < c.frequency * fq
    damped = np.abs(zp[:, None] - zq) < c.damping * np.maximum(zp[:, None], zq) + c.damping_floor
    alike = (
        participation_mac(Lp, Lq) > c.participation
        if Lp.shape[1] > 1
        else np.ones(near.shape, dtype=bool)
    )
    return np.asarray(near & damped & alike)


def stabilisation(sets: Sequence[PoleSet], band: tuple[float, float], c: Criteria) -> Stabilisation:
    """Diagram data inside ``band`` (Hz) from the pole sets of increasing order."""
    rows: list[tuple[NDArray[np.int64], Complex, Complex, NDArray[np.bool_]]] = []
    before: tuple[Complex, Complex] | None = None
    for item in sets:
        f = np.abs(item.poles) / (2.0 * np.pi)
        keep = (
            (f >= band[0])
            & (f <= band[1])
            & (-item.poles.real <= c.max_damping * np.abs(item.poles))
        )
        p, L = item.poles[keep], item.participation[keep]
        held = np.zeros(p.size, dtype=bool)
        if before is not None and before[0].size and p.size:
            held = np.any(same(p, L, before[0], before[1], c), axis=1)
        rows.append((np.full(p.size, item.order, dtype=np.int64), p, L, held))
        before = (p, L)
    pole = np.concatenate([r[1] for r in rows])
    size = np.abs(pole)
    return Stabilisation(
        order=np.concatenate([r[0] for r in rows]),
        frequency=np.asarray(size / (2.0 * np.pi)),
        damping=np.asarray(-pole.real / size),
        stable=np.concatenate([r[3] for r in rows]),
        pole=pole,
        participation=np.concatenate([r[2] for r in rows]),
    )
