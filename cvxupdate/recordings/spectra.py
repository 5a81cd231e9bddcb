"""Averaged cross spectra of a stream of samples, in memory that depends on the block and not on the
record.

Conventions (Bendat & Piersol, *Random Data*, 4th ed., chapters 6 and 9): ``Sxx[j, k] = mean(X_j
conj(X_k))``, ``Syx[i, j] = mean(Y_i conj(X_j))``. All spectra are averages of windowed block
transforms, not scaled to a density: the scale cancels in every FRF and coherence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.disk_buffer import release
from cvxupdate.recordings.types import Complex, Real
from cvxupdate.recordings.windows import effective_averages, window

Progress = Callable[[int, int | None], None]
BATCH_BYTES = 32_000_000


@dataclass(frozen=True)
class Spectra:
    """Averaged cross spectra of references x and responses y.

    ``frequency`` (lines,) Hz; ``Sxx`` (lines, references, references); ``Syx`` (lines, responses,
    references); ``Syy`` (lines, responses, responses) when ``full``, else its real diagonal (lines,
    responses); ``averages`` the effective number of independent averages.
    """

    frequency: Real
    Sxx: Complex
    Syx: Complex
    Syy: Complex | Real
    averages: float

    @property
    def power(self) -> Real:
        """Auto spectra of the responses, (lines, responses)."""
        return np.asarray(
            np.real(np.einsum("fii->fi", self.Syy)) if self.Syy.ndim == 3 else np.real(self.Syy)
        )


def _batches(chunks: Iterable[Real], block: int, step: int, lead: int) -> Iterator[Real]:
    """Overlapping blocks, several at a time, (blocks, block, channels); at most one chunk and one
    batch are in memory."""
    pending: Real | None = None
    for chunk in chunks:
        data = np.asarray(chunk, dtype=np.float64)
        if pending is None:
            pending = np.zeros((lead, data.shape[1]))
        pending = np.concatenate([pending, data]) if pending.size else data
        count = (pending.shape[0] - block) // step + 1
        if count < 1:
            continue
        several = max(1, BATCH_BYTES // (8 * block * pending.shape[1]))
        for first in range(0, count, several):
            last = min(first + several, count)
            yield np.stack([pending[k * step : k * step + block] for k in range(first, last)])
        pending = pending[count * step :].copy()


def slices(data: Real, columns: Iterable[int], length: int) -> Iterator[Real]:
    """A long array in chunks of ``length`` samples, only the wanted columns; pages of a mapped file
    are given back after each."""
    wanted = list(columns)
    for start in range(0, data.shape[0], length):
        yield np.asarray(data[start : start + length, wanted], dtype=np.float64)
        release(data)


def spectra_from_chunks(
    chunks: Iterable[Real],
    rate: float,
    references: int,
    *,
    block: int,
    overlap: float = 0.5,
    taper: Real | None = None,
    detrend: bool = True,
    lead: int = 0,
    full: bool = False,
    total: int | None = None,
    progress: Progress | None = None,
) -> Spectra:
    """Cross spectra of a stream, in memory that depends on the block, not on the length of the
    record.

    Parameters
    ----------
    chunks : (samples, channels) in time order, the first ``references`` columns the references.
    rate : Hz. block : samples. overlap : fraction of a block in [0, 1). taper : (block,) window,
    Hann if
        None.
    detrend : remove the mean of each block. lead : zeros put before the record (from rest).
    full : keep the whole matrix Syy (needed by H2 with several references).
    total, progress : number of blocks to come and a callback ``progress(blocks done, total)``.

    Raises
    ------
    RecordingError
        When block or overlap make no sense, values are not finite, or the stream is shorter than a
        block.
    """
    if block < 4 or not 0.0 <= overlap < 1.0:
        raise RecordingError(
            f"block {block} samples with overlap {overlap} cannot be averaged; "
            "use at least 4 samples and an overlap in [0, 1)"
        )
    weights = window("hann", block) if taper is None else taper
    step = max(1, round(block * (1.0 - overlap)))
    done = 0
    sums: list[Complex | Real] | None = None
    for batch in _batches(chunks, block, step, lead):
        _finite(batch, done)
        terms = _products(batch, weights, references, detrend, full)
        sums = terms if sums is None else [a + b for a, b in zip(sums, terms, strict=True)]
        done += batch.shape[0]
        if progress is not None:
            progress(done, total)
    if sums is None:
        raise RecordingError(
            f"the time history is shorter than one block of {block} samples; use a shorter block"
        )
    return Spectra(
        frequency=np.asarray(np.arange(block // 2 + 1) * (rate / block), dtype=np.float64),
        Sxx=np.asarray(sums[0] / done, dtype=np.complex128),
        Syx=np.asarray(sums[1] / done, dtype=np.complex128),
        Syy=sums[2] / done,
        averages=effective_averages(weights, step, done),
    )


def _finite(batch: Real, done: int) -> None:
    if not np.all(np.isfinite(batch)):
        raise RecordingError(
            f"blocks {done + 1} to {done + batch.shape[0]} of the time history hold NaN or "
            "infinite samples; repair them or cut the record first (cvxupdate inspect shows them)"
        )


def _products(
    batch: Real, weights: Real, references: int, detrend: bool, full: bool
) -> list[Complex | Real]:
    """Sxx, Syx and Syy of some blocks (blocks, samples, channels), summed over the blocks."""
    if detrend:
        batch = batch - batch.mean(axis=1, keepdims=True)
    spectrum = np.fft.rfft(batch * weights[None, :, None], axis=1).transpose(1, 2, 0)
    x, y = spectrum[:, :references], spectrum[:, references:]
    xh = np.conj(x.transpose(0, 2, 1))
    syy = y @ np.conj(y.transpose(0, 2, 1)) if full else np.sum(np.abs(y) ** 2, axis=2)
    return [x @ xh, y @ xh, syy]
