"""Levels of measured responses beside those of a model, band by band: what units are told by.

A unit that is wrong moves every response by one factor, or by one power of the frequency, or the
frequencies themselves; what a structure has and its model lacks moves resonances about. Logarithms
of magnitudes in bands of the logarithmic frequency, their median over a few lines of each band,
keep the first and forget most of the second. FRFs are held against the model a little off the
imaginary axis, so that no resonance decides a band; time histories as their spectra under e^{−δt},
which are exact for a record that starts from rest (`recordings.measured`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.frf import Complex
from cvxupdate.correlate.response_error import places
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis import responses
from cvxupdate.recordings.measured import Measured, measured_responses
from cvxupdate.recordings.types import FrequencyResponse, Recording, TimeHistory

BANDS, LINES = 20, 3
"""Bands of the logarithmic frequency, and lines that are looked at in each, at most."""
WIDE = 0.02
"""Damping that every resonance of the model is given: ε of s = ω (ε + i)."""
CHANNELS = 12
"""Responses that are looked at, at most: a unit is that of all."""
SHARP = 0.3
"""Deviation over modulus from which on a line is noise."""


@dataclass(frozen=True)
class Levels:
    """What was measured at ``points`` of one recording, a few in each ``band``: ``log`` (points,
    responses, cases) = ln|Y|, NaN where it is noise; ``damped`` says whether they lie off the
    imaginary axis already (a time history)."""

    name: str
    measured: Measured
    log: Real
    band: NDArray[np.int64]
    damped: bool

    @property
    def frequency(self) -> Real:
        """The points in Hz."""
        return np.asarray(self.measured.s.imag / (2.0 * np.pi))

    def medians(self, log: Real) -> Real:
        """(bands, responses × cases): medians over the points of each band, NaN where half of them
        are."""
        flat = log.reshape(len(log), -1)
        members, sizes = self._members
        stacked = np.where(members[:, :, None] >= 0, flat[members], np.nan)
        stacked = np.sort(np.where(np.isfinite(stacked), stacked, np.nan), axis=1)  # NaN come last
        count = np.count_nonzero(np.isfinite(stacked), axis=1)
        low, high = (np.maximum(count - 1, 0) // 2, count // 2)
        high = np.minimum(high, stacked.shape[1] - 1)
        ends = (np.take_along_axis(stacked, k[:, None], axis=1)[:, 0] for k in (low, high))
        return np.asarray(np.where(2 * count > sizes[:, None], np.mean([*ends], axis=0), np.nan))

    @cached_property
    def measured_medians(self) -> Real:
        """`medians` of what was measured."""
        return self.medians(self.log)

    @cached_property
    def _members(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Points of each band, (bands, most in any) with −1 where there are fewer; how many."""
        sizes = np.bincount(self.band)
        order = np.argsort(self.band, kind="stable")
        first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        at = np.arange(int(sizes.max()))
        inside = at < sizes[:, None]
        return np.where(inside, order[np.where(inside, first[:, None] + at, 0)], -1), sizes


def levels_of(recording: Recording, every: bool = False) -> tuple[Levels, ...]:
    """The levels of a recording, one for each quantity; none of a table of modes, or where nothing
    was driven. ``every``: of all responses, not of some of them."""
    if not isinstance(recording, FrequencyResponse | TimeHistory):
        return ()
    if isinstance(recording, TimeHistory) and not any(
        c.quantity == "force" and c.dof for c in recording.channels
    ):
        return ()
    most = None if every else CHANNELS
    found = (_levels(recording, m, most) for m in measured_responses(recording))
    return tuple(one for one in found if one is not None)


def _levels(
    recording: FrequencyResponse | TimeHistory, m: Measured, most: int | None
) -> Levels | None:
    f = m.s.imag / (2.0 * np.pi)
    sound = np.flatnonzero(np.all(np.isfinite(m.U), axis=(1, 2)) & (f > 0.0))
    if len(sound) < 8 or f[sound[-1]] < 1.2 * f[sound[0]]:
        return None
    count = int(np.clip(len(sound) // LINES, 2, BANDS))
    edges = np.geomspace(f[sound[0]], f[sound[-1]], count + 1)
    band = np.clip(np.searchsorted(edges, f[sound], side="right") - 1, 0, count - 1)
    keep, at = [], []
    for b in range(count):
        inside = sound[band == b]
        if len(inside):
            chosen = inside[np.unique(np.linspace(0, len(inside) - 1, LINES).astype(int))]
            keep.append(chosen)
            at.append(np.full(len(chosen), b))
    lines, bands = np.concatenate(keep), np.unique(np.concatenate(at), return_inverse=True)[1]
    Y = m.Y[lines][:, :most]
    variance = None if m.variance is None else m.variance[lines][:, :most]
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.log(np.abs(Y))
        noise = np.zeros(Y.shape, bool) if variance is None else variance > (SHARP * np.abs(Y)) ** 2
    thin = Measured(
        m.s[lines],
        Y,
        m.U[lines],
        m.quantity,
        m.responses[:most],
        m.references,
        variance,
    )
    log = np.where(np.isfinite(log) & ~noise, log, np.nan)
    name = recording.origin.name
    return Levels(name, thin, log, bands, isinstance(recording, TimeHistory))


def modelled(model: Model, levels: Levels, scale: float = 1.0) -> Complex | None:
    """The model's Y at the points, their frequencies multiplied by ``scale``; None where it has
    none. Modal damping is left out (it would fill C)."""
    m = levels.measured
    s: Complex = m.s * scale
    if not levels.damped:
        s = np.asarray(s.imag * (WIDE + 1j), dtype=np.complex128)
    try:
        H = responses(
            model,
            s,
            places(model, m.responses),
            places(model, m.references),
            m.quantity,
            way="direct",
        )
    except (ModelError, np.linalg.LinAlgError, RuntimeError):
        return None
    return np.asarray(H @ m.U, dtype=np.complex128)


def logs(Y: Complex) -> Real:
    """ln|Y|, NaN for zero."""
    with np.errstate(divide="ignore"):
        found = np.log(np.abs(Y))
    return np.asarray(np.where(np.isfinite(found), found, np.nan))


def shape_of(levels: Levels, own: Real) -> float:
    """How much shape the model's levels ``own`` (points, responses, cases) have: their median
    distance from one power law of the frequency, which any factor and any quantity could make."""
    m = levels.medians(own)
    x = np.array([np.log(levels.frequency[levels.band == b]).mean() for b in range(len(m))])
    X = np.broadcast_to(x[:, None], m.shape)
    good = np.isfinite(m)
    if np.count_nonzero(good) < 6:
        return 0.0
    basis = np.stack([np.ones(int(good.sum())), X[good]], axis=1)
    rest = m[good] - basis @ np.linalg.lstsq(basis, m[good], rcond=None)[0]
    return float(np.median(np.abs(rest)))


def distance(pairs: Sequence[Real]) -> float:
    """The median |difference of levels| over bands, channels and recordings, in nepers; infinite
    where there is none."""
    joined = np.concatenate([p.ravel() for p in pairs]) if pairs else np.zeros(0)
    joined = joined[np.isfinite(joined)]
    return float(np.median(np.abs(joined))) if joined.size >= 6 else float("inf")
