"""Modes that the stabilisation diagram left out: looked for in the misfit, one by one, inside the
band and just beyond its edges.

pLSCF of a practical order separates two close modes only where both are strong, and a mode that is
not in the model biases those that are. So the misfit is correlated, line by line, with the FRF of
one more mode (a matched filter; Mallat & Zhang, IEEE Trans. Signal Process. 41 (1993) 3397, with
the modal model as dictionary and every step refined by maximum likelihood). A find is kept when it
pays for its parameters, explains a fair fraction of what is not noise, and is not the double of a
mode that is there: a misfit of another kind (leakage, a nonlinearity, the wrong law of damping)
sits on the peaks and has their shapes.

A mode near the band but outside it leaves a smooth misfit that biases the modes inside and makes
the deviations large. When the misfit is correlated along the lines, a mode above and one below the
band are tried beside the find inside. They are auxiliary: they carry the misfit away, their own
parameters mean little.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.convert import differentiator
from cvxupdate.recordings.identify.coarse import refine_coarsely
from cvxupdate.recordings.identify.criterion import parameters, worth
from cvxupdate.recordings.identify.lsfd import LinearFit, Setting
from cvxupdate.recordings.identify.model import (
    Roots,
    frequency_and_damping,
    pole_from_value,
    value_from_pole,
)
from cvxupdate.recordings.identify.stabilisation import Criteria, participation_mac
from cvxupdate.recordings.identify.uncertainty import (
    line_correlation,
    noise_level,
    reduced_chi_square,
)
from cvxupdate.recordings.types import Complex, Real

_SHARE = 0.02  # of the misfit beyond noise
_ALIKE = 0.9  # modal assurance from which two neighbours are one mode seen twice
_GRID = 800


def matched_filter(s: Setting, misfit: Complex, grid: Real, zeta: float) -> tuple[Real, Complex]:
    """Gain in cost of one more mode at each frequency of ``grid`` (Hz), and its residues (grid,
    outputs, inputs), unrestricted in rank."""
    lines, outputs, inputs = s.H.shape
    pole = 2.0 * np.pi * grid * complex(-zeta, np.sqrt(1.0 - zeta**2))
    squared = (s.weights**2).reshape(lines, -1)
    target = squared * misfit.reshape(lines, -1)
    g = differentiator(s.frequency, s.order)
    gain, residue = (
        np.zeros(grid.size),
        np.zeros((grid.size, outputs * inputs), dtype=np.complex128),
    )
    for at in range(0, grid.size, 100):
        d = (g[:, None] / (2j * np.pi * s.frequency[:, None] - pole[at : at + 100])).T
        power = np.maximum(np.abs(d) ** 2 @ squared, np.finfo(float).tiny)
        product = np.conj(d) @ target
        residue[at : at + 100] = product / power
        gain[at : at + 100] = np.sum(np.abs(product) ** 2 / power, axis=1)
    return gain, residue.reshape(-1, outputs, inputs)


def _doubles(roots: Roots, fit: LinearFit) -> bool:
    """Whether the last mode is a neighbour seen twice: within their half-power widths, and of one
    shape and participation."""
    pole = pole_from_value(roots.value, roots.damping)
    close = np.abs(pole[-1] - pole[:-1]) < -4.0 * (pole[-1].real + pole[:-1].real)
    for values in (fit.shapes, roots.participation):
        if values.shape[1] > 1:
            close &= participation_mac(values[-1:], values[:-1])[0] > _ALIKE
    return bool(np.any(close))


def _outside(s: Setting, roots: Roots, fit: LinearFit) -> list[tuple[Complex, Complex]]:
    """First guesses (pole, participation) above and below the band, from the strongest direction of
    the residuals."""
    low, high = float(s.frequency.min()), float(s.frequency.max())
    reach = 0.1 * (high - low)
    _, zeta = frequency_and_damping(roots.value, roots.damping)
    ratio = float(np.clip(np.median(zeta), 1e-4, 0.05)) if zeta.size else 0.01
    guesses = []
    for residual, f in (
        (fit.upper, high + reach),
        (fit.lower, low - reach if low > 2.0 * reach else 0.7 * low),
    ):
        direction: Real = (
            np.linalg.svd(residual[0])[2][0] if residual.shape[0] else np.ones(s.H.shape[2])
        )
        pole = np.array([2.0 * np.pi * f * complex(-ratio, np.sqrt(1.0 - ratio**2))])
        guesses.append(
            (value_from_pole(pole, roots.damping), direction[None, :].astype(np.complex128))
        )
    return guesses


def _inside(
    s: Setting, roots: Roots, fit: LinearFit, zeta: float, tried: list[float]
) -> tuple[float, list[tuple[Complex, Complex]]]:
    """Frequency (Hz) and first guess of the mode inside the band that the misfit calls for; none
    when no frequency would pay for one."""
    grid = s.frequency[:: max(1, s.frequency.size // _GRID)]
    gain, residue = matched_filter(s, fit.misfit, grid, zeta)
    for at in tried:
        gain[np.abs(grid - at) < 2.0 * zeta * at] = 0.0
    best = int(np.argmax(gain))
    noise = noise_level(s, fit)
    excess = fit.cost - noise * 2.0 * s.H.size
    if gain[best] < 0.5 * _SHARE * excess or not worth(
        s, fit, float(gain[best]) / max(noise, 1e-300), parameters(s, 0)[0]
    ):
        return 0.0, []
    pole = np.array([2.0 * np.pi * grid[best] * complex(-zeta, np.sqrt(1.0 - zeta**2))])
    return float(grid[best]), [
        (value_from_pole(pole, roots.damping), np.linalg.svd(residue[best])[2][:1])
    ]


def with_missed_modes(
    s: Setting, roots: Roots, fit: LinearFit, c: Criteria, *, iterations: int, limit: int = 15
) -> tuple[Roots, LinearFit]:
    """Add modes inside the band and just beyond its edges, always the one that explains most, while
    they pay for their parameters.

    Ends after ``limit`` modes (three of them beyond the edges), or three refusals in a row.
    """
    low, high = s.band
    first = roots.value.size
    _, damping = frequency_and_damping(roots.value, roots.damping)
    zeta = float(np.clip(np.median(damping), 1e-4, c.max_damping)) if damping.size else 0.01
    tried: list[float] = []
    refused, beyond, edges = 0, 0, True
    while (
        first
        and refused < 3
        and roots.value.size < first + limit
        and fit.cost > 1e-12 * float(np.sum(np.abs(s.weights * s.H) ** 2))
    ):
        at, starts = _inside(s, roots, fit, zeta, tried)
        known = len(starts)
        if edges and beyond < 3 and line_correlation(s, fit) >= 1.2:
            starts = starts + _outside(s, roots, fit)
        if not starts:
            break
        trials = []
        for value, participation in starts:
            start = Roots(
                np.append(roots.value, value),
                np.concatenate([roots.participation, participation]),
                roots.damping,
            )
            trials.append(refine_coarsely(s, start, iterations=min(iterations, 4), tolerance=0.02))
        chosen = int(np.argmin([trial[1].cost for trial in trials]))
        more, found = refine_coarsely(s, trials[chosen][0], iterations=iterations)
        if _holds(s, (roots, fit), (more, found), c):
            f = frequency_and_damping(more.value, more.damping)[0][-1]
            roots, fit, refused, tried, edges, beyond = (
                more,
                found,
                0,
                [],
                True,
                beyond + int(not low <= f <= high),
            )
        else:
            refused += 1
            tried, edges = ([*tried, at], edges) if chosen < known else (tried, False)
    return roots, fit


def _holds(
    s: Setting, before: tuple[Roots, LinearFit], after: tuple[Roots, LinearFit], c: Criteria
) -> bool:
    """Whether the last mode is one: it leaves the others in place, is physical, no double, and
    worth its parameters."""
    low, high = s.band
    f, zeta = frequency_and_damping(after[0].value, after[0].damping)
    old = frequency_and_damping(before[0].value, before[0].damping)[0]
    if not np.all(np.abs(f[:-1] - old) < 2.0 * c.frequency * old):
        return False
    gained = before[1].cost - after[1].cost
    one, every = parameters(s, f.size)
    if low <= f[-1] <= high:
        excess = before[1].cost - noise_level(s, before[1]) * 2.0 * s.H.size
        if zeta[-1] > c.max_damping or gained < _SHARE * excess or _doubles(*after):
            return False
    return worth(s, after[1], gained / max(reduced_chi_square(s, after[1], every), 1e-300), one)
