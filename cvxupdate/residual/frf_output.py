"""The output error of many lines at once (3.30): one sparse factorisation for each line, everything
else for all of them together.

H f − x needs no reduction: with X = Z⁻¹ on the sensors and forces, H is X at the sensors and ∂H =
−X_nᵀ ∂Z X_r. The lines share the pattern of Z, so its fill-reducing order is found once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.responses import combined, damped, factorise_at
from cvxupdate.residual.contraction import Derivatives
from cvxupdate.residual.frf_data import FrfData

Field = NDArray[Any]
WHY = "a natural frequency of the model"
HELD = 4_000_000
"""Entries of X that are held at a time: as many lines as this allows."""


def output_rows(m: Matrices, d: Derivatives, data: FrfData) -> Iterator[tuple[Field, Field]]:
    """H − H_X (f, n, r) and ∂H/∂p (f, n, r, parameters), for as many lines of ``data`` at a time as
    may be held.

    Raises
    ------
    ModelError
        Where a line meets a natural frequency of an undamped model.
    """
    places, where = np.unique(
        np.concatenate([data.responses, data.references]), return_inverse=True
    )
    sensors, forces = where[: len(data.responses)], where[len(data.responses) :]
    lines = Lines(m, places)
    together = max(1, HELD // (m.K.shape[0] * len(places)))
    for first in range(0, len(data.frequency), together):
        some = slice(first, first + together)
        X = lines.at(data.frequency[some])
        H = X[data.responses][:, :, forces].transpose(1, 0, 2)
        yield (
            H - data.X[some],
            -d.over_lines(2.0 * np.pi * data.frequency[some], X, sensors, forces),
        )


@dataclass(frozen=True)
class Ordered:
    """K, M, C, D of one pattern, rows and columns in the fill-reducing ``order`` (N,): their
    entries, and the pattern."""

    order: Index
    entries: tuple[Field, ...]
    indices: Index
    indptr: Index

    def at(self, omega: float, lossy: bool) -> sp.csc_array:
        """Z(ω), ordered."""
        K, M, C, D = self.entries
        data: Field = np.empty(len(K), dtype=complex if lossy else float)
        data.real = K - omega**2 * M
        if lossy:
            data.imag = D + omega * C
        return sp.csc_array((data, self.indices, self.indptr), shape=(len(self.order),) * 2)


def ordered(m: Matrices, perm_c: Index) -> Ordered | None:
    """The matrices in the order that one factorisation found; None where their patterns differ."""
    K = m.K
    if not all(
        np.array_equal(K.indices, x.indices) and np.array_equal(K.indptr, x.indptr)
        for x in (m.M, m.C, m.D)
    ):
        return None
    order = np.argsort(perm_c)
    place = sp.csc_array((np.arange(1, K.nnz + 1), K.indices, K.indptr), shape=K.shape)[order][
        :, order
    ]
    place = sp.csc_array(place)
    place.sort_indices()
    moved = place.data - 1
    return Ordered(
        order, tuple(x.data[moved] for x in (m.K, m.M, m.C, m.D)), place.indices, place.indptr
    )


@dataclass(frozen=True)
class Lines:
    """Responses of the model with matrices ``m`` to unit forces at ``places`` (k,)."""

    m: Matrices
    places: Index

    def at(self, frequency: NDArray[np.float64]) -> Field:
        """Z⁻¹ on the places at each of ``frequency`` (f,) Hz: (N + 1, f, k), the last row 0 as that
        of every DOF that is held.

        Raises
        ------
        ModelError
            Where Z is singular.
        """
        lossy = damped(self.m)
        size, k = self.m.K.shape[0], len(self.places)
        out: Field = np.zeros((size + 1, len(frequency), k), dtype=complex if lossy else float)
        unit = np.zeros((size, k), dtype=out.dtype)
        unit[self.places, np.arange(k)] = 1.0
        same, forces = None, unit
        for i, f in enumerate(frequency.tolist()):
            omega = 2.0 * np.pi * f
            if same is not None:
                out[same.order, i] = factorise_at(
                    same.at(omega, lossy), f, WHY, ordered=True
                ).solve(forces)
                continue
            factor = factorise_at(combined(self.m, omega, lossy), f, WHY)
            out[:-1, i] = factor.solve(unit)
            if i == 0 and len(frequency) > 1:
                same = ordered(self.m, factor.lu.perm_c)
                forces = unit if same is None else unit[same.order]
        return out
