"""FRFs of one record of any excitation, without leakage: the local polynomial method.

R. Pintelon, J. Schoukens, G. Vandersteen, K. Barbé, Mech. Syst. Signal Process. 24 (2010) 573 and
596; Pintelon & Schoukens, *System Identification*, 2nd ed. (2012), chapter 7.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.channels import split_channels
from cvxupdate.recordings.types import Complex, FrequencyResponse, Real, TimeHistory

_BATCH_LINES = 2048


def _local_fit(U: Complex, Y: Complex, order: int, half: int) -> tuple[Complex, Real, Real]:
    """H (lines, outputs, inputs), its variance, and the multiple coherence (lines, outputs) from
    full-record spectra.

    Around each line the FRF and the transient are polynomials of degree ``order`` in the line
    number, fitted to ``2 half + 1`` lines; the transient takes up the leakage: the state at the
    start minus the state at the end.
    """
    lines, inputs = U.shape
    offsets = np.arange(-half, half + 1)
    centre = np.arange(lines)
    # at the ends of the band the window is shifted inward; r is measured from the line that is
    # estimated
    index = np.clip(centre, half, lines - 1 - half)[:, None] + offsets[None, :]
    r = (index - centre[:, None]) / half
    powers = r[:, :, None] ** np.arange(order + 1)
    u, y = U[index], Y[index]
    K = np.concatenate(
        [
            (powers[:, :, :, None] * u[:, :, None, :]).reshape(lines, 2 * half + 1, -1),
            powers.astype(np.complex128),
        ],
        axis=2,
    )
    scale = np.linalg.norm(K, axis=1, keepdims=True)
    scale = np.where(scale > 0.0, scale, 1.0)
    Q, R = np.linalg.qr(K / scale)
    diagonal = np.abs(np.einsum("fii->fi", R))
    singular = diagonal.min(axis=1) < 1e-9 * diagonal.max(axis=1)
    R = np.where(singular[:, None, None], np.eye(R.shape[1]), R)
    inverse = np.linalg.inv(R)
    projected = np.conj(Q.transpose(0, 2, 1)) @ y
    theta = (inverse @ projected) / scale.transpose(0, 2, 1)
    residual = np.sum(np.abs(y - Q @ projected) ** 2, axis=1)
    noise = residual / (2 * half + 1 - K.shape[2])
    spread = np.sum(np.abs(inverse[:, :inputs]) ** 2, axis=2) / scale[:, 0, :inputs] ** 2
    H = theta[:, :inputs].transpose(0, 2, 1)
    variance = noise[:, :, None] * spread[:, None, :]
    total = np.sum(np.abs(y) ** 2, axis=1)
    coherence = np.clip(1.0 - residual / np.where(total > 0.0, total, np.inf), 0.0, 1.0)
    H[singular] = np.nan
    return H, variance, coherence


def local_polynomial(
    history: TimeHistory,
    *,
    order: int = 2,
    freedom: int = 8,
    quantity: str | None = None,
    references: tuple[int, ...] | None = None,
    band: tuple[float, float] | None = None,
) -> FrequencyResponse:
    """FRFs at the full resolution 1/T of one record, leakage and starting transient removed, with
    variance.

    Parameters
    ----------
    order : degree of the local polynomials. freedom : residual degrees of freedom of each local
    fit: the window holds
        ``(order + 1)(references + 1) + freedom`` lines.
    quantity, references : as for `frf_from_time`. band : (lowest, highest) Hz.

    Assumes that the FRF is smooth over the window: the half-power bandwidth of every mode should be
    wider than it, i.e. a record of some ``(order + 1)(references + 1) + freedom`` times ``1 / (2
    zeta f)``; else the error appears in the variance. Neighbouring lines share data and are
    correlated over about one window. ``coherence`` is the multiple coherence of the local fit
    (transient included).

    Raises
    ------
    RecordingError
        When samples are not finite, the record is too short, or the references are dependent at
        every line.
    """
    inputs, outputs, kind = split_channels(history.channels, quantity, references)
    data = np.asarray(history.data, dtype=np.float64)
    if not np.all(np.isfinite(data[:, [*inputs, *outputs]])):
        raise RecordingError(
            f"{history.origin.name}: NaN or infinite samples; repair them or cut the record first"
        )
    samples = data.shape[0]
    half = max(1, -(-((order + 1) * (len(inputs) + 1) + freedom - 1) // 2))
    frequency = np.arange(samples // 2 + 1) * history.rate / samples
    first, last = _ends(frequency, band, half, history)
    U = np.fft.rfft(data[:, inputs], axis=0)[first:last]
    Y = np.fft.rfft(data[:, outputs], axis=0)[first:last]
    H, variance, coherence = _in_batches(U, Y, order, half)
    power = np.abs(U) ** 2
    keep = np.all(np.isfinite(H), axis=(1, 2)) & np.all(power > 1e-14 * power.max(axis=0), axis=1)
    if not np.any(keep):
        raise RecordingError(
            f"{history.origin.name}: the references are zero or copies of one another at every line"
        )
    return FrequencyResponse(
        origin=history.origin,
        frequency=frequency[first:last][keep],
        H=H[keep],
        quantity=kind,
        responses=tuple(history.channels[k] for k in outputs),
        references=tuple(history.channels[k] for k in inputs),
        variance=variance[keep],
        coherence=coherence[keep],
    )


def _ends(
    frequency: Real, band: tuple[float, float] | None, half: int, history: TimeHistory
) -> tuple[int, int]:
    """The first line of the band (never 0 Hz) and that behind its last."""
    low, high = band if band is not None else (0.0, history.rate / 2.0)
    inside = np.flatnonzero((frequency >= low) & (frequency <= high) & (frequency > 0.0))
    if inside.size <= 2 * half + 1:
        raise RecordingError(
            f"{history.origin.name}: {inside.size} lines in the band are too few for a local "
            f"fit over {2 * half + 1}; record longer, widen the band, or use h1"
        )
    return int(inside[0]), int(inside[-1]) + 1


def _in_batches(U: Complex, Y: Complex, order: int, half: int) -> tuple[Complex, Real, Real]:
    """`_local_fit` of many lines, in memory that does not grow with their number."""
    lines = len(U)
    H = np.empty((lines, Y.shape[1], U.shape[1]), dtype=np.complex128)
    variance = np.empty(H.shape)
    coherence = np.empty(H.shape[:2])
    for start in range(0, lines, _BATCH_LINES):
        stop = min(start + _BATCH_LINES, lines)
        # each batch carries its neighbours along so that no line inside the band sees a shifted
        # window
        low, high = max(0, start - half), min(lines, stop + half)
        if high - low < 2 * half + 1:
            low = high - (2 * half + 1)
        part = _local_fit(U[low:high], Y[low:high], order, half)
        here = slice(start - low, stop - low)
        H[start:stop], variance[start:stop], coherence[start:stop] = (p[here] for p in part)
    return H, variance, coherence
