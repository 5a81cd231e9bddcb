"""Local axes of shell elements, and where their nodes lie in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.shells.outlines import sides_of
from cvxupdate.fe.terms import Real

FLAT = 1e-9
"""Sine below which a direction is that of another: rounding of written coordinates."""


@dataclass(frozen=True)
class Frame:
    """``triads`` (e, 3, 3), rows local x, y and the normal; ``plane`` (e, n, 2) the corners seen
    along the normal, from their mean; ``height`` (e, n) how far each node lies above the mean
    plane."""

    triads: Real
    plane: Real
    height: Real


def frames(xyz: Real, orientation: Real) -> Frame:
    """Axes of elements with corners ``xyz`` (e, 3 or 4, 3), in order around them.

    The normal is that of both diagonals (of the triangle); the nodes of a warped quadrilateral
    then lie as far above the mean plane as below it. Local x is the projection of ``orientation``
    (e, 3), or of the first side where that is zero.

    Raises
    ------
    ModelError
        For an element without area, one that is not convex, or an orientation along the normal.
    """
    last = xyz[:, 3] if xyz.shape[1] == 4 else xyz[:, 0]
    normal = np.cross(xyz[:, 2] - xyz[:, 0], last - xyz[:, 1])
    size = np.abs(xyz - xyz[:, :1]).max(axis=(1, 2))
    area = np.linalg.norm(normal, axis=1)
    if np.any(area <= FLAT * size**2):
        raise ModelError(
            "a shell element has no area. Order its nodes around it, at different points."
        )
    normal /= area[:, None]
    given = np.any(orientation != 0.0, axis=1, keepdims=True)
    along = np.where(given, orientation, xyz[:, 1] - xyz[:, 0])
    ex = along - np.einsum("ei,ei->e", along, normal)[:, None] * normal
    length = np.linalg.norm(ex, axis=1)
    if np.any(length <= FLAT * np.linalg.norm(along, axis=1)):
        raise ModelError(
            "the orientation vector of a shell element is along its normal. Give one that lies "
            "nearly in its plane."
        )
    ex /= length[:, None]
    triads = np.stack([ex, np.cross(normal, ex), normal], axis=1)
    local = np.einsum("eij,enj->eni", triads, xyz - xyz.mean(axis=1, keepdims=True))
    plane, height = local[:, :, :2], local[:, :, 2]
    if xyz.shape[1] == 4 and np.any(_turns(plane) <= FLAT * size[:, None] ** 2):
        raise ModelError(
            "a shell element is not convex, or its nodes are not in order around it. Order them, "
            "or divide it into triangles."
        )
    return Frame(triads, plane, height)


def _turns(plane: Real) -> Real:
    """Twice the area of the triangle at every corner, (e, n): positive where the outline turns
    left."""
    ahead = np.roll(plane, -1, axis=1) - plane
    behind = plane - np.roll(plane, 1, axis=1)
    return np.asarray(behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0])


def side_vectors(plane: Real) -> Real:
    """From the first to the second corner of each side, (e, s, 2)."""
    i, j = np.array(sides_of(plane.shape[1])).T
    return plane[:, j] - plane[:, i]


def shear_lengths(xyz: Real) -> Real:
    """The length that the shear flexibility of each element goes with, m, (e,): that of the mesh.

    It is the median of √area (of twice the area for triangles: that of the parallelogram), the same
    for all elements within a factor of two of it, and a power of four of it for others: side by
    side, elements of one sheet must bend their common side alike, or constant curvature would not
    pass.
    """
    last = xyz[:, 3] if xyz.shape[1] == 4 else xyz[:, 0]
    normal = np.cross(xyz[:, 2] - xyz[:, 0], last - xyz[:, 1])
    scale = 0.5 if xyz.shape[1] == 4 else 1.0
    own = np.sqrt(scale * np.linalg.norm(normal, axis=1))
    middle = float(np.median(own))
    return np.asarray(middle * 4.0 ** np.round(np.log(own / middle) / np.log(4.0)))
