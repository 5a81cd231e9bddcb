"""Products of real matrices with complex arrays, in real arithmetic: a quarter of the work of
converting the matrix, and one call for many columns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.terms import Real

Complex = NDArray[np.complex128]


def times(A: Real | Complex, z: NDArray[Any]) -> Complex:
    """A (rows, n) times z (n, …) over its first axis: (rows, …), complex."""
    flat = np.ascontiguousarray(z, dtype=complex).reshape(len(z), -1)
    out = A @ flat if np.iscomplexobj(A) else (A @ flat.view(float)).view(complex)
    return np.asarray(out.reshape(len(A), *z.shape[1:]))


def drawn(shapes: Real, U: Complex) -> Complex:
    """Modal forces (modes, points, cases) of drives ``U`` (points, references, cases) at shapes
    (modes, references)."""
    return times(shapes, np.swapaxes(U, 0, 1))


def grounded(shapes: Real) -> Real:
    """Shapes (N, m) with the ground's row, zero, at the end, where −1 points."""
    return np.vstack([shapes, np.zeros((1, shapes.shape[1]))])
