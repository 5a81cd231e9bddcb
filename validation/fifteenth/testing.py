"""The virtual test: responses, averages with noise, a table of modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from validation.fifteenth.system import Array, System

Complex = NDArray[np.complex128]
LINES_MODES = 70


@dataclass
class Modal:
    """Modes of one state, with what stands for the rest."""

    system: System
    lam: Array
    phi: Array
    zeta: Array

    @property
    def hz(self) -> Array:
        """Natural frequencies."""
        return np.sqrt(self.lam) / 2 / np.pi


def modal(system: System, zetas: Array) -> Modal:
    """The lowest modes; a rigid one has no damping of its own but the cords'."""
    lam, phi = system.modes(LINES_MODES)
    return Modal(system, lam, phi, zetas[: len(lam)])


def accelerance(m: Modal, f: Array, outs: Array, force: Array) -> Complex:
    """Accelerance at lines f, by modes and a constant for the rest; dashpots couple modes."""
    a, b = outs @ m.phi, force @ m.phi
    damping = np.diag(2 * m.zeta * np.sqrt(m.lam)) + m.phi.T @ (m.system.C @ m.phi)
    w0 = 2 * np.pi * 0.47 * (f[0] + f[-1])
    exact = outs @ sla.spsolve((m.system.K - w0**2 * m.system.M).tocsc(), force)
    rest = exact - a @ (b / (m.lam - w0**2))
    out = np.empty((len(f), len(outs)), complex)
    diagonal = np.abs(damping - np.diag(np.diag(damping))).max() < 1e-12 * np.abs(damping).max()
    for i, w in enumerate(2 * np.pi * f):
        z = m.lam - w**2
        if diagonal:
            q = b / (z + 1j * w * np.diag(damping))
        else:
            q = np.linalg.solve(np.diag(z) + 1j * w * damping, b)
        out[i] = -(w**2) * (a @ q + rest)
    return out


def measured(
    h: Complex,
    f: Array,
    rng: np.random.Generator,
    averages: int,
    noise: float,
    hammer: bool,
    gains: Array,
    force_gain: float,
    bits: int = 14,
) -> tuple[Complex, Array]:
    """H1 and coherence of averages: random forces, noise of sensors and converter, gains."""
    roll = np.exp(-0.7 * (f / f[-1]) ** 2) if hammer else 1 / (1 + 0.25 * np.sin(7 * f / f[-1]))
    rms = np.sqrt(np.mean(np.abs(h * roll[:, None]) ** 2, axis=0))
    full = 5 * rms.max()
    lsb = np.sqrt(len(f)) * full / 2**bits / np.sqrt(12)
    floor = np.sqrt((noise * np.median(rms)) ** 2 + lsb**2)
    shape = (averages, len(f))
    if hammer:
        force = roll * (1 + 0.15 * rng.standard_normal((averages, 1))) * np.ones(shape)
    else:
        force = roll * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    force = force.astype(complex)

    def white(*size: int) -> Complex:
        return (rng.standard_normal(size) + 1j * rng.standard_normal(size)) / np.sqrt(2)

    x = force_gain * (force + 0.002 * white(*shape))
    gxx = np.mean(np.abs(x) ** 2, axis=0)
    out, coh = np.empty_like(h), np.empty(h.shape)
    for c in range(h.shape[1]):
        y = gains[c] * h[:, c] * force + floor * white(*shape)
        gxy = np.mean(np.conj(x) * y, axis=0)
        out[:, c] = gxy / gxx
        coh[:, c] = np.abs(gxy) ** 2 / gxx / np.mean(np.abs(y) ** 2, axis=0)
    return out, np.minimum(coh, 1.0)


def table(
    m: Modal,
    outs: Array,
    first: int,
    count: int,
    rng: np.random.Generator,
    f_sd: float,
    s_sd: float,
    gains: Array,
) -> list[dict[str, Any]]:
    """Modes as a test gives them: scattered, largest entry 1, without what sensors hardly see."""
    rows: list[dict[str, Any]] = []
    raw = outs @ m.phi
    strength = np.abs(raw).max(axis=0)
    for i in range(first, len(m.lam)):
        if len(rows) == count:
            break
        if strength[i] < 0.12 * np.median(strength[first : first + count]):
            continue
        shape = raw[:, i] * gains
        shape = shape / shape[np.argmax(np.abs(shape))]
        shape = shape + s_sd * rng.standard_normal(len(shape))
        c = m.phi[:, i] @ (m.system.C @ m.phi[:, i])
        zeta = m.zeta[i] + c / 2 / np.sqrt(m.lam[i])
        rows.append(
            {
                "frequency": float(m.hz[i] * (1 + f_sd * rng.standard_normal())),
                "damping": float(zeta * (1 + 0.1 * rng.standard_normal())),
                "shape": shape,
            }
        )
    return rows
