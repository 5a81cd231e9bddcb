"""From time histories to FRFs with their variance: H1, H2, Hv, block by block, for any number of
references."""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.channels import split_channels
from cvxupdate.recordings.estimators import ESTIMATORS, frf_variance, multiple_coherence, usable
from cvxupdate.recordings.local_polynomial import local_polynomial
from cvxupdate.recordings.spectra import BATCH_BYTES, Progress, Spectra, slices, spectra_from_chunks
from cvxupdate.recordings.types import (
    MOTIONS,
    Channel,
    FrequencyResponse,
    Origin,
    TimeHistory,
)
from cvxupdate.recordings.windows import exponential_window, find_impacts, force_window, window

LONGEST = 2**18
"""Samples of a time history up to which its FRFs are estimated without leakage (lpm); longer ones
are averaged (H1), which costs less."""


def default_block(samples: int) -> int:
    """About sixteen half-overlapped blocks, a power of two, at least 64 samples."""
    return int(2 ** max(6, int(np.floor(np.log2(max(samples / 8.0, 64.0))))))


def _frf(
    spectra: Spectra,
    method: str,
    origin: Origin,
    channels: tuple[Channel, ...],
    columns: tuple[list[int], list[int], str],
    skip_dc: bool,
) -> FrequencyResponse:
    if method not in ESTIMATORS:
        raise RecordingError(
            f"unknown FRF method {method!r}; choose one of {', '.join(ESTIMATORS)}, or lpm"
        )
    keep = usable(spectra.Sxx)
    if skip_dc:
        keep[0] = False
    if not np.any(keep):
        raise RecordingError(
            "the references are copies of one another (or silent) at every line: their FRFs "
            "cannot be separated; use one reference, or uncorrelated forces"
        )
    part = Spectra(
        spectra.frequency[keep],
        spectra.Sxx[keep],
        spectra.Syx[keep],
        spectra.Syy[keep],
        spectra.averages,
    )
    inputs, outputs, quantity = columns
    return FrequencyResponse(
        origin=origin,
        frequency=part.frequency,
        H=ESTIMATORS[method](part),
        quantity=quantity,
        responses=tuple(channels[k] for k in outputs),
        references=tuple(channels[k] for k in inputs),
        variance=frf_variance(part) if part.averages - len(inputs) > 0.5 else None,
        coherence=multiple_coherence(part),
    )


def spectra_from_time(
    history: TimeHistory,
    *,
    window_name: str = "hann",
    block: int | None = None,
    overlap: float = 0.5,
    decay: float = 0.0,
    from_rest: bool = False,
    columns: tuple[list[int], list[int]] | None = None,
    full: bool = False,
    progress: Progress | None = None,
) -> Spectra:
    """`Spectra` of a recording; see `frf_from_time` for the arguments. ``columns``: references and
    responses."""
    inputs, outputs = columns if columns is not None else split_channels(history.channels)[:2]
    samples = history.data.shape[0]
    length = default_block(samples) if block is None else block
    if length > samples:
        raise RecordingError(
            f"{history.origin.name}: block of {length} samples, but the record has {samples}; "
            "use a shorter block"
        )
    step = max(1, round(length * (1.0 - overlap))) if 0.0 <= overlap < 1.0 else 1
    lead = length - step if from_rest else 0
    taper = window(window_name, length) * exponential_window(length, history.rate, decay)
    chunk = max(length, BATCH_BYTES // (8 * len(history.channels)))
    return spectra_from_chunks(
        slices(history.data, [*inputs, *outputs], chunk),
        history.rate,
        len(inputs),
        block=length,
        overlap=overlap,
        taper=taper,
        detrend=not from_rest and decay == 0.0,
        lead=lead,
        full=full,
        total=(samples + lead - length) // step + 1,
        progress=progress,
    )


def main_motion(history: TimeHistory) -> str | None:
    """The quantity of most channels that read a motion; None where none does."""
    kinds = [c.quantity for c in history.channels if c.quantity in MOTIONS]
    return max(dict.fromkeys(kinds), key=kinds.count) if kinds else None


def usual_method(history: TimeHistory) -> str:
    """How FRFs are estimated from a record if nobody says how: without leakage, or averaged where
    it is so long that this costs too much."""
    return "lpm" if len(history.data) <= LONGEST else "h1"


def frf_from_time(
    history: TimeHistory,
    *,
    method: str = "h1",
    window: str = "hann",
    block: int | None = None,
    overlap: float = 0.5,
    quantity: str | None = None,
    references: tuple[int, ...] | None = None,
    decay: float = 0.0,
    from_rest: bool = False,
    progress: Progress | None = None,
) -> FrequencyResponse:
    """FRFs of a continuous recording, with multiple coherence and the variance of every entry.

    Parameters
    ----------
    method : ``"h1"``, ``"h2"``, ``"hv"`` (block averages), or ``"lpm"`` (`local_polynomial`: the
        whole record at once, leakage and the start from rest removed; the best choice for a single
        run of a lightly damped structure).
    window : name for `windows.window`. block : samples, default about sixteen half-overlapped ones.
    overlap : fraction of a block in [0, 1).
    quantity : of the response channels (displacement, velocity, acceleration); default: the only
        one there is. references : columns of the references; default: all force channels, solved
        for together.
    decay : 1/s, an exponential window on all channels of each block. It is exact only where the
        structure is at rest before each block; give ``identify_modes(added_decay=...)`` the same
        number to remove it.
    from_rest : zeros are put before the record so that its first samples get full weight.
    progress : callback ``progress(blocks done, blocks in all)``; ``history.data`` may be a memory
        map of any length.

    Lines at which a reference has no power (and 0 Hz, where the mean was taken away) are left out.

    Raises
    ------
    RecordingError
        When references or responses are missing, dependent or not finite, or the record is shorter
        than a block.
    """
    columns = split_channels(history.channels, quantity, references)
    if method == "lpm":
        return local_polynomial(history, quantity=quantity, references=references)
    full = method == "h2" and len(columns[0]) > 1
    spectra = spectra_from_time(
        history,
        window_name=window,
        block=block,
        overlap=overlap,
        decay=decay,
        from_rest=from_rest,
        columns=columns[:2],
        full=full,
        progress=progress,
    )
    return _frf(
        spectra, method, history.origin, history.channels, columns, not from_rest and decay == 0.0
    )


def frf_from_impacts(
    history: TimeHistory,
    *,
    block: int,
    method: str = "h1",
    pretrigger: int = 0,
    threshold: float = 0.2,
    force_width: float | None = None,
    decay: float = 0.0,
    quantity: str | None = None,
) -> FrequencyResponse:
    """FRFs of an impact test with one hammer channel and any number of hits.

    ``force_width`` (s, from the start of the block) limits the force to its pulse; ``decay`` (1/s)
    multiplies force and responses by ``exp(-decay t)``: give it to
    ``identify_modes(added_decay=...)`` to have the added damping taken out. No detrending and no
    Hann window: the structure is at rest before each hit. With one hit the variance is None.

    Raises
    ------
    RecordingError
        When there is not exactly one force channel, or no complete hit.
    """
    inputs, outputs, kind = split_channels(history.channels, quantity)
    if len(inputs) != 1:
        raise RecordingError(
            f"an impact test has one force channel, this recording has {len(inputs)}; "
            "use frf_from_time"
        )
    force = np.asarray(history.data[:, inputs[0]], dtype=np.float64)
    starts = find_impacts(force, block=block, pretrigger=pretrigger, threshold=threshold)
    columns = [*inputs, *outputs]
    blocks = np.stack(
        [np.asarray(history.data[s : s + block][:, columns], dtype=np.float64) for s in starts]
    )
    if force_width is not None:
        blocks[:, :, 0] *= force_window(
            block, history.rate, force_width + pretrigger / history.rate
        )
    spectra = spectra_from_chunks(
        iter(blocks),
        history.rate,
        1,
        block=block,
        overlap=0.0,
        taper=exponential_window(block, history.rate, decay),
        detrend=False,
        full=False,
    )
    return _frf(spectra, method, history.origin, history.channels, (inputs, outputs, kind), False)


def transmissibility(history: TimeHistory, reference: int, **options: object) -> FrequencyResponse:
    """Responses per response: channel ``reference`` (a column) takes the place of the force;
    options as `frf_from_time`.

    Poles of a transmissibility are not those of the structure; `identify_modes` must not be used on
    it.
    """
    return frf_from_time(history, references=(reference,), **options)  # type: ignore[arg-type]
