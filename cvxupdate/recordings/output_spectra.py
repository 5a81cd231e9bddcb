"""Cross spectral densities of responses whose excitation was not recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.spectra import Progress
from cvxupdate.recordings.spectral import default_block, spectra_from_time
from cvxupdate.recordings.types import Channel, Complex, Real, TimeHistory
from cvxupdate.recordings.windows import window


@dataclass(frozen=True)
class OutputSpectra:
    """Cross power spectral densities of the responses alone.

    ``frequency`` (lines,) Hz; ``density`` (lines, channels, channels), one-sided, unit²/Hz,
    Hermitian and positive semi-definite; ``averages`` effective number; ``channels`` their labels.
    """

    frequency: Real
    density: Complex
    channels: tuple[Channel, ...]
    averages: float

    def variance(self) -> Real:
        """Variance of every entry, ``S_ii S_jj / averages`` (Bendat & Piersol 9.1), (lines,
        channels, channels)."""
        power = np.real(np.einsum("fii->fi", self.density))
        return np.asarray(power[:, :, None] * power[:, None, :] / self.averages)

    def singular_values(self) -> Real:
        """Singular values at each line (complex mode indicator, FDD), (lines, channels), largest
        first."""
        return np.asarray(np.linalg.svd(self.density, compute_uv=False))


def output_spectra(
    history: TimeHistory,
    *,
    window_name: str = "hann",
    block: int | None = None,
    overlap: float = 0.5,
    quantity: str | None = None,
    progress: Progress | None = None,
) -> OutputSpectra:
    """Cross spectral densities where no force was recorded (Welch's method), one-sided, in
    unit²/Hz.

    Raises
    ------
    RecordingError
        When there is no response channel, or the record is shorter than a block.
    """
    kinds = [
        k
        for k, c in enumerate(history.channels)
        if c.quantity != "force" and (quantity is None or c.quantity == quantity)
    ]
    if not kinds:
        raise RecordingError(
            f"no response channel of quantity {quantity or 'any motion'!r} in the time history"
        )
    length = default_block(history.data.shape[0]) if block is None else block
    spectra = spectra_from_time(
        history,
        window_name=window_name,
        block=length,
        overlap=overlap,
        columns=([], kinds),
        full=True,
        progress=progress,
    )
    scale = 2.0 / (history.rate * float(np.sum(window(window_name, length) ** 2)))
    density = np.asarray(spectra.Syy * scale, dtype=np.complex128)
    density[0] *= 0.5
    if length % 2 == 0:
        density[-1] *= 0.5
    return OutputSpectra(
        spectra.frequency, density, tuple(history.channels[k] for k in kinds), spectra.averages
    )
