"""Equation error with the model's own receptances where nothing was measured (Lin and Ewins 1990).

With the receptances X of the structure, H of the model at ``at`` and ΔZ = Z(p) − Z(at),

    H − X = H ΔZ X

holds exactly, so a column of X that was measured at every DOF gives equations that are linear in p
however far p is. Rows that were measured are used; DOFs of the column on the right that were not
take the model's own receptances, which is wrong by what p still moves: ``at`` is taken anew at each
solution. The thesis has it in 2.8.5.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.model import Matrices
from cvxupdate.fe.responses import combined, damped
from cvxupdate.fe.synthesis import DirectLines
from cvxupdate.residual.contraction import Derivatives
from cvxupdate.residual.frf_data import FrfData

Field = NDArray[Any]


def filled_rows(
    m: Matrices, at: Matrices, d: Derivatives, data: FrfData
) -> Iterator[tuple[Field, Field]]:
    """H − X − H ΔZ X̂ (f, n, r) with H of ``at``, ΔZ of ``m`` less ``at`` and X̂ the measured column
    with the model's own entries where none was measured (2.113); its derivatives (f, n, r,
    parameters) for ∂Z = ``d``. As many lines of ``data`` at a time as may be held.

    Raises
    ------
    ModelError
        Where a line meets a natural frequency of an undamped model.
    """
    places, sensors, forces = data.places
    lines = DirectLines(at, places)
    s = np.asarray(2j * np.pi * data.frequency, dtype=np.complex128)
    lossy = damped(m) or damped(at)
    right = len(places) + np.arange(len(forces))
    for first in range(0, len(s), lines.together):
        some = slice(first, first + lines.together)
        X = lines.at(s[some])
        H = X[data.responses][:, :, forces].transpose(1, 0, 2)
        full = X[:, :, forces].astype(np.result_type(X, data.X))
        known = np.where(data.used, data.X[some], H).transpose(1, 0, 2)
        full[data.responses] = known
        pushed = np.stack(
            [
                (combined(m, z, lossy) - combined(at, z, lossy)) @ full[:-1, k]
                for k, z in enumerate(s[some].tolist())
            ],
            axis=1,
        )
        taken = np.einsum("nfi,nfr->fir", X[:-1][:, :, sensors], pushed)
        fields = np.concatenate([X, full], axis=2)
        yield (
            H - data.X[some] - taken,
            -d.over_lines(2.0 * np.pi * data.frequency[some], fields, sensors, right),
        )
