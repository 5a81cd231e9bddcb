"""Derivatives of responses with respect to parameters, from the modal pieces of a synthesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import DerivativeBlock
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.synthesis.pieces import Response
from cvxupdate.fe.synthesis.products import Complex, times
from cvxupdate.fe.terms import Real

Small = tuple[Real | None, ...]
MANY = 40  # DOFs of a derivative above which it goes through the band's modes instead of every DOF


@dataclass(frozen=True)
class Among:
    """A derivative of many DOFs among the lowest modes: φᵀ ∂K φ and so on (low, low)."""

    small: Small


@dataclass(frozen=True)
class Changes:
    """Derivatives ∂Z/∂p = ∂K + s² ∂M + s ∂C + i ∂D of several parameters, ready for every signal.

    A change of a few DOFs is taken exactly, through the receptances at those DOFs; one of many DOFs
    (a whole group) through the lowest ``low`` modes, which carry it. ``parts``: of each parameter
    (places among ``used``, or None for the modes; the four small matrices); ``used`` (n,) all such
    DOFs.
    """

    modes: Modes
    low: int
    used: Index
    parts: tuple[tuple[tuple[Index | None, Small], ...], ...]

    @classmethod
    def of(
        cls, derivatives: Sequence[Sequence[DerivativeBlock | Among]], modes: Modes, low: int
    ) -> Changes:
        """From the element blocks of every parameter, or what these are among the modes."""
        parts: list[list[tuple[Index | None, Small]]] = []
        for blocks in derivatives:
            parts.append([])
            for b in blocks:
                if isinstance(b, Among):
                    parts[-1].append((None, b.small))
                    continue
                u = np.unique(b.dofs)
                far = wide(len(u), low)
                small = modal_blocks(modes.shapes[:, :low], b) if far else summed(b, u)
                parts[-1].append((None if far else u, small))
        needed = [u for own in parts for u, _ in own if u is not None]
        used = np.unique(np.concatenate(needed)) if needed else np.zeros(0, dtype=np.int64)
        placed = (
            tuple((u if u is None else np.searchsorted(used, u), small) for u, small in own)
            for own in parts
        )
        return cls(modes, low, used, tuple(placed))

    def columns(self, r: Response) -> Complex:
        """∂Y/∂p (points, parameters, sensors, cases) = −sᵒ aᵀ ∂Z q."""
        phi = np.vstack([self.modes.shapes, np.zeros((1, self.modes.shapes.shape[1]))])[self.used]
        near, beyond = phi[:, : r.near], phi[:, r.near :]
        right = times(near, r.q)
        left = None
        if r.high is not None and len(self.used):
            right += r.high.right(beyond)
            left = r.high.left(beyond)
        out = np.empty((len(r.raw), len(self.parts), *r.raw.shape[1:]), dtype=complex)
        for j, parts in enumerate(self.parts):
            moved = np.zeros(r.q.shape, dtype=complex)  # modal forces of the change
            beside = []  # what high modes make of it
            for places, small in parts:
                if places is None:
                    moved[: self.low] += forces(small, r.q[: self.low], r.signal.s)
                    continue
                local = forces(small, right[places], r.signal.s)
                moved += times(near[places].T, local)
                if left is not None:
                    beside.append(_met(left[places], local))
            if r.coupled:
                out[:, j] = _met(r.a, moved)
            else:
                carried = times(r.at[: r.near].T, r.inverse[:, :, None] * moved)
                out[:, j] = np.moveaxis(carried, 0, 1)
            for more in beside:
                out[:, j] += more
            out[:, j] *= -r.drive[:, None, None]
        return out


def wide(dofs: int, low: int) -> bool:
    """Whether a derivative of so many DOFs goes through the lowest modes."""
    return dofs > MANY and low < dofs


def _met(left: Complex, force: Complex) -> Complex:
    """What receptances to sensors (n, points, sensors) make of forces (n, points, cases): (points,
    sensors, cases)."""
    if force.shape[2] == 1:  # products and a sum are cheaper than a call for each point
        return np.asarray(np.sum(left * force, axis=0)[:, :, None])
    return np.asarray(np.matmul(np.swapaxes(by_point(left), 1, 2), by_point(force)))


def forces(small: Small, right: Complex, s: Complex) -> Complex:
    """(∂K + s² ∂M + s ∂C + i ∂D) right: (n, points, cases)."""
    force = np.zeros(right.shape, dtype=complex)
    factors: tuple[Complex, ...] = (
        np.ones((1, 1), dtype=complex),
        (s**2)[:, None],
        s[:, None],
        np.full((1, 1), 1j),
    )
    for part, factor in zip(small, factors, strict=True):
        if part is not None:
            force += factor * times(part, right)
    return force


def by_point(z: Complex) -> Complex:
    """(n, points, columns) as (points, n, columns), contiguous: products at every point are many
    times slower across memory."""
    return np.ascontiguousarray(np.swapaxes(z, 0, 1))


def summed(b: DerivativeBlock, used: Index) -> Small:
    """∂K, ∂M, ∂C, ∂D over the DOFs ``used`` (n, n), None where zero; the ground's rows stay in, its
    receptances are zero."""
    at = np.searchsorted(used, b.dofs)
    n = len(used)
    where = (at[:, :, None] * n + at[:, None, :]).reshape(-1)
    return tuple(
        None
        if part is None
        else np.asarray(np.bincount(where, part.reshape(-1), n * n), dtype=float).reshape(n, n)
        for part in (b.K, b.M, b.C, b.D)
    )


def modal_blocks(shapes: Real, b: DerivativeBlock) -> Small:
    """φᵀ ∂K φ and so on, element by element: φ (N, low)."""
    phi = np.where((b.dofs >= 0)[:, :, None], shapes[b.dofs], 0.0)
    e, d, low = phi.shape
    return tuple(
        None if part is None else phi.reshape(e * d, low).T @ (part @ phi).reshape(e * d, low)
        for part in (b.K, b.M, b.C, b.D)
    )
