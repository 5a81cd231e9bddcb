"""Derivatives of responses with respect to parameters, from the modal pieces of a synthesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import DerivativeBlock
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.synthesis.pieces import Response
from cvxupdate.fe.synthesis.products import Complex, grounded, times
from cvxupdate.fe.terms import Real

Small = tuple[Real | None, ...]
TOGETHER = 32  # DOFs, about, of derivatives that are taken at a time: neighbours share theirs
MANY = 40  # DOFs of a derivative above which it goes through the band's modes instead of every DOF


@dataclass(frozen=True)
class Among:
    """A derivative of many DOFs among the lowest modes: φᵀ ∂K φ and so on (low, low)."""

    small: Small


@dataclass(frozen=True)
class Share:
    """Parameters that are taken together: ``used`` (n,) their DOFs, after which the lowest modes
    come where some need them (``modal``); ``parts``: of each parameter, places among those and the
    four small matrices, transposed."""

    used: Index
    modal: bool
    parts: tuple[tuple[tuple[Index, Small], ...], ...]

    @classmethod
    def of(cls, parts: Sequence[Sequence[tuple[Index | None, Small]]], low: int) -> Share:
        """From DOFs, None for the lowest modes, and matrices."""
        needed = [u for own in parts for u, _ in own if u is not None]
        used = np.unique(np.concatenate(needed)) if needed else np.zeros(0, dtype=np.int64)
        behind = np.arange(len(used), len(used) + low)
        placed = tuple(
            tuple(
                (
                    behind if u is None else np.searchsorted(used, u),
                    tuple(None if m is None else m.T.astype(complex) for m in small),
                )
                for u, small in own
            )
            for own in parts
        )
        return cls(used, any(u is None for own in parts for u, _ in own), placed)

    def columns(self, r: Response, modes: Modes, low: int) -> Complex:
        """Those of `Changes`: receptances to the sensors times forces, one product for all
        parameters at every point."""
        phi = grounded(modes.shapes)[self.used]
        near, beyond = phi[:, : r.near], phi[:, r.near :]
        right, left = times(near, r.q), times(near, r.a)
        if r.high is not None and len(self.used):
            right += r.high.right(beyond)
            left += r.high.left(beyond)
        if self.modal:
            right, left = (np.concatenate([x, y[:low]]) for x, y in ((right, r.q), (left, r.a)))
        n, points, cases = right.shape
        moved = (-r.drive[:, None, None] * np.moveaxis(right, 0, 2)).reshape(points * cases, n)
        s = np.repeat(r.signal.s, cases)[:, None]
        force = np.zeros((points * cases, len(self.parts), n), dtype=complex)
        for j, parts in enumerate(self.parts):
            for k, (places, small) in enumerate(parts):
                more = _forces(small, moved[:, places], s)
                force[:, j, places] = force[:, j, places] + more if k else more
        out = np.matmul(
            np.swapaxes(by_point(left), 1, 2),
            np.swapaxes(force.reshape(points, cases * len(self.parts), n), 1, 2),
        )
        return out.reshape(points, left.shape[2], cases, len(self.parts))


@dataclass(frozen=True)
class Changes:
    """Derivatives ∂Z/∂p = ∂K + s² ∂M + s ∂C + i ∂D of several parameters, ready for every signal.

    A change of a few DOFs is taken exactly, through the receptances at those DOFs; one of many DOFs
    (a whole group) through the lowest ``low`` modes, which carry it.
    """

    modes: Modes
    low: int
    shares: tuple[Share, ...]

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
        return cls(modes, low, tuple(Share.of(p, low) for p in _shares(parts)))

    def columns(self, r: Response) -> Complex:
        """∂Y/∂p (points, sensors, cases, parameters) = −sᵒ aᵀ ∂Z q."""
        each = [share.columns(r, self.modes, self.low) for share in self.shares]
        return each[0] if len(each) == 1 else np.concatenate(each, axis=-1)


def _shares(
    parts: Sequence[Sequence[tuple[Index | None, Small]]],
) -> list[list[Sequence[tuple[Index | None, Small]]]]:
    """Neighbours in turn, as long as they have few DOFs together."""
    out: list[list[Sequence[tuple[Index | None, Small]]]] = [[]]
    held: set[int] = set()
    for own in parts:
        more = {int(i) for u, _ in own if u is not None for i in u}
        if out[-1] and len(held | more) > TOGETHER:
            out.append([])
            held = set()
        out[-1].append(own)
        held |= more
    return out


def _forces(small: Small, right: Complex, s: Complex) -> Complex:
    """Rows (rows, n) of right (∂K + s² ∂M + s ∂C + i ∂D)ᵀ, matrices transposed; ``s`` (rows, 1)."""
    K, M, C, D = small
    out: Complex | float = 0.0
    if K is not None:
        out = out + right @ K
    if M is not None:
        out = out + s**2 * (right @ M)
    if C is not None:
        out = out + s * (right @ C)
    if D is not None:
        out = out + 1j * (right @ D)
    return np.asarray(out)


def wide(dofs: int, low: int) -> bool:
    """Whether a derivative of so many DOFs goes through the lowest modes."""
    return dofs > MANY and low < dofs


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
