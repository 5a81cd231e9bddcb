"""What is diagnosed: the recordings of responses at every level of smoothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.nominal.theory import GROUP, SHEAR
from cvxupdate.diagnose.responses.common import Common
from cvxupdate.diagnose.responses.moving import NOTHING, Carried
from cvxupdate.diagnose.responses.rest import beyond_band, force_noise, rest_noise, through
from cvxupdate.diagnose.responses.signals import Real, Signal, smoothed
from cvxupdate.diagnose.settings import LEVELS, RESPONSE_DISCREPANCY, UNSTATED_FRF
from cvxupdate.errors import RecordingError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.mains import Tone, tones, without
from cvxupdate.recordings.measured import DECAY, MOTION, Measured, band_of, measured_responses
from cvxupdate.recordings.types import Channel, FrequencyResponse, TimeHistory

# Times the noise that what remains of mains hum may be: it counts as noise there, but is one error
# on all lines, and where it is three standard deviations nothing else is heard.
HUMMING = 3.0
DIFFERENCED = 0.005  # of a channel's standard deviation, where they do not


@dataclass(frozen=True)
class Data:
    """Recordings at every level, and sharp ones for scoring; ``carried``: what of the model goes
    with the drive."""

    fit: tuple[FrequencyResponse | TimeHistory, ...]
    hold_out: tuple[FrequencyResponse | TimeHistory, ...]
    levels: tuple[tuple[Signal, ...], ...]
    sharp: tuple[Signal, ...]
    sharp_hold_out: tuple[Signal, ...]
    top: float
    bottom: float
    mesh: MeshError = NONE
    sheared: MeshError = NONE
    common: Common | None = None
    carried: Carried = NOTHING

    @cached_property
    def compared(self) -> tuple[Signal, ...]:
        """What is fitted, as it is compared from run to run: time histories of one length."""
        return tuple(s for r in of_one_length(self.fit) for s in signals_of(r))

    @property
    def mixed(self) -> bool:
        """Whether the kind of loss shows: lines of FRFs. A time history is of a structure that
        answers no force before it acts, and of such a one losses go with velocity."""
        return all(isinstance(r, FrequencyResponse) for r in self.fit)

    @cached_property
    def sensors(self) -> tuple[str, ...]:
        """Labels of the channels that were measured."""
        return tuple(dict.fromkeys(label for s in self.sharp for label in s.sensors))

    @cached_property
    def accelerometers(self) -> tuple[str, ...]:
        """Those that measure accelerations."""
        heavy = (s for s in (*self.sharp, *self.sharp_hold_out) if s.order == 2)
        return tuple(dict.fromkeys(label for s in heavy for label in s.sensors))

    @cached_property
    def driven(self) -> tuple[str, ...]:
        """Labels of the DOFs where a force was measured."""
        return tuple(dict.fromkeys(label for s in self.sharp for label in s.inputs))

    @cached_property
    def forces(self) -> tuple[str, ...]:
        """Those that act by themselves wherever they act."""
        return _by_themselves(self.sharp)

    @cached_property
    def later(self) -> tuple[str, ...]:
        """Such forces that are held out only."""
        return tuple(x for x in _by_themselves(self.sharp_hold_out) if x not in self.driven)

    @cached_property
    def apart(self) -> bool:
        """Whether of several drives each recording that is fitted has one alone: what a shaker
        brings may have gone from one to the other."""
        return len(self.driven) > 1 and all(len(s.inputs) == 1 for s in self.sharp)

    def mesh_of(self, model: Model) -> MeshError:
        """The mesh error of a hypothesis: where it lets beams deform in shear, that of beams which
        do. As a part of the theory, shear makes as little of it as of the frequencies."""
        return (
            self.sheared
            if self.sheared is not NONE
            and any(q.of == SHEAR and q.group != GROUP for q in model.parameters)
            else self.mesh
        )

    def shift_of(self, model: Model) -> MeshError:
        """By which frequencies of a hypothesis are moved: the mesh's error, and what a reference
        state says of each mode."""
        mesh = self.mesh_of(model)
        return mesh if self.common is None or mesh is self.sheared else self.common.shift


def _by_themselves(signals: Sequence[Signal]) -> tuple[str, ...]:
    mixed = {label for s in signals if not s.plain for label in s.inputs}
    driven = dict.fromkeys(label for s in signals for label in s.inputs)
    return tuple(label for label in driven if label not in mixed)


def prepare(
    recordings: Sequence[FrequencyResponse | TimeHistory], common: Common | None = None
) -> Data:
    """Transform every recording once; ``common``: what a reference state says of the model.

    Raises
    ------
    RecordingError
        When none of those to fit has a response to a force.
    """
    fit_ = tuple(r for r in recordings if r.origin.use == "fit")
    hold = tuple(r for r in recordings if r.origin.use != "fit")
    sharp, held = (tuple(s for r in part for s in signals_of(r)) for part in (fit_, hold))
    if not sharp:
        names = ", ".join(r.origin.name for r in fit_)
        raise RecordingError(
            f"{names}: no recording to fit has a force and a motion at DOFs of the model. Declare "
            "their channels."
        )
    if common is not None:
        sharp, held = (tuple(common.weighed(s) for s in part) for part in (sharp, held))
    levels = tuple(tuple(smoothed(x, e) for x in sharp) for e in LEVELS)
    bands = [band_of(r) for r in fit_]
    top, bottom = max(b[1] for b in bands), min(b[0] for b in bands)
    return Data(fit_, hold, levels, sharp, held, top, bottom, common=common)


def of_one_length(
    recordings: Sequence[FrequencyResponse | TimeHistory],
) -> tuple[FrequencyResponse | TimeHistory, ...]:
    """Time histories cut to the shortest of them, so that they lie on the same points s: a record
    from rest is one from its beginning on, however early it ends."""
    lengths = [len(r.data) / r.rate for r in recordings if isinstance(r, TimeHistory)]
    least = min(lengths, default=0.0)
    return tuple(
        replace(r, data=r.data[: max(1, round(least * r.rate))])
        if isinstance(r, TimeHistory)
        else r
        for r in recordings
    )


def signals_of(recording: FrequencyResponse | TimeHistory) -> list[Signal]:
    """A recording on its own lines, a signal for each quantity of motion."""
    origin = recording.origin
    hum = tones(recording) if isinstance(recording, TimeHistory) else ()
    if isinstance(recording, TimeHistory):
        recording = without(recording, hum)
    out = []
    for m in measured_responses(recording):
        keep = np.all(np.isfinite(m.Y), axis=(1, 2))
        if isinstance(recording, FrequencyResponse):
            std = _frf_noise(m)
        else:
            unsure = _unsure(recording, m, hum)
            noise = _noise(recording, m)
            std = np.hypot(noise, unsure)
            known = HUMMING * noise + RESPONSE_DISCREPANCY * np.abs(m.Y)
            lost = np.any(unsure > known, axis=(1, 2))
            keep &= ~lost
        out.append(
            Signal(
                origin.name,
                origin.use,
                origin.level,
                m.s[keep],
                None,
                m.Y[keep],
                m.U[keep],
                std[keep],
                MOTION.index(m.quantity),
                tuple(c.label for c in m.responses),
                tuple(c.label for c in m.references),
            )
        )
    return out


def _unsure(history: TimeHistory, m: Measured, hum: Sequence[Tone]) -> Real:
    """Deviations of spectra of e^{−δt} y by the mains hum that was taken out."""
    out = np.zeros(m.Y.shape)
    for i, c in enumerate(m.responses):
        own = [t for t in hum if history.channels[t.channel] == c]
        out[:, i, 0] = np.sqrt(sum((t.unsure(m.s) ** 2 for t in own), np.zeros(len(m.s))))
    return out


def _frf_noise(m: Measured) -> Real:
    """Standard deviations; variances that were not recorded are taken from those that were."""
    power = np.nanmean(np.abs(m.Y) ** 2, axis=0, keepdims=True)
    variance = np.full(m.Y.shape, np.nan) if m.variance is None else m.variance
    known = np.isfinite(variance)
    relative = (variance / np.maximum(power, np.finfo(float).tiny))[known]
    typical = float(np.median(relative)) if len(relative) else UNSTATED_FRF**2
    out = np.where(known, variance, np.nan)
    for i, k in np.ndindex(*m.Y.shape[1:]):
        own = out[:, i, k][known[:, i, k]]
        out[:, i, k][~known[:, i, k]] = np.median(own) if len(own) else typical * power[0, i, k]
    return np.sqrt(out)


def _noise(history: TimeHistory, m: Measured) -> Real:
    """Standard deviations of spectra of e^{−δt} y: the noise of each channel per sample is its
    spectrum above the band that the force reached, else what differencing leaves; no more than
    what it says at rest; and what that of the forces makes of it."""
    labels = [(c.label, c.quantity) for c in history.channels]

    def of(channels: Sequence[Channel]) -> Real:
        return history.data[:, [labels.index((c.label, c.quantity)) for c in channels]]

    own, rate, top = of(m.responses), history.rate, band_of(history)[1]
    noise = beyond_band(own, rate, top)
    noise = np.where(np.isfinite(noise), noise, DIFFERENCED * np.std(own, axis=0))
    forces = history.data[:, [k for k, c in enumerate(history.channels) if c.quantity == "force"]]
    noise = np.minimum(noise, rest_noise(own, forces))
    decay = decayed(len(own), rate)
    driven = through(force_noise(of(m.references)) * decay, m.Y, m.U)
    return np.hypot((noise * decay)[None, :, None], driven)


def decayed(samples: int, rate: float) -> float:
    """Deviation of a line of the transform of e^{−δt} times white noise of deviation one a
    sample."""
    return float(np.linalg.norm(np.exp(-DECAY * np.arange(samples) / samples)) / rate)
