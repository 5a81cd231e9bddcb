"""The output error of many lines at once (3.30): one basis of modes and static corrections for all
lines where that is as accurate (`fe.synthesis.fields`), else one sparse factorisation for each.

H f − x needs no reduction: with X = Z⁻¹ on the sensors and forces, H is X at the sensors and ∂H =
−X_nᵀ ∂Z X_r. Modal damping fills C, so a factorisation for each line is one of a full matrix: the
basis is what makes a model with finer parts under its elements quick.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.fe.synthesis import DirectLines, fields
from cvxupdate.residual.contraction import Derivatives
from cvxupdate.residual.frf_data import FrfData

Field = NDArray[Any]
Complex = NDArray[np.complex128]
HELD = 4_000_000
"""Entries of motions that are held at a time."""


def model_rows(
    model: Model, p: Real, d: Derivatives, data: FrfData
) -> Iterator[tuple[Field, Field]]:
    """`output_rows` of a model at ``p``, on a basis where that pays.

    Raises
    ------
    ModelError
        Where a line meets a natural frequency of an undamped model.
    """
    places = data.places[0]
    motions = fields(model, _points(data), places, p)
    if motions is None:
        yield from output_rows(matrices_with_damping(model, p), d, data)
        return
    rows = np.unique(np.concatenate([places, *(part.dofs.ravel() for part in d.parts)]))
    rows = rows[rows < model.size]

    def some(s: Complex) -> Field:
        X = np.zeros((model.size + 1, len(s), len(places)), dtype=complex)
        X[rows] = motions(s, rows)
        return X

    yield from _rows(some, max(1, HELD // (model.size * len(places))), d, data)


def output_rows(m: Matrices, d: Derivatives, data: FrfData) -> Iterator[tuple[Field, Field]]:
    """H − H_X (f, n, r) and ∂H/∂p (f, n, r, parameters), for as many lines of ``data`` at a time as
    may be held.

    Raises
    ------
    ModelError
        Where a line meets a natural frequency of an undamped model.
    """
    lines = DirectLines(m, data.places[0])
    yield from _rows(lines.at, lines.together, d, data)


def _points(data: FrfData) -> Complex:
    return np.asarray(2j * np.pi * data.frequency, dtype=np.complex128)


def _rows(
    motions: Callable[[Complex], Field], together: int, d: Derivatives, data: FrfData
) -> Iterator[tuple[Field, Field]]:
    """From the motions (N + 1, f, k) of ``together`` lines at a time."""
    _, sensors, forces = data.places
    s = _points(data)
    for first in range(0, len(s), together):
        some = slice(first, first + together)
        X = motions(s[some])
        H = X[data.responses][:, :, forces].transpose(1, 0, 2)
        yield (
            H - data.X[some],
            -d.over_lines(2.0 * np.pi * data.frequency[some], X, sensors, forces),
        )
