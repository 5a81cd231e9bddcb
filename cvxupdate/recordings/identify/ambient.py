"""Modes from responses alone: covariance-driven stochastic subspace identification (SSI-cov).

The excitation was not recorded; it is taken to be white over the band. Then correlations of the
responses are free responses of the structure: their block Hankel matrix has the observability
matrix as its left factor, for every order one state matrix follows (P. Van Overschee, B. De Moor
1996; B. Peeters, G. De Roeck, Mech. Syst. Signal Process. 13 (1999) 855). Deviations: the record is
cut into pieces, each piece's correlations move the state matrix to first order, and their scatter
is that of poles and shapes (E. Reynders, R. Pintelon, G. De Roeck, Mech. Syst. Signal Process. 22
(2008) 948).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.identify.ambient_record import (
    block_hankel,
    block_rows,
    correlations,
    decimated,
    motion_columns,
    must_stand_out,
    scaled,
)
from cvxupdate.recordings.identify.plscf import PoleSet
from cvxupdate.recordings.identify.selection import clusters
from cvxupdate.recordings.identify.stabilisation import Criteria, Stabilisation, stabilisation
from cvxupdate.recordings.realise.indicators import mean_phase_deviation, phase_collinearity
from cvxupdate.recordings.types import Channel, Complex, Real, TimeHistory

LEAST_MPC, MOST_MPD = 0.5, 35.0
"""Clusters less collinear than this are no modes of a structure whose damping is moderate; both
must be exceeded, because either alone also falls for modes that are hardly seen."""


CLUSTER = Criteria(fraction=0.5)
"""Nothing after the diagram drops what noise makes up, so a mode must be in half of the orders."""
DOUBTFUL = 0.5
"""Deviation of the damping over the damping above which a cluster is no mode: poles of noise have
no width of their own, and the pieces of the record disagree on it."""


@dataclass(frozen=True)
class AmbientModes:
    """Modes from responses alone, by increasing frequency: ``frequency`` Hz, ``damping`` fraction
    of critical, ``shapes`` (modes, channels) complex, largest entry 1, of arbitrary scale; each
    with its deviation (NaN where the record is too short to tell). ``stabilisation`` the diagram,
    ``channels`` their labels, ``rate`` Hz after decimation, ``lags`` of the correlations used,
    ``pieces`` of the record behind the deviations, ``dropped`` frequencies of clusters that were no
    modes by MPC and MPD, or by the deviation of their damping."""

    frequency: Real
    frequency_std: Real
    damping: Real
    damping_std: Real
    poles: Complex
    shapes: Complex
    shape_std: Real
    channels: tuple[Channel, ...]
    stabilisation: Stabilisation
    band: tuple[float, float]
    rate: float
    lags: int
    pieces: int
    dropped: tuple[float, ...] = ()


@dataclass(frozen=True)
class _State:
    """One order: discrete eigenvalues, their vectors, and shapes (n, channels)."""

    order: int
    U: Real
    A: Real
    values: Complex
    right: Complex
    left: Complex
    shapes: Complex


def identify_ambient(
    history: TimeHistory,
    band: tuple[float, float] | None = None,
    *,
    max_order: int = 60,
    criteria: Criteria | None = None,
    quantity: str | None = None,
) -> AmbientModes:
    """Modes of the responses of a record, forces left aside.

    Parameters
    ----------
    band : (lowest, highest) Hz of interest; default eight periods of the record to 0.4 of the rate.
    max_order : states of the largest model, two for each mode. criteria : see `Criteria`.
    quantity : of the channels; default the one that most of them have.

    Raises
    ------
    RecordingError
        When there is no motion, the band is beyond the rate, or the record is too short or noise.
    """
    c = criteria if criteria is not None else CLUSTER
    columns = motion_columns(history, quantity)
    samples = len(history.data)
    low, high = band if band is not None else (8.0 * history.rate / samples, 0.4 * history.rate)
    y, rate = decimated(history, columns, high)
    y, scale = scaled(y, history, columns)
    rows = block_rows(rate, max(low, 0.02 * high), len(columns), max_order, len(y))
    R = correlations(y, 2 * rows)
    mean = R.mean(axis=0)
    hankel = block_hankel(mean, rows)
    U, s, Vt = np.linalg.svd(hankel)
    must_stand_out(float(s[0]), R - mean, rows, history.origin.name)
    top = min(max_order, (rows - 1) * len(columns), int(np.count_nonzero(s > 1e-12 * s[0])))
    states = [_state(U[:, :n], n, len(columns)) for n in range(2, top + 1, 2)]
    sets = [_poles(state, rate, scale) for state in states]
    diagram = stabilisation(sets, (max(low, 1e-6), high), c)
    chosen, dropped = _chosen(diagram, c)
    moved = _Moved(R, mean, rows, U, s, Vt)
    found = [_mode(states, diagram, group, rate, scale, moved) for group in chosen]
    found.sort(key=lambda item: abs(item[0]))
    doubtful = [f[2][1] > DOUBTFUL * -f[0].real / abs(f[0]) for f in found]
    dropped += [abs(f[0]) / (2.0 * np.pi) for f, bad in zip(found, doubtful, strict=True) if bad]
    return _result(
        [f for f, bad in zip(found, doubtful, strict=True) if not bad],
        tuple(history.channels[k] for k in columns),
        diagram,
        (low, high),
        (rate, 2 * rows, len(R)),
        tuple(sorted(dropped)),
    )


def _result(
    found: list[Found],
    channels: tuple[Channel, ...],
    diagram: Stabilisation,
    band: tuple[float, float],
    sizes: tuple[float, int, int],
    dropped: tuple[float, ...],
) -> AmbientModes:
    poles = np.array([item[0] for item in found], dtype=np.complex128)
    size = np.abs(poles)
    std = np.array([item[2] for item in found]).reshape(-1, 2)
    return AmbientModes(
        frequency=np.asarray(size / (2.0 * np.pi)),
        frequency_std=std[:, 0],
        damping=np.asarray(-poles.real / size),
        damping_std=std[:, 1],
        poles=poles,
        shapes=np.array([item[1] for item in found]).reshape(-1, len(channels)),
        shape_std=np.array([item[3] for item in found]).reshape(-1, len(channels)),
        channels=channels,
        stabilisation=diagram,
        band=band,
        rate=sizes[0],
        lags=sizes[1],
        pieces=sizes[2],
        dropped=dropped,
    )


def _state(U: Real, order: int, channels: int) -> _State:
    A = np.linalg.lstsq(U[:-channels], U[channels:], rcond=None)[0]
    values, right = (v.astype(np.complex128) for v in np.linalg.eig(A))
    left = np.linalg.inv(right).conj().T
    shapes = (U[:channels] @ right).T
    return _State(order, U, np.asarray(A, dtype=np.float64), values, right, left, shapes)


def _continuous(values: Complex, rate: float) -> Complex:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.log(values.astype(np.complex128)) * rate)


def _poles(state: _State, rate: float, scale: Real) -> PoleSet:
    poles = _continuous(state.values, rate)
    keep = np.isfinite(poles) & (poles.imag > 0.0) & (poles.real < 0.0)
    rank = np.argsort(poles[keep].imag)
    return PoleSet(state.order, poles[keep][rank], (state.shapes * scale)[keep][rank])


def _chosen(diagram: Stabilisation, c: Criteria) -> tuple[list[list[int]], list[float]]:
    """Clusters that live long enough and are collinear enough; frequencies of those that live long
    enough only."""
    needed = max(c.least, int(np.ceil(c.fraction * np.unique(diagram.order).size)))
    kept, dropped = [], []
    for group in clusters(diagram, c):
        if len(group) < needed:
            continue
        shapes = diagram.participation[group]
        if shapes.shape[1] > 2:
            mpc = float(np.median(phase_collinearity(shapes)))
            mpd = float(np.median(mean_phase_deviation(shapes)))
            if mpc < LEAST_MPC and mpd > MOST_MPD:
                dropped.append(float(np.median(diagram.frequency[group])))
                continue
        kept.append(group)
    return kept, dropped


@dataclass(frozen=True)
class _Moved:
    """What each piece of the record moves: its correlations beside the mean, and the factors of the
    mean's Hankel matrix."""

    R: Real
    mean: Real
    rows: int
    U: Real
    s: Real
    Vt: Real


Found = tuple[complex, Complex, tuple[float, float], Real]


def _mode(
    states: list[_State],
    diagram: Stabilisation,
    group: list[int],
    rate: float,
    scale: Real,
    moved: _Moved,
) -> Found:
    """Pole, shape and deviations of a cluster: those of the member nearest to its centre."""
    p = diagram.pole[group]
    centre = np.median(p.real) + 1j * np.median(p.imag)
    member = group[int(np.argmin(np.abs(p - centre)))]
    state = next(s for s in states if s.order == diagram.order[member])
    k = int(np.argmin(np.abs(_continuous(state.values, rate) - diagram.pole[member])))
    shape = state.shapes[k] * scale
    top = int(np.argmax(np.abs(shape)))
    std, shape_std = _deviations(state, k, rate, scale, top, moved)
    return complex(diagram.pole[member]), np.asarray(shape / shape[top]), std, shape_std


def _deviations(
    state: _State, k: int, rate: float, scale: Real, top: int, moved: _Moved
) -> tuple[tuple[float, float], Real]:
    """Deviations of frequency, damping, and the shape's entries, from the pieces' scatter to first
    order."""
    n, channels = state.order, len(scale)
    U, A = state.U, state.A
    up = np.linalg.pinv(U[:-channels])
    gram = np.linalg.inv(U[:-channels].T @ U[:-channels])
    rest = U[channels:] - U[:-channels] @ A
    value, right = state.values[k], state.right[:, k]
    shape = state.shapes[k] * scale
    others = np.arange(n) != k
    rates, shapes = [], []
    for piece in moved.R:
        dH = block_hankel(piece - moved.mean, moved.rows)
        dU = (dH @ moved.Vt[:n].T) / moved.s[:n]
        dU = dU - U @ (U.T @ dU)  # what turns U in its own space changes no pole
        dA = up @ (dU[channels:] - dU[:-channels] @ A) + gram @ (dU[:-channels].T @ rest)
        pushed = np.conj(state.left.T) @ (dA @ right)
        rates.append(pushed[k] / value * rate)
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = state.right[:, others] @ (pushed[others] / (value - state.values[others]))
        d = (dU[:channels] @ right + U[:channels] @ turn) * scale
        shapes.append((d - shape * d[top] / shape[top]) / shape[top])
    count = len(moved.R)
    norm = 1.0 / (count * (count - 1.0))
    pole = _continuous(np.array([value]), rate)[0]
    d = np.array(rates)
    size = abs(pole)
    df = (pole.real * d.real + pole.imag * d.imag) / size / (2.0 * np.pi)
    dz = -d.real / size + pole.real * (pole.real * d.real + pole.imag * d.imag) / size**3
    spread = np.sqrt(norm * np.sum(np.abs(np.array(shapes)) ** 2, axis=0))
    return (
        float(np.sqrt(norm * np.sum(df**2))),
        float(np.sqrt(norm * np.sum(dz**2))),
    ), np.asarray(spread)
