"""The structure on the bench in time: its lowest modes and what the others do statically, marched
by scipy's LSODA (``odeint``), in a test also by its Radau."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray
from scipy.integrate import odeint
from scipy.interpolate import CubicSpline

from validation.motions.laws import Law
from validation.rigs.response import Modal

Real = NDArray[np.float64]
KEPT = 2.5  # times the top of the band: modes below are modes
STATIC = 0.3  # damping of what stands for all the others: they follow the forces
TOLERANCE = 1e-6  # relative, of each step; absolute 1e-2 of it times the r.m.s. of each state


@dataclass(frozen=True)
class Bench:
    """(n,) coordinates: ω in rad/s and ζ of each, shapes at any vector by ``basis``; dashpots'
    ``extra`` damping (n, n)."""

    omega: Real
    zeta: Real
    basis: Real
    extra: Real

    @staticmethod
    def of(modal: Modal, top: float, ends: Sequence[Real]) -> Bench:
        """Modes below some times ``top`` (Hz), and one coordinate for the rest of the flexibility
        of each vector in ``ends`` (residual attachment modes, Rubin 1975)."""
        n = max(2, int(np.sum(modal.omega < KEPT * 2.0 * np.pi * top)))
        low, high = modal.shapes[:, :n], modal.shapes[:, n:]
        basis, omega, zeta = low, modal.omega[:n], modal.zeta[:n]
        if high.shape[1]:
            soft = np.array([high.T @ b for b in ends]) / modal.omega[n:] ** 2
            directions = sl.orth(soft.T, rcond=1e-6)
            stiff, turn = sl.eigh(directions.T @ (modal.omega[n:, None] ** 2 * directions))
            basis = np.hstack([low, high @ directions @ turn])
            omega = np.concatenate([omega, np.sqrt(stiff)])
            zeta = np.concatenate([zeta, np.full(len(stiff), STATIC)])
        extra = np.zeros((len(omega),) * 2)
        for b, c in modal.structure.dampers:
            extra += c * np.outer(b @ basis, b @ basis)
        return Bench(omega, zeta, basis, extra)

    @property
    def damping(self) -> Real:
        """(n, n) in 1/s."""
        return np.asarray(np.diag(2.0 * self.zeta * self.omega) + self.extra)

    def linear(self, drive: Real, force: Real, rate: float) -> Real:
        """Coordinates (samples, n) without internal forces, by transform: the record is followed by
        as much silence."""
        n = len(force)
        s = 2j * np.pi * np.fft.rfftfreq(2 * n, 1.0 / rate)
        F = np.fft.rfft(force, 2 * n)
        K = np.diag(self.omega**2)
        Z = s[:, None, None] ** 2 * np.eye(len(K)) + s[:, None, None] * self.damping + K
        eta = np.linalg.solve(Z, (drive @ self.basis)[:, None] * F[:, None, None])[:, :, 0]
        return np.fft.irfft(eta, 2 * n, axis=0)[:n]


@dataclass(frozen=True)
class Change:
    """A structure that changes: its stiffness (n, n) times a relative change straight from
    ``start`` to ``end`` of a run."""

    stiffness: Real
    start: float
    end: float


@dataclass(frozen=True)
class Marched:
    """Coordinates and their first two derivatives (samples, n); motions, velocities and forces
    (samples, laws)."""

    eta: Real
    rate: Real
    second: Real
    x: Real
    v: Real
    force: Real


def equations(
    bench: Bench,
    laws: Sequence[tuple[Law, Real]],
    push: Real,
    force: Real,
    rate: float,
    change: Change | None,
) -> Callable[[Real, float], Real]:
    """ẏ(y, t) of y = (η, η̇, z …); ``laws`` with their shapes (n,), ``push`` that of the drive, the
    force a cubic spline through its samples."""
    n, step, last = len(push), 1.0 / rate, len(force) - 2
    c3, c2, c1, c0 = (c.tolist() for c in CubicSpline(np.arange(len(force)) * step, force).c)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:], A[n:, :n], A[n:, n:] = np.eye(n), -np.diag(bench.omega**2), -bench.damping
    length = len(force) * step

    def rhs(y: Real, t: float) -> Real:
        i = min(max(int(t * rate), 0), last)
        u = t - i * step
        out = np.zeros(len(y))
        modes = out[: 2 * n]
        np.dot(A, y[: 2 * n], out=modes)
        modes[n:] += (((c3[i] * u + c2[i]) * u + c1[i]) * u + c0[i]) * push
        if change is not None:
            now = change.start + (change.end - change.start) * t / length
            modes[n:] -= now * (change.stiffness @ y[:n])
        at = 2 * n
        for law, shape in laws:
            v, z = float(shape @ y[n : 2 * n]), 0.0
            if law.remembers:
                z = float(y[at])
                out[at] = law.rate(v, z)
                at += 1
            modes[n:] -= law.force(float(shape @ y[:n]), v, z) * shape
        return out

    return rhs


def march(
    bench: Bench,
    laws: Sequence[tuple[Law, Real]],
    drive: Real,
    force: Real,
    rate: float,
    change: Change | None = None,
) -> Marched:
    """From rest, at the samples of ``force``; ``drive`` and directions of the laws are vectors of
    the structure."""
    own = [(law, b @ bench.basis) for law, b in laws]
    push = drive @ bench.basis
    n, memory = len(push), [law for law, _ in laws if law.remembers]
    usual = np.sqrt(np.mean(bench.linear(drive, force, rate) ** 2, axis=0)) + 1e-300
    scale = np.concatenate([usual, usual * np.minimum(bench.omega, np.pi * rate)])
    scale = np.concatenate([scale, [law.p[1] for law in memory]])
    rhs = equations(bench, own, push, force, rate, change)
    t = np.arange(len(force)) / rate
    y, said = odeint(
        rhs,
        np.zeros(len(scale)),
        t,
        rtol=TOLERANCE,
        atol=1e-2 * TOLERANCE * scale,
        hmax=2.0 / rate,
        mxstep=20000,
        full_output=True,
    )
    if said["message"] != "Integration successful.":
        raise FloatingPointError(said["message"])
    if not np.all(np.isfinite(y)):
        raise FloatingPointError("the motion grows beyond bounds")
    eta, fast = y[:, :n], y[:, n : 2 * n]
    # second derivatives from the equations themselves
    second = np.array([rhs(a, b)[n : 2 * n] for a, b in zip(y, t, strict=True)])
    x = np.array([eta @ shape for _, shape in own]).T.reshape(len(t), -1)
    v = np.array([fast @ shape for _, shape in own]).T.reshape(len(t), -1)
    g, at = np.zeros_like(x), 2 * n
    for k, (law, _) in enumerate(own):
        z = y[:, at] if law.remembers else np.zeros(len(t))
        at += law.remembers
        g[:, k] = [law.force(*row) for row in zip(x[:, k], v[:, k], z, strict=True)]
    return Marched(eta, fast, second, x, v, g)
