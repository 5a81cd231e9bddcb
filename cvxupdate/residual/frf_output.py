"""The output error of many lines at once (3.30): one sparse factorisation for each line, everything
else for all of them together.

H f − x needs no reduction: with X = Z⁻¹ on the sensors and forces, H is X at the sensors and ∂H =
−X_nᵀ ∂Z X_r.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.model import Matrices
from cvxupdate.fe.synthesis import DirectLines
from cvxupdate.residual.contraction import Derivatives
from cvxupdate.residual.frf_data import FrfData

Field = NDArray[Any]


def output_rows(m: Matrices, d: Derivatives, data: FrfData) -> Iterator[tuple[Field, Field]]:
    """H − H_X (f, n, r) and ∂H/∂p (f, n, r, parameters), for as many lines of ``data`` at a time as
    may be held.

    Raises
    ------
    ModelError
        Where a line meets a natural frequency of an undamped model.
    """
    places, sensors, forces = data.places
    lines = DirectLines(m, places)
    s = np.asarray(2j * np.pi * data.frequency, dtype=np.complex128)
    for first in range(0, len(s), lines.together):
        some = slice(first, first + lines.together)
        X = lines.at(s[some])
        H = X[data.responses][:, :, forces].transpose(1, 0, 2)
        yield (
            H - data.X[some],
            -d.over_lines(2.0 * np.pi * data.frequency[some], X, sensors, forces),
        )
