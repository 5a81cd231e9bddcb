"""From nodes in space to a flat figure: which axes or which isometric view show the structure and
its motion best."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[Any]
ELEVATION = math.radians(28.0)
"""Of the eye above the horizon in an isometric view."""
AXES = "xyz"


@dataclass(frozen=True)
class View:
    """``project`` takes (…, 3) to (…, 2), lengths kept in m; ``axes`` names the two axes of a flat
    view, empty for an isometric one.

    ``aside`` is True for motion along a line, which is drawn across it.
    """

    matrix: Real
    axes: tuple[str, ...]
    aside: bool = False

    def project(self, points: Real) -> Real:
        """Points or displacements in the plane of the figure."""
        return np.asarray(points @ self.matrix.T)


def view_of(xyz: Real, moving: NDArray[np.bool_]) -> View:
    """The view of nodes ``xyz`` (n, 3) whose measured or free translations are ``moving`` (3,).

    Two axes hold a plane structure that moves in its plane, and a line; everything else is seen
    from above and aside, with z upwards, from where the nodes spread most over the figure.
    """
    size = np.ptp(xyz, axis=0)
    wide = size > 1e-6 * max(float(size.max()), 1e-300)
    needed = np.flatnonzero(wide | moving)
    if len(needed) <= 2:
        along = np.flatnonzero(wide)
        if len(needed) == 1:
            first = int(needed[0])
            matrix = np.zeros((2, 3))
            matrix[0, first] = 1.0
            return View(matrix, (AXES[first],), True)
        up = [int(i) for i in needed]
        if len(along) == 1 and int(along[0]) != 2 and up[0] != int(along[0]):
            up.reverse()  # the line lies flat, its motion points up
        return View(np.eye(3)[up], tuple(AXES[i] for i in up))
    centred = xyz - xyz.mean(axis=0)
    best, spread = np.eye(3)[:2], -1.0
    for degrees in range(-75, 90, 15):
        if degrees % 90 == 0:
            continue
        matrix = _from(math.radians(degrees))
        flat = centred @ matrix.T
        s = np.linalg.svd(flat, compute_uv=False)
        here = float(s[0] * s[-1]) * (1.0 + 0.02 * (degrees == -60))
        if here > spread + 1e-12:
            best, spread = matrix, here
    return View(best, ())


def _from(azimuth: float) -> Real:
    """Orthographic view from ``azimuth`` and ELEVATION: rows are right and up in space."""
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    eye = np.array(
        [
            math.cos(ELEVATION) * math.cos(azimuth),
            math.cos(ELEVATION) * math.sin(azimuth),
            math.sin(ELEVATION),
        ]
    )
    return np.vstack([right, np.cross(eye, right)])
