"""One transformation, x_N = T x_n, that both reduces a model and expands a measurement (2.45,
2.58)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from cvxupdate.errors import InputError

Index = NDArray[np.intp]
Array = NDArray[Any]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class Transformation:
    """x_N = T x: full-model DOFs from masters (and, for Craig–Bampton, modal coordinates after
    them).

    Parameters
    ----------
    matrix : T, (N, n + generalised), dense and tall, rows in the order of the full model.
    masters : (n,) rows of the full model; the first n columns belong to them, in this order.
    method : the name of the method, for reports.
    generalised : the number of modal coordinates after the masters (0 but for Craig–Bampton).
    frequency : Hz, where the transformation is meant for one frequency; None otherwise.
    """

    matrix: Array
    masters: Index
    method: str
    generalised: int = 0
    frequency: float | None = None

    @property
    def size(self) -> int:
        """N, the number of DOFs of the full model."""
        return int(self.matrix.shape[0])

    @property
    def keeps_measured(self) -> bool:
        """True when expansion leaves the measured values as they are; SEREP smooths them."""
        n = self.masters.size
        return bool(np.allclose(self.matrix[self.masters, :n], np.eye(n), rtol=0.0, atol=1e-9))

    def reduce(self, K: Any) -> Array:
        """Tᵀ K T, dense (n + generalised)², in the unit of K; K (N, N) is sparse or dense.

        Raises `InputError` when K has another size.
        """
        if K.shape != (self.size, self.size):
            raise InputError(
                f"{self.method}: cannot reduce a matrix of shape {K.shape}; T is for "
                f"{self.size} DOFs"
            )
        return np.asarray(self.matrix.T @ np.asarray(K @ self.matrix))

    def expand(self, phi: Array) -> Array:
        """T φ: shapes (n,) or (n, modes) at the masters to (N,) or (N, modes) at every DOF.

        Raises `InputError` when the rows are not the masters, or an entry is NaN (not measured).
        """
        values = np.asarray(phi)
        if values.ndim not in (1, 2) or values.shape[0] != self.matrix.shape[1]:
            raise InputError(
                f"{self.method}: expands {self.matrix.shape[1]} rows (the masters"
                f"{' and modal coordinates' if self.generalised else ''}), got shape {values.shape}"
            )
        if not np.all(np.isfinite(values)):
            raise InputError(
                f"{self.method}: a shape has entries that are not finite; leave a channel "
                "that was not measured out of the masters"
            )
        return np.asarray(self.matrix @ values)


def reduced_modes(
    transformation: Transformation, K: Any, M: Any, count: int | None = None
) -> tuple[Real, Array]:
    """Natural frequencies and shapes of the reduced model.

    The pencil is projected on an orthonormal basis of the columns of T, so that SEREP from fewer
    modes than masters, whose reduced matrices are singular, gives exactly its own modes and nothing
    else.

    Returns
    -------
    frequency (k,) Hz, ascending; shapes (N, k) at every DOF of the full model, mass-normalised.
    ``shapes[transformation.masters]`` are those at the masters.
    """
    U, sigma, _ = np.linalg.svd(transformation.matrix, full_matrices=False)
    U = U[:, sigma > 1e-10 * sigma[0]]
    projected = Transformation(U, transformation.masters, transformation.method)
    value, q = eigh(projected.reduce(K), projected.reduce(M))
    frequency = np.sqrt(np.maximum(value, 0.0)) / (2.0 * np.pi)
    return frequency[:count], U @ q[:, :count]


def expand_each(at: Callable[[float], Transformation], phi: Array, frequency: Real) -> Array:
    """Expand every mode with the transformation of its own frequency (dynamic, Gysin): (n, modes)
    to (N, modes).

    ``at`` makes the transformation at a frequency in Hz, e.g. ``lambda f: dynamic(split, f)``;
    ``frequency`` is (modes,) in Hz. Raises `InputError` when the numbers of modes do not agree.
    """
    f = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
    if phi.ndim != 2 or phi.shape[1] != f.size:
        raise InputError(
            f"expand_each: shapes {phi.shape} need one frequency per column, got {f.size}"
        )
    return np.column_stack([at(float(f[r])).expand(phi[:, r]) for r in range(f.size)])
