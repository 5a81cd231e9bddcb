"""One sparse factorisation for each point: exact, and every DOF's motion comes with it.

The points share the pattern of the dynamic stiffness, so its fill-reducing order is found once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.fe.block import Index
from cvxupdate.fe.exact.correction import Beyond
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.responses import alike, combined, damped, factorise_at

Field = NDArray[Any]
Complex = NDArray[np.complex128]
WHY = "a natural frequency of the model"
HELD = 4_000_000
"""Entries of responses that are held at a time: as many points as this allows."""


@dataclass(frozen=True)
class Ordered:
    """K, M, C, D of one pattern, rows and columns in the fill-reducing ``order`` (N,): their
    entries, and the pattern."""

    order: Index
    entries: tuple[Field, ...]
    indices: Index
    indptr: Index
    moved: Index
    beyond: Beyond | None

    def at(self, s: complex, lossy: bool) -> sp.csc_array:
        """Z(s), ordered."""
        K, M, C, D = self.entries
        square = s * s
        data: Field = K + (square if lossy else square.real) * M
        if lossy:
            data = data + 1j * D + s * C
        if self.beyond is not None:
            more = self.beyond.data(s)[self.moved]
            data = data + (more if lossy else more.real)
        return sp.csc_array((data, self.indices, self.indptr), shape=(len(self.order),) * 2)


def ordered(m: Matrices, perm_c: Index) -> Ordered | None:
    """The matrices in the order that one factorisation found; None where their patterns differ."""
    K = m.K
    if not alike(m):
        return None
    order = np.argsort(perm_c)
    place = sp.csc_array((np.arange(1, K.nnz + 1), K.indices, K.indptr), shape=K.shape)[order][
        :, order
    ]
    place = sp.csc_array(place)
    place.sort_indices()
    moved = place.data - 1
    return Ordered(
        order,
        tuple(x.data[moved] for x in (m.K, m.M, m.C, m.D)),
        place.indices,
        place.indptr,
        moved,
        m.beyond,
    )


@dataclass(frozen=True)
class DirectLines:
    """Responses of the model with matrices ``m`` to unit forces at ``places`` (k,)."""

    m: Matrices
    places: Index

    @property
    def together(self) -> int:
        """Points whose responses may be held at a time."""
        return max(1, HELD // (self.m.K.shape[0] * max(1, len(self.places))))

    def at(self, s: Complex) -> Field:
        """Z⁻¹ on the places at each of ``s`` (points,) in rad/s: (N + 1, points, k), the last row 0
        as that of every DOF that is held. Real for undamped models on the imaginary axis.

        Raises
        ------
        ModelError
            Where Z is singular.
        """
        lossy = damped(self.m) or bool(np.any(s.real != 0.0))
        size, k = self.m.K.shape[0], len(self.places)
        out: Field = np.zeros((size + 1, len(s), k), dtype=complex if lossy else float)
        unit = np.zeros((size, k), dtype=out.dtype)
        unit[self.places, np.arange(k)] = 1.0
        same, forces = None, unit
        ahead = 0 if self.m.beyond is None else self.m.beyond.together
        for i, point in enumerate(s.tolist()):
            if self.m.beyond is not None and i % ahead == 0:
                self.m.beyond.foresee(s[i : i + ahead])
            f = abs(point) / (2.0 * np.pi)
            if same is not None:
                Z = same.at(point, lossy)
                # On 100 exact members in a row, which are small, SuperLU takes 0.9 ms with an order
                # of its own and 20 ms with this one, at the same fill; on meshes as long.
                known = self.m.beyond is None
                out[same.order, i] = factorise_at(Z, f, WHY, ordered=known).solve(forces)
                continue
            factor = factorise_at(combined(self.m, point, lossy), f, WHY)
            out[:-1, i] = factor.solve(unit)
            if i == 0 and len(s) > 1:
                same = ordered(self.m, factor.lu.perm_c)
                forces = unit if same is None else unit[same.order]
        return out

    def between(self, s: Complex, outputs: Index) -> Field:
        """The responses at ``outputs`` (o,) alone, (points, o, k), a few points held at a time."""
        step = self.together
        parts = [
            self.at(s[first : first + step])[outputs].transpose(1, 0, 2)
            for first in range(0, len(s), step)
        ]
        return np.concatenate(parts)
