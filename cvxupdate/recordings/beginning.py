"""Records that begin in motion: whether one does, and its FRFs with the initial state left out.

Spectra of e^{-δt} y(t) are those of the force times H where the structure starts from rest; else
the free decay of its initial state is in them, and what ends the record is not. So the two are told
apart by whether a transient is needed there (`cvxupdate.recordings.local_rational`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.local_rational import (
    DEGREE,
    LocalModels,
    forced,
    half_width,
    local_rational,
)
from cvxupdate.recordings.measured import DECAY, MOTION, band_of, decaying_spectra
from cvxupdate.recordings.types import (
    Complex,
    FrequencyResponse,
    Origin,
    Real,
    Recording,
    TimeHistory,
)

SHARE = 0.1
"""Of the r.m.s. spectrum under the window, what an initial state must make to be taken for one: a
smaller one moves the fit by less than what models leave out anyway."""
NEEDED = 100.0
"""Times by which a transient must take away more squares per unknown than is left per degree of
freedom, in the median window. Of noise it is near 1; neighbouring resonances make it 10 to 30, and
so does the distortion of gaps, friction and cubic springs, a part of which a transient follows."""
LINEAR = 0.005
"""Of the motion, what force and initial state may leave if FRFs are to stand for the record: noise
of 5 % of the samples leaves that much in the lines of a band; laws that depend on the level leave
more, and are to be told from the record itself."""
ROUGH = 0.1
"""Of the power of the forces that a smooth function over a window must leave: under e^{-δt} noise
leaves 0.3, an impact at the beginning 1e-5."""
BEGUN = 10.0
"""Times the mean square of the first quarter of a period that a free decay may have later: a sine
that begins at zero has 2.8 times it, modes that cancel at first more."""
SAMPLES = 2**16
"""Samples from the beginning that are looked at."""
AT_REST, IN_MOTION = "at-rest", "in-motion"
USED = (
    "its frequency responses are used, with the initial state as a further unknown, and laws that "
    "depend on the level are not sought in it"
)


@dataclass(frozen=True)
class Beginning:
    """Of the spectra under the window: the part ``share`` that the initial state makes (0 to 1),
    how much it is ``needed`` (see `NEEDED`), and what is ``left`` with it."""

    share: float
    needed: float
    left: float

    @property
    def in_motion(self) -> bool:
        """Whether an initial state explains what force alone does not."""
        return self.share > SHARE and self.needed > NEEDED


def beginning_of(history: TimeHistory) -> Beginning | None:
    """What a record says of its initial state; None where it has no force or no motion, is no
    number somewhere, or has too few lines on which its forces act, or where these say the same as
    an initial state."""
    drives, senses = _columns(history)
    if not drives or not senses or not np.all(np.isfinite(history.data[:SAMPLES])):
        return None
    first = replace(history, data=history.data[:SAMPLES], band=band_of(history))
    s, spectra = decaying_spectra(first, band_of(first), every=True)
    U, Y = spectra[:, drives], spectra[:, senses]
    stride = half_width(len(drives))
    if len(s) < 4 * stride or _filled(U) < 4 * stride or _rough(U, stride) < ROUGH:
        return None
    found, Y = local_rational(U, Y, stride), Y[::stride]
    known = np.all(np.isfinite(found.H), axis=(1, 2)) & forced(U, stride)[::stride]
    if not np.any(known):
        return None
    power = np.abs(Y[known]) ** 2
    # a transient above the motion itself is that of a line on which the force says too little
    made = np.minimum(np.abs(found.transient[known]) ** 2, power)
    shares = np.sqrt(made.mean(axis=0) / power.mean(axis=0))
    loud = shares == shares.max()
    share = float(min(1.0, shares.max(), _most(first, senses)))
    return Beginning(share, _needed(found, known, loud), _left(found, Y, known))


def _most(history: TimeHistory, senses: Sequence[int]) -> float:
    """The part of the r.m.s. under the window that an initial state can make, of the channel where
    that is most: a free decay is there from the first sample on, and does not grow. Laws that
    depend on the level, and sweeps, may look like one in the lines of the spectrum."""
    y, rate, low = history.data[:, senses], history.rate, max(band_of(history)[0], 1e-9)
    squares = y**2
    quarter = min(len(y), max(2, round(0.25 * rate / low)))
    window = np.exp(-2.0 * DECAY * np.arange(len(y)) / len(y))[:, None]
    whole = np.sum(window * squares, axis=0)
    free = BEGUN * np.mean(squares[:quarter], axis=0) * float(np.sum(window))
    return float(np.sqrt(np.max(free / np.maximum(whole, np.finfo(float).tiny))))


def _filled(U: Complex) -> float:
    """How many lines the forces fill (the participation of lines in their power): a sine or a few
    of them say nothing of what lies between."""
    power = np.sum(np.abs(U) ** 2, axis=1)
    squares = float(np.sum(power**2))
    return float(np.sum(power)) ** 2 / squares if squares > 0.0 else 0.0


def _rough(U: Complex, half: int) -> float:
    """The part of the forces' power that is not smooth over a window. An impact at the beginning is
    smooth, and what it makes is a free decay: no recording tells it from an initial state."""
    window = 2 * half + 1
    count = len(U) // window
    pieces = np.moveaxis(U[: count * window].reshape(count, window, -1), 1, 0).reshape(window, -1)
    r = np.linspace(-1.0, 1.0, window)[:, None] ** np.arange(DEGREE + 1)
    Q = np.linalg.qr(r)[0]
    rest = pieces - Q @ (Q.T @ pieces)
    return float(np.sum(np.abs(rest) ** 2) / max(np.sum(np.abs(pieces) ** 2), 1e-300))


def _needed(found: LocalModels, known: Real, loud: Real) -> float:
    """Mean square per unknown that the transient takes away over that left, in the windows that do
    not overlap, of the channel that it fills most."""
    apart = np.flatnonzero(known)[::2]
    gone = (found.without - found.residual)[apart][:, loud] / 3.0
    left = np.maximum(found.residual[apart][:, loud] / found.left, np.finfo(float).tiny)
    return float(np.median(gone / left))


def _left(found: LocalModels, Y: Complex, known: Real) -> float:
    per_line = found.residual[known] / (2 * found.half + 1)
    return float(np.sqrt(np.sum(per_line) / np.sum(np.abs(Y[known]) ** 2)))


def settled(recording: Recording, begins: str | None) -> Recording:
    """A record that begins in motion as FRFs over its band, its initial state left out, and a
    remark that says so; every other recording as it is.

    ``begins``: "at-rest" and "in-motion" of the problem file; None: what the record says.

    Raises
    ------
    RecordingError
        When a record that is said to begin in motion is too short for FRFs, or without a force.
    """
    if not isinstance(recording, TimeHistory) or begins == AT_REST:
        return recording
    if begins == IN_MOTION:
        return _frf(recording, f"begins in motion, as the problem file says: {USED}")
    found = beginning_of(recording)
    if found is None or not found.in_motion:
        return recording
    why = f"begins in motion ({found.share:.0%} of its first part is its initial state)"
    if found.left < LINEAR:
        return _frf(recording, f"{why}: {USED}")
    remark = (
        f"{why}, but is taken as if it began at rest, because something beside force and initial "
        f'state is in it. With begins = "in-motion" {USED}'
    )
    return replace(recording, origin=_remarked(recording.origin, remark))


def _remarked(origin: Origin, remark: str) -> Origin:
    return replace(origin, remarks=(*origin.remarks, remark))


def _columns(history: TimeHistory) -> tuple[list[int], list[int]]:
    """Of the forces, and of the motions at DOFs."""
    kinds = list(enumerate(history.channels))
    drives = [i for i, c in kinds if c.quantity == "force" and c.dof]
    return drives, [i for i, c in kinds if c.quantity in MOTION and c.dof]


def _frf(history: TimeHistory, remark: str) -> FrequencyResponse:
    drives, senses = _columns(history)
    name = history.origin.name
    if not drives or not senses:
        raise RecordingError(
            f"{name}: it is said to begin in motion, but has no force or no motion at DOFs of the "
            'model. Declare its channels, or remove begins = "in-motion".'
        )
    low, high = band_of(history)
    f = np.fft.rfftfreq(len(history.data), 1.0 / history.rate)
    keep = (f >= low) & (f <= high) & (f > 0.0)
    spectra = np.fft.rfft(history.data, axis=0)[keep]
    try:
        found = local_rational(spectra[:, drives], spectra[:, senses])
    except RecordingError as error:
        raise RecordingError(f"{name}: it begins in motion: {error}") from error
    kinds = [history.channels[i].quantity for i in senses]
    quantity = max(dict.fromkeys(kinds), key=kinds.count)
    s = 2j * np.pi * f[keep]
    orders = [MOTION.index(quantity) - MOTION.index(k) for k in kinds]
    turned = np.stack([s**n for n in orders], axis=1)[:, :, None]
    known = np.all(np.isfinite(found.H), axis=(1, 2)) & forced(spectra[:, drives], found.half)
    return FrequencyResponse(
        _remarked(history.origin, remark),
        f[keep][known],
        (found.H * turned)[known],
        quantity,
        tuple(replace(history.channels[i], quantity=quantity) for i in senses),
        tuple(history.channels[i] for i in drives),
        (found.variance * np.abs(turned) ** 2)[known],
    )
