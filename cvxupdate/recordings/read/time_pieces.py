"""A time history that stays on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.read.contents import AnyArray
from cvxupdate.recordings.read.disk_buffer import release
from cvxupdate.recordings.types import Channel, Origin, Real


@dataclass(frozen=True)
class TimeBlocks:
    """A time history that stays on disk: ``pieces(n)`` yields (≤ n, channels) in SI, in order, each
    sample once."""

    origin: Origin
    rate: float
    channels: tuple[Channel, ...]
    samples: int
    pieces: Callable[[int], Iterator[Real]]


def pieces_of(
    columns: Sequence[AnyArray], channels: Sequence[Channel]
) -> Callable[[int], Iterator[Real]]:
    """`TimeBlocks.pieces` of equally long columns, each scaled to SI; mapped pages are released
    after every piece."""
    scales = np.array([channel.scale for channel in channels])

    def pieces(size: int) -> Iterator[Real]:
        for at in range(0, columns[0].shape[0], size):
            piece = [np.asarray(np.real(c[at : at + size]), dtype=float) for c in columns]
            with np.errstate(invalid="ignore"):  # a damaged file's nan may signal; it is said later
                scaled = np.stack(piece, axis=1) * scales
            yield scaled
            release(*columns)

    return pieces
