"""Appropriated forces: from an indicator's curves to natural frequencies, force patterns and normal
modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.appropriate import indicators
from cvxupdate.recordings.types import Complex, Real

Curves = Callable[[Complex], tuple[Real, Real]]
_CROSSING: dict[str, Curves] = {
    "asher": indicators.asher,
    "modified-asher": indicators.modified_asher,
    "traill-nash": indicators.traill_nash,
}
_DIP: dict[str, Curves] = {
    "extended-asher": indicators.extended_asher,
    "mmif": indicators.mmif,
    "nash": indicators.nash,
}
METHODS = (*_CROSSING, *_DIP)


@dataclass(frozen=True)
class Appropriated:
    """Modes excited on purpose.

    ``frequency`` (modes,) Hz, undamped; ``forces`` (modes, exciters) of unit length; ``shapes``
    (modes, responses): the response in quadrature to that force, real, largest entry 1; ``purity``
    (modes,) fraction of the response's power in quadrature, 1 = pure.
    """

    frequency: Real
    forces: Real
    shapes: Real
    purity: Real


def _between(frequency: Real, H: Complex, f: float) -> Complex:
    """H at a frequency between the lines, linear in the dynamic flexibility, (responses,
    exciters)."""
    k = int(np.clip(np.searchsorted(frequency, f) - 1, 0, frequency.size - 2))
    fraction = (f - frequency[k]) / (frequency[k + 1] - frequency[k])
    return np.asarray((1.0 - fraction) * H[k] + fraction * H[k + 1])


def _purity(h: Complex, force: Real) -> float:
    x = h @ force
    return float(np.sum(x.imag**2) / max(float(np.sum(np.abs(x) ** 2)), 1e-300))


def _crossings(frequency: Real, H: Complex, method: str) -> list[tuple[float, Real]]:
    """Zeros of the eigenvalue curves at which the force leads to resonance: the real part falls
    with the response's own sign."""
    values, _ = _CROSSING[method](H)
    found: list[tuple[float, Real]] = []
    for k in range(values.shape[1]):
        for line in np.flatnonzero(np.sign(values[:-1, k]) * np.sign(values[1:, k]) < 0):
            a, b = values[line, k], values[line + 1, k]
            # the curve bends within a line where eigenvalues avoid one another: its zero is sought
            # on the interpolated FRFs
            f = (
                float(
                    brentq(
                        lambda at, k=k: float(
                            _CROSSING[method](_between(frequency, H, at)[None])[0][0, k]
                        ),
                        frequency[line],
                        frequency[line + 1],
                        xtol=1e-9 * float(frequency[line]),
                    )
                )
                if np.isfinite(a) and np.isfinite(b)
                else float(frequency[line])
            )
            h = _between(frequency, H, f)
            here, vectors = indicators.modified_asher(h[None])
            force = vectors[0, :, int(np.argmin(np.abs(here[0])))]
            slope = float(force @ (H[line + 1].real - H[line].real) @ force)
            # antiresonances are zeros too, but there Re H rises where the quadrature response is
            # negative
            if slope * float(force @ h.imag @ force) > 0.0:
                found.append((f, force))
    return found


def _dip_value(method: str, h: Complex, k: int) -> float:
    """Curve k (0 = lowest) of an indicator at one frequency; Nash's maxima are turned into
    minima."""
    values = _DIP[method](h[None])[0][0]
    return float(1.0 - values[values.size - 1 - k]) if method == "nash" else float(values[k])


def _dips(frequency: Real, H: Complex, method: str, threshold: float) -> list[tuple[float, Real]]:
    """Local minima of the curves, placed between the lines on interpolated FRFs, whose force moves
    the structure in quadrature."""
    values, _ = _DIP[method](H)
    curves = 1.0 - values[:, ::-1] if method == "nash" else values
    found: list[tuple[float, Real]] = []
    for k in range(curves.shape[1]):
        c = curves[:, k]
        for line in np.flatnonzero((c[1:-1] < c[:-2]) & (c[1:-1] <= c[2:])) + 1:
            # where two sorted curves cross, the upper one has a kink that is no minimum, and the
            # lower one a peak
            if k and np.max(below := curves[max(line - 2, 0) : line + 3, k - 1]) > max(
                below[0], below[-1]
            ):
                continue
            f = float(
                minimize_scalar(
                    lambda at, k=k: _dip_value(method, _between(frequency, H, at), k),
                    method="bounded",
                    bounds=(frequency[line - 1], frequency[line + 1]),
                    options={"xatol": 1e-8 * float(frequency[line])},
                ).x
            )
            h = _between(frequency, H, f)
            vectors = _DIP[method](h[None])[1][0]
            force = vectors[:, vectors.shape[1] - 1 - k] if method == "nash" else vectors[:, k]
            if 1.0 - _purity(h, force) < threshold:
                found.append((f, force))
    return found


def _distinct(rows: list[tuple[float, Real, Real, float]]) -> list[tuple[float, Real, Real, float]]:
    """One mode for neighbouring finds (1 % in frequency) of the same shape (MAC above 0.9): the
    purest, by frequency."""
    kept: list[tuple[float, Real, Real, float]] = []
    for row in sorted(rows, key=lambda r: -r[3]):
        a = row[2] / np.linalg.norm(row[2])
        if all(
            abs(row[0] - r[0]) > 0.01 * r[0] or float(a @ r[2]) ** 2 < 0.9 * float(r[2] @ r[2])
            for r in kept
        ):
            kept.append(row)
    return sorted(kept, key=lambda r: r[0])


def appropriate(
    frequency: Real,
    H: Complex,
    method: str = "mmif",
    *,
    threshold: float = 0.3,
    principal: Real | None = None,
) -> Appropriated:
    """Natural frequencies, appropriated forces and normal modes of the band.

    Parameters
    ----------
    frequency : (lines,) Hz. H : (lines, responses, exciters), receptance or accelerance.
    method : asher, modified-asher, traill-nash (square H) or extended-asher, mmif, nash (any H);
    assumptions in
    `indicators`. threshold : the largest fraction of the response's power that may be in phase with
    the force.
    principal : (exciters, kept) force vectors of `principal_forces`; for a square method the
    responses are reduced
    alike.

    Raises
    ------
    RecordingError
        When the method is unknown, or H has not the form that it needs.
    """
    if method not in METHODS:
        raise RecordingError(
            f"unknown force appropriation {method!r}; choose one of {', '.join(METHODS)}"
        )
    V = np.eye(H.shape[2]) if principal is None else principal
    reduced = H @ V
    if method in _CROSSING:
        if principal is not None and H.shape[1] == H.shape[2]:
            reduced = V.T @ reduced
        found = _crossings(frequency, np.asarray(reduced), method)
    else:
        found = _dips(frequency, np.asarray(reduced), method, threshold)
    rows: list[tuple[float, Real, Real, float]] = []
    for f, g in sorted(found, key=lambda item: item[0]):
        force = V @ g / np.linalg.norm(V @ g)
        h = _between(frequency, H, f)
        shape = (h @ force).imag
        top = shape[int(np.argmax(np.abs(shape)))]
        if top != 0.0 and 1.0 - _purity(h, force) < threshold:
            rows.append((f, force, shape / top, _purity(h, force)))
    rows = _distinct(rows)
    return Appropriated(
        np.array([r[0] for r in rows]),
        np.array([r[1] for r in rows]).reshape(-1, H.shape[2]),
        np.array([r[2] for r in rows]).reshape(-1, H.shape[1]),
        np.array([r[3] for r in rows]),
    )
