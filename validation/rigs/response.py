"""Modes and frequency responses of a structure on the bench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from validation.rigs.bench import Structure

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
MORE = 8  # modes beyond those that were there, among which these are found again
LEAST = 1e-9  # what moves freely has no frequency to take the logarithm of
COUPLED = 60  # undamped modes that dashpots are seen through, in tables


@dataclass(frozen=True)
class Modal:
    """All undamped modes of a structure, lowest first; shapes have unit modal mass."""

    structure: Structure
    omega: Real
    shapes: Real
    zeta: Real

    def rows(self, places: Sequence[tuple[int, str]]) -> Real:
        """Shapes at places, (places, modes)."""
        return np.array([self.structure.at(n, dof) for n, dof in places]) @ self.shapes

    def accelerance(
        self, f: Real, places: Sequence[tuple[int, str]], drive: tuple[int, str]
    ) -> Complex:
        """(lines, places), (m/s²)/N: modal sum over every mode; dashpots by the identity of
        Sherman, Morrison and Woodbury."""
        w = 2.0 * np.pi * f[:, None]
        g = 1.0 / (self.omega**2 - w**2 + 2j * self.zeta * self.omega * w)
        read, push = self.rows(places), self.rows([drive])[0]
        H = (g * push) @ read.T
        if self.structure.dampers:
            B = np.array([b for b, _ in self.structure.dampers]) @ self.shapes
            c = np.array([c for _, c in self.structure.dampers])
            left = np.einsum("fm,sm,dm->fsd", g, read, B, optimize=True)
            right = (g * push) @ B.T
            inner = np.einsum("fm,dm,em->fde", g, B, B, optimize=True)
            small = np.eye(len(c)) / c + 1j * w[:, :, None] * inner
            H -= (
                1j
                * w
                * np.einsum("fsd,fd->fs", left, np.linalg.solve(small, right[..., None])[..., 0])
            )
        return np.asarray(-(w**2) * H)

    def damped(self, places: Sequence[tuple[int, str]], top: float) -> tuple[Real, Real, Real]:
        """(frequencies in Hz, fractions of critical, shapes at places) of modes below ``top``."""
        n = min(COUPLED, len(self.omega))
        w, z, read = self.omega[:n], self.zeta[:n], self.rows(places)[:, :n]
        if not self.structure.dampers:
            low = w < 2.0 * np.pi * top
            return w[low] / (2.0 * np.pi), z[low], read[:, low]
        C = np.diag(2.0 * z * w)
        for b, c in self.structure.dampers:
            v = b @ self.shapes[:, :n]
            C += c * np.outer(v, v)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(w**2), -C]])
        s, V = sl.eig(A)
        keep = np.flatnonzero((s.imag > 1e-9 * w[-1]) & (np.abs(s) < 2.0 * np.pi * top))
        keep = keep[np.argsort(np.abs(s[keep]))]
        shapes = read @ V[:n, keep]
        at = np.argmax(np.abs(shapes), axis=0)
        shapes = (shapes / shapes[at, np.arange(len(keep))]).real
        return np.abs(s[keep]) / (2.0 * np.pi), -s[keep].real / np.abs(s[keep]), shapes


def modal(structure: Structure, scatter: dict[str, tuple[float, float]], zeta: Real) -> Modal:
    """All modes; ``zeta`` gives the damping of the lowest, its last value that of all others."""
    omega, shapes = natural(*structure.matrices(scatter))
    full = np.full(len(omega), zeta[-1])
    full[: len(zeta)] = zeta[: len(full)]
    return Modal(structure, omega, shapes, full)


def natural(K: Real, M: Real) -> tuple[Real, Real]:
    """(ω, shapes with unit modal mass), lowest first; what moves freely has ω = 0."""
    values, shapes = sl.eigh(K, M)
    return np.sqrt(np.maximum(values, 0.0)), shapes


def paired(f: Real, shapes: Real, g: Real, others: Real) -> NDArray[np.intp]:
    """Which of the other modes belongs to each: shapes first, then frequencies."""
    norms = np.sum(shapes**2, axis=0)[:, None] * np.sum(others**2, axis=0)
    mac = (shapes.T @ others) ** 2 / np.maximum(norms, 1e-300)
    cost = (
        1.0
        - mac
        + np.minimum(1.0, np.abs(np.log(np.maximum(f, LEAST)[:, None] / np.maximum(g, LEAST))))
    )
    rows, columns = linear_sum_assignment(cost)
    return np.asarray(columns[np.argsort(rows)])


def as_before(m: Modal, before: Modal, places: Sequence[tuple[int, str]], first: int) -> Real:
    """Fractions of critical (modes,) of a structure that was changed: the ``first`` modes of it
    ``before`` keep theirs, wherever they went, since a mode's losses do not change with its
    number; what came has the last of them."""
    n = min(first, len(before.omega))
    old, new = before.rows(places)[:, :n], m.rows(places)[:, : n + MORE]
    out = np.full(len(m.omega), before.zeta[-1])
    out[paired(before.omega[:n], old, m.omega[: n + MORE], new)] = before.zeta[:n]
    return out
