"""How complex a mode shape is: phase collinearity and the modal complexity factors. ``shapes`` is
(modes, channels)."""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.phase import rotated
from cvxupdate.recordings.types import Complex, Real


def phase_collinearity(shapes: Complex) -> Real:
    """Modal phase collinearity (MPC), (modes,): 1 for a real shape times any phase, 0 for phases
    spread evenly.

    ``|phi^T phi|² / (phi^H phi)²`` (J. Juang, R. Pappa, J. Guid. Control Dyn. 8 (1985) 620, without
    centring).
    """
    return np.asarray(
        np.abs(np.sum(shapes**2, axis=1)) ** 2 / np.sum(np.abs(shapes) ** 2, axis=1) ** 2
    )


def mean_phase_deviation(shapes: Complex) -> Real:
    """Mean phase deviation (MPD), (modes,) in degrees: how far the entries lie off the line of best
    fit through the origin, weighted by their size; 0 for a real shape, 45 for phases spread evenly.

    After E. Reynders, J. Houbrechts, G. De Roeck, Mech. Syst. Signal Process. 29 (2012) 228.
    """
    z = rotated(shapes)
    size = np.abs(z)
    total = np.sum(size, axis=1)
    angle = np.arctan2(np.abs(z.imag), np.abs(z.real))
    return np.degrees(np.sum(size * angle, axis=1) / np.where(total > 0.0, total, np.inf))


def complexity_phase(shapes: Complex) -> Real:
    """MCF1, (modes,): scatter of phase, 0 for a real shape, 1 when all phases differ as much as
    they can.

    Mean over all pairs of entries of \\|sin(phase difference)\\|, weighted by the product of the
    amplitudes, relative to its value 2/pi for phases spread evenly, at most 1 (after M. Imregun, D.
    Ewins, IMAC XIII (1995): the sum of the phase differences between all pairs; the sine makes 0
    and 180 degrees equal).
    """
    product = shapes[:, :, None] * np.conj(shapes[:, None, :])
    off = ~np.eye(shapes.shape[1], dtype=bool)
    total = np.sum(np.abs(product)[:, off], axis=1)
    return np.minimum(
        np.sum(np.abs(product.imag)[:, off], axis=1)
        / np.where(total > 0, total, np.inf)
        * np.pi
        / 2,
        1.0,
    )


def _hull_area(z: Complex) -> float:
    """Area of the convex hull of points of the complex plane (monotone chain)."""
    points = sorted({(float(p.real), float(p.imag)) for p in z})
    if len(points) < 3:
        return 0.0

    def chain(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
        hull: list[tuple[float, float]] = []
        for p in ordered:
            while len(hull) > 1 and (hull[-1][0] - hull[-2][0]) * (p[1] - hull[-2][1]) <= (
                hull[-1][1] - hull[-2][1]
            ) * (p[0] - hull[-2][0]):
                hull.pop()
            hull.append(p)
        return hull[:-1]

    hull = np.array(chain(points) + chain(points[::-1]))
    x, y = hull[:, 0], hull[:, 1]
    return float(0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def complexity_area(shapes: Complex) -> Real:
    """MCF2, (modes,): area of the polygon around the entries in the complex plane over that of the
    circle through the largest.

    0 for a real shape (all entries on one line), towards 1 for a travelling wave (M. Imregun, D.
    Ewins, IMAC XIII (1995); Ewins, *Modal Testing*, 2nd ed., section 2.8). The polygon is the
    convex hull.
    """
    largest = np.max(np.abs(shapes), axis=1)
    return np.array(
        [
            _hull_area(row / top) / np.pi if top > 0 else 0.0
            for row, top in zip(shapes, largest, strict=True)
        ]
    )
