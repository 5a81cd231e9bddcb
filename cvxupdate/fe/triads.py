"""Local axes of line elements."""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.terms import Real


def line_triads(xyz: Real, orientation: Real) -> Real:
    """Local axes of two-node elements, (e, 3, 3), rows x, y, z.

    Local x runs from the first node to the second; ``orientation`` (e, 3) lies in the local x–z
    plane. A row of zeros asks for the usual default: global z, or global −x for a bar along z, so
    that in both cases local y is along global y (either way) for bars in the x–z plane.

    Raises
    ------
    ModelError
        When an element has no length or its orientation is parallel to its axis.
    """
    d = xyz[:, 1] - xyz[:, 0]
    length = np.linalg.norm(d, axis=1, keepdims=True)
    if np.any(length == 0.0):
        raise ModelError("an element has no length: its two nodes coincide. Move one of them.")
    ex = d / length
    vertical = np.abs(ex[:, 2:]) > 1.0 - 1e-9
    default = np.where(vertical, np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    given = np.any(orientation != 0.0, axis=1, keepdims=True)
    v = np.where(given, orientation, default)
    ey = np.cross(v, ex)
    norm = np.linalg.norm(ey, axis=1, keepdims=True)
    if np.any(norm <= 1e-9 * np.linalg.norm(v, axis=1, keepdims=True)):
        raise ModelError(
            "the orientation vector of an element is parallel to its axis. Give a vector "
            "that lies in its local x-z plane."
        )
    ey = ey / norm
    return np.stack([ex, ey, np.cross(ex, ey)], axis=1)
