"""What exact members have beyond K, M, C and D: their dynamic stiffness at a frequency, less that
of their matrices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.terms import Values

Complex = NDArray[np.complex128]
HELD = 200_000
"""Complex numbers kept for points to come (3 MB): more no longer saves time."""


@dataclass(frozen=True)
class Member:
    """Exact elements of one block at given ``properties``: the element ``matrices`` that K, M, C
    and D hold of them, and where each entry that is ``kept`` goes among those of the pattern."""

    block: Block
    properties: Mapping[str, Values]
    matrices: Mapping[str, NDArray[Any]]
    keep: NDArray[np.bool_]
    places: Index

    def beyond(self, s: Complex) -> Complex:
        """Entries of Z(s) − (K + iD + sC + s²M) at each of ``s`` (f,), kept ones only: (f, k)."""
        out = self.block.dynamic_stiffnesses(-1j * s, self.properties)
        for matrix, factor in (("K", 1.0), ("M", s * s), ("C", s), ("D", 1j)):
            if matrix in self.matrices:
                out -= np.multiply.outer(np.broadcast_to(factor, s.shape), self.matrices[matrix])
        return out.reshape(len(s), -1)[:, self.keep]

    def slope(self, omega: float) -> Complex:
        """Entries of ∂Z/∂s² − M at s = iω, without damping."""
        rows = np.arange(len(self.block.ids))
        # Z depends on s² through s² · mass alone
        moves = {"mass": -np.real(self.properties["mass"]) / omega**2}
        out = self.block.dynamic_change(omega, self.properties, rows, moves)
        if "M" in self.matrices:
            out = out - self.matrices["M"]
        return out.reshape(-1)[self.keep]


@dataclass(frozen=True)
class Beyond:
    """The correction of a model on its sparsity pattern; ``rows`` and ``columns`` cut it."""

    members: tuple[Member, ...]
    indices: Index
    indptr: Index
    rows: Index | None = None
    columns: Index | None = None
    _last: dict[complex, Complex] = field(default_factory=dict, compare=False)

    def data(self, s: complex) -> Complex:
        """Its entries at s (rad/s) on the whole pattern; those of the last s, or of those foreseen,
        are kept, as blocks cut from one matrix ask for the same."""
        if s not in self._last:
            self.foresee(np.array([s]))
        return self._last[s]

    @property
    def together(self) -> int:
        """Points of which the entries may be held at a time."""
        return max(1, HELD // len(self.indices))

    def foresee(self, points: Complex) -> None:
        """Keep the entries at the next ``points`` (rad/s), which are formed together: a few members
        take as long at a hundred points as at one."""
        out = np.zeros((len(points), len(self.indices)), dtype=complex)
        for m in self.members:
            for row, flat in zip(out, m.beyond(np.asarray(points, dtype=complex)), strict=True):
                row += np.bincount(m.places, flat.real, len(row))
                row += 1j * np.bincount(m.places, flat.imag, len(row))
        self._last.clear()
        self._last.update(zip(points.tolist(), out, strict=True))

    def undamped(self) -> Beyond:
        """The same without loss: for natural frequencies."""
        members = tuple(
            replace(
                m,
                properties={**m.properties, "damping": np.zeros(len(m.block.ids))},
                matrices={k: v for k, v in m.matrices.items() if k in ("K", "M")},
            )
            for m in self.members
        )
        return replace(self, members=members, _last={})

    def slope(self, omega: float) -> NDArray[np.float64]:
        """Entries on the pattern of ∂Z/∂s² − M at s = iω, of members without loss."""
        out = np.zeros(len(self.indices))
        for m in self.members:
            out += np.bincount(m.places, m.slope(omega).real, len(out))
        return out

    def clamped_below(self, omega: NDArray[np.float64]) -> Index:
        """How many natural frequencies of all members with held nodes lie below each of ω (f,) in
        rad/s, (f,)."""
        counts = [m.block.clamped_below(omega, m.properties) for m in self.members]
        return np.sum(counts, axis=0, dtype=np.int64)

    def at(self, s: complex) -> sp.csc_array:
        """The correction at s as a matrix, cut."""
        size = len(self.indptr) - 1
        whole = sp.csc_array((self.data(s), self.indices, self.indptr), shape=(size, size))
        if self.rows is None or self.columns is None:
            return whole
        return sp.csc_array(whole[:, self.columns][self.rows])

    def cut(self, rows: Index, columns: Index) -> Beyond:
        """Some rows and columns of it."""
        return replace(self, rows=rows, columns=columns)
