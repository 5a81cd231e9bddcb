"""Modes far above the band: together they are a smooth function of s, so a few points of it give it
everywhere.

1 / (s² + 2 ζ ω s + λ) is analytic up to its poles. On an interval of the line s = δ + iω,
Chebyshev interpolation at k nodes misses ρ⁻ᵏ of it, ρ the sum of the half-axes of the largest
ellipse around the interval that leaves the poles outside (Trefethen 2013, Theorem 8.2): a dozen
nodes for modes above twice the band, to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.synthesis.products import Complex, times
from cvxupdate.fe.terms import Real

APART = 1.8  # times the band's top: modes above are high
MISSED = 1e-12  # relative error of the interpolation
MOST = 40  # nodes: for more, the modes are better taken one by one


@dataclass(frozen=True)
class HighModes:
    """The modes from number ``first`` on: 1 / d at the nodes ``inverse`` (modes, nodes), ``W``
    (points, nodes) from nodes to points.

    ``at`` (modes, sensors) and ``held`` (modes, references) are their shapes; ``U`` (points,
    references, cases) the drive, None for units of one each.
    """

    first: int
    inverse: Complex
    W: Real
    at: Real
    held: Real
    U: Complex | None

    def between(self, shapes: Real, factor: float | Real, power: int = 1) -> Complex:
        """Σ φ factor φ_drive / dᵖ · U over the modes, ``shapes`` (modes, places): (points, places,
        cases)."""
        values = (
            np.asarray(factor)[..., None] * self.inverse**power
            if np.ndim(factor)
            else factor * self.inverse**power
        )
        nodes = times(
            shapes.T, values[:, :, None] * self.held[:, None, :]
        )  # (places, nodes, references)
        return self._driven(np.swapaxes(nodes, 0, 1))

    def left(self, phi: Real) -> Complex:
        """(places, points, sensors) of places with shapes ``phi`` (places, modes)."""
        nodes = times(phi, self.inverse[:, :, None] * self.at[:, None, :])
        return np.matmul(self.W, nodes.view(float)).view(complex)

    def right(self, phi: Real) -> Complex:
        """(places, points, cases) of places with shapes ``phi`` (places, modes)."""
        return np.asarray(np.swapaxes(self.between(phi.T, 1.0), 0, 1))

    def _driven(self, nodes: Complex) -> Complex:
        """(nodes, places, references) to (points, places, cases)."""
        points = times(self.W, nodes)
        return points if self.U is None else np.asarray(np.matmul(points, self.U))


def high_modes(
    s: Complex,
    U: Complex | None,
    near: int,
    stiff: Real | Complex,
    slow: Real,
    at: Real,
    held: Real,
) -> HighModes | None:
    """The high modes of a response, none of the first ``near``; None where there are too few to be
    worth it.

    ``stiff`` and ``slow`` (modes,) are what goes with displacement, ω² and what is lost with it,
    and with velocity (`cvxupdate.fe.synthesis.loss`); ``at``, ``held`` (modes, ·) shapes at sensors
    and drives.
    """
    omega = s.imag
    middle, half = (omega.max() + omega.min()) / 2.0, (omega.max() - omega.min()) / 2.0
    first = max(near, int(np.searchsorted(np.sqrt(stiff.real), APART * np.abs(omega).max())))
    if first >= len(stiff) or half <= 0.0 or np.ptp(s.real) > 0.0:
        return None
    root = np.sqrt((slow[first:] ** 2 / 4.0 - stiff[first:]).astype(complex))
    poles = np.concatenate([-slow[first:] / 2.0 + root, -slow[first:] / 2.0 - root])
    z = ((poles - s.real[0]) / 1j - middle) / half
    w = np.sqrt(z**2 - 1.0)
    rho = float(np.min(np.maximum(np.abs(z + w), np.abs(z - w))))
    count = int(np.ceil(-np.log(MISSED) / np.log(max(rho, 1.0 + 1e-9))))
    if count > MOST or count >= min(len(stiff) - first, len(s)):
        return None
    angle = (2.0 * np.arange(count) + 1.0) * np.pi / (2.0 * count)
    nodes = s.real[0] + 1j * (middle + half * np.cos(angle))
    inverse = 1.0 / (nodes**2 + slow[first:, None] * nodes + stiff[first:, None])
    return HighModes(
        first,
        inverse,
        _barycentric(
            (omega - middle) / half, np.cos(angle), (-1.0) ** np.arange(count) * np.sin(angle)
        ),
        at[first:],
        held[first:],
        U,
    )


def _barycentric(x: Real, nodes: Real, weights: Real) -> Real:
    """Matrix (points, nodes) that interpolates (Berrut and Trefethen 2004)."""
    gap = x[:, None] - nodes
    hit = gap == 0.0
    W = weights / np.where(hit, 1.0, gap)
    W = W / W.sum(axis=1, keepdims=True)
    met = hit.any(axis=1)
    W[met] = hit[met]
    return np.asarray(W)
