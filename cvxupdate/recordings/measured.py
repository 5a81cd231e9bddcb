"""What a recording says of responses, whatever its kind: Y(s) = sᵒ H(s) U(s) on points s of the
right half-plane, over one band.

FRFs lie on s = iω with unit forces. Of a time history that starts from rest these are the spectra
of e^{−δt} y(t), exact for zero initial conditions: no window, no averages, no leakage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.instant import sets_in, transformed
from cvxupdate.recordings.types import Channel, Complex, FrequencyResponse, Real, TimeHistory

MOTION = ("displacement", "velocity", "acceleration")
DECAY = 7.0
"""δ T: what is cut off at the end of a record weighs e⁻⁷."""
MOST_LINES = 4000
"""Lines of a time history at most; of more, evenly chosen ones."""


@dataclass(frozen=True)
class Measured:
    """Responses of one quantity in one recording: ``s`` (points,) in rad/s, ``Y`` (points,
    responses, cases), ``U`` (points, references, cases), ``responses`` and ``references`` their
    channels; ``variance`` like ``Y`` where the recording states one."""

    s: Complex
    Y: Complex
    U: Complex
    quantity: str
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    variance: Real | None = None


def band_of(recording: FrequencyResponse | TimeHistory) -> tuple[float, float]:
    """The fitted band (Hz), the same for every command: the recording's own ``band`` where its
    table gives one; else all lines of FRFs above 0 Hz, or of a time history what its excitation
    reached (`excited_band`)."""
    if isinstance(recording, FrequencyResponse):
        positive = recording.frequency[recording.frequency > 0]
        return float(positive[0]), float(positive[-1])
    return excited_band(recording) if recording.band is None else recording.band


def excited_band(history: TimeHistory) -> tuple[float, float]:
    """The band (Hz) that the excitation reached: where the force's spectrum is above a tenth of its
    typical value, and a record holds eight periods."""
    drives = [i for i, c in enumerate(history.channels) if c.quantity == "force"]
    n = len(history.data)
    f = np.fft.rfftfreq(n, 1.0 / history.rate)
    force = history.data[:, drives] / (np.abs(history.data[:, drives]).max(initial=0.0) or 1.0)
    spectrum = np.sqrt(np.sum(np.abs(np.fft.rfft(force, axis=0)) ** 2, axis=1))
    lines = min(max(5, n // 200), len(spectrum))
    smooth = np.sqrt(np.convolve(spectrum**2, np.ones(lines) / lines, mode="same"))
    loud = np.flatnonzero(smooth > 0.1 * np.percentile(smooth, 90))
    top = min(f[loud[-1]], 0.45 * history.rate) if len(loud) else 0.4 * history.rate
    low = max(float(f[loud[0]]) if len(loud) else 0.0, 8.0 * history.rate / n)
    return low, float(0.98 * top)


def measured_responses(recording: FrequencyResponse | TimeHistory) -> tuple[Measured, ...]:
    """The responses of a recording to forces, in the recorded quantity: of FRFs one, of a time
    history one for each quantity of motion; none where no force or no motion was recorded.

    Channels that are no motion and references that are no force have no counterpart in a model and
    are left out.
    """
    if isinstance(recording, FrequencyResponse):
        found = _of_frf(recording)
        return () if found is None else (found,)
    return _of_time(recording)


def _of_frf(frf: FrequencyResponse) -> Measured | None:
    outputs = [
        k
        for k, c in enumerate(frf.responses)
        if c.dof and c.quantity not in ("force", "strain", "voltage")
    ]
    inputs = [k for k, c in enumerate(frf.references) if c.dof and c.quantity == "force"]
    if frf.quantity not in MOTION or not outputs or not inputs or not np.any(frf.frequency > 0.0):
        return None
    low, high = band_of(frf)
    keep = (frf.frequency >= low) & (frf.frequency <= high)
    f, r = frf.frequency[keep], len(inputs)
    return Measured(
        np.asarray(2j * np.pi * f, dtype=np.complex128),
        frf.H[keep][:, outputs][:, :, inputs],
        np.broadcast_to(np.eye(r, dtype=complex), (len(f), r, r)),
        frf.quantity,
        tuple(frf.responses[k] for k in outputs),
        tuple(frf.references[k] for k in inputs),
        None if frf.variance is None else frf.variance[keep][:, outputs][:, :, inputs],
    )


def _of_time(history: TimeHistory) -> tuple[Measured, ...]:
    channels = history.channels
    drives = [i for i, c in enumerate(channels) if c.quantity == "force" and c.dof]
    senses = [
        [i for i, c in enumerate(channels) if c.quantity == quantity and c.dof]
        for quantity in MOTION
    ]
    if not drives or not any(senses):
        return ()
    s, spectra = decaying_spectra(history, band_of(history))
    if not len(s):
        return ()
    return tuple(
        Measured(
            s,
            spectra[:, own][:, :, None],
            spectra[:, drives][:, :, None],
            quantity,
            tuple(channels[i] for i in own),
            tuple(channels[i] for i in drives),
        )
        for quantity, own in zip(MOTION, senses, strict=True)
        if own
    )


def decaying_spectra(
    history: TimeHistory, band: tuple[float, float], every: bool = False
) -> tuple[Complex, Complex]:
    """(s (lines,), spectra (lines, channels)) of e^{−δt} times the samples, δ = 7 / T, on the lines
    k / T in ``band`` (Hz): `MOST_LINES` at most; or ``every`` one, of samples that go on from what
    was before them and so do not set in."""
    n, rate = len(history.data), history.rate
    f = np.fft.rfftfreq(n, 1.0 / rate)
    lines = np.flatnonzero((f >= band[0]) & (f <= band[1]))
    # multiples of the stride, so that records of one length have their lines in common
    if not every:
        lines = lines[lines % max(1, int(np.ceil(len(lines) / MOST_LINES))) == 0]
    drives = [i for i, c in enumerate(history.channels) if c.quantity == "force"]
    begins = not every and sets_in(history.data[:, drives])
    return transformed(history.data, rate, DECAY, lines, begins)
