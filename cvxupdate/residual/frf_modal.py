"""Equation error on the model's own modes (Friswell and Penny 1990).

The matrices are reduced by modal truncation instead of condensing what was not measured: with the
shapes Φ of the model at ``at``, carried by the sensors, the measured column x has the modal
coordinates q = Φ_n† x, and the balance is that of the modes, Φᵀ f − Φᵀ Z(p) Φ q, brought to the
size of q by the modal flexibility at ``at``. Linear in p; nothing is factorised at any line, and
noise is filtered where there are more sensors than modes. What higher modes add to x is taken for
motion of the kept ones, a bias that many sensors and lines far below the last mode keep small.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.responses import combined, damped
from cvxupdate.residual.contraction import Derivatives
from cvxupdate.residual.frf_data import FrfData

Field = NDArray[Any]
ABOVE = 2.0
"""Modes up to so many times the highest line carry the balance, as far as there are sensors."""
SEEN = 1e-3
"""Least singular value of the shapes at the sensors, of the largest: below it noise would be
enlarged a thousandfold."""


def shapes_below(model: Model, data: Sequence[FrfData], at: Real | None) -> Real:
    """Mass-normalised shapes (N, m) of ``model`` at ``at``: those up to twice the highest line, at
    most as many as every recording has sensors.

    Raises
    ------
    InputError
        Where the sensors do not tell the modes in the band of the lines from each other.
    """
    highest = max(float(d.frequency.max()) for d in data)
    most = min(int(d.used.sum(axis=0).min()) for d in data)
    modes = model_modes(model, most + 1, at)  # one more, to see whether the band ends before it
    inside = int(np.sum(modes.frequencies <= highest))
    count = min(most, max(1, int(np.sum(modes.frequencies <= ABOVE * highest))))
    while count and any(_poor(modes.shapes[d.responses, :count], d.used) for d in data):
        count -= 1
        if count < inside:
            break
    if not count or count < inside:
        raise InputError(
            f'update.residual = "modal-balance": the model has {inside} modes or more up to '
            f"{highest:.5g} Hz, which the sensors of some reference do not tell from each other. "
            "Fit lower lines, or take another residual."
        )
    return np.asarray(modes.shapes[:, :count])


def _poor(shapes: Real, used: NDArray[np.bool_]) -> bool:
    for column in range(used.shape[1]):
        s = np.linalg.svd(shapes[used[:, column]], compute_uv=False)
        if len(s) < shapes.shape[1] or s[-1] < SEEN * s[0]:
            return True
    return False


def _inverses(data: FrfData, shapes: Real) -> list[Real]:
    """Φ_n† (m, n) of every reference, zero at sensors that it does not use."""
    out = []
    for column in range(data.used.shape[1]):
        B = np.zeros((shapes.shape[1], len(data.responses)))
        on = data.used[:, column]
        B[:, on] = np.linalg.pinv(shapes[data.responses[on]])
        out.append(B)
    return out


def modal_rows(
    m: Matrices, at: Matrices, d: Derivatives, data: FrfData, shapes: Real
) -> Iterator[tuple[Field, Field]]:
    """The modal balance (2.113): (Φᵀ Z(at) Φ)⁻¹ (Φᵀ f − Φᵀ Z Φ q) (1, m, r) with Z of ``m`` and
    ∂Z = ``d``, and its derivatives (1, m, r, parameters), line by line."""
    inverses = _inverses(data, shapes)
    lossy = damped(m) or damped(at)
    force = shapes[data.references].T  # (m, r)
    d.foresee(2.0 * np.pi * data.frequency)
    for k, f in enumerate(data.frequency.tolist()):
        s, x = 2j * np.pi * f, data.X[k]
        q = np.stack([B @ x[:, j] for j, B in enumerate(inverses)], axis=1)
        now, then = (shapes.T @ (combined(z, s, lossy) @ shapes) for z in (m, at))
        change = d.between(2.0 * np.pi * f, shapes, shapes @ q)  # (m, r, parameters)
        values = np.linalg.solve(then, force - now @ q)
        flat = np.linalg.solve(then, change.reshape(len(then), -1))
        yield values[None], -flat.reshape(change.shape)[None]


def modal_deviations(data: FrfData, shapes: Real) -> Real:
    """The deviations of the rows of `modal_rows` (lines · m · r,): those of q."""
    each = np.stack(
        [
            np.sqrt(data.std[:, :, j] ** 2 @ (B**2).T)  # (f, m)
            for j, B in enumerate(_inverses(data, shapes))
        ],
        axis=2,
    )
    return np.asarray(each.reshape(-1))


def modal_labels(data: FrfData, shapes: Real, names: Sequence[str]) -> tuple[str, ...]:
    """What each of these rows is."""
    return tuple(
        f"{data.name}: mode {i + 1}/{names[j]} at {f:.6g} Hz"
        for f in data.frequency.tolist()
        for i in range(shapes.shape[1])
        for j in data.references.tolist()
    )
