"""FRFs without what is damaged: dead channels, channels and lines that are not numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.frf_parts import FrfParts
from cvxupdate.recordings.types import Real


def whole(parts: FrfParts, variance: Real | None) -> tuple[FrfParts, Real | None, tuple[str, ...]]:
    """The FRFs and their ``variance`` without the responses that are dead (0 throughout) or
    of which most lines are not numbers, and then without the lines that are not numbers in any of
    the others; and a sentence on each.

    Raises
    ------
    RecordingError
        Where fewer than two lines, or no response, would be left.
    """
    missing = ~np.isfinite(parts.H)
    dead = np.all(parts.H == 0.0, axis=(0, 2))
    lost = np.mean(np.any(missing, axis=2), axis=0) > 0.5
    keep = ~(dead | lost)
    lines = np.isfinite(parts.axis) & ~np.any(missing[:, keep], axis=(1, 2))
    if not np.any(keep) or np.count_nonzero(lines) < 2:
        raise RecordingError("nothing of its FRFs is left without what is damaged.")
    said = [
        f"channel {c.label} {'does not move' if d else 'is mostly no numbers'}: it was left out"
        for c, d, k in zip(parts.responses, dead, keep, strict=True)
        if not k
    ]
    gone = np.flatnonzero(~lines)
    if gone.size:
        at = parts.axis[gone[np.isfinite(parts.axis[gone])][:1]]
        where = f", the first at {at[0]:.5g} Hz" if at.size else ""
        said.append(f"{gone.size} lines are not numbers{where}: they were left out")

    def cut(x: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
        return None if x is None else x[lines][:, keep]

    left = replace(
        parts,
        axis=parts.axis[lines],
        H=parts.H[lines][:, keep],
        coherence=cut(parts.coherence),
        responses=tuple(c for c, k in zip(parts.responses, keep, strict=True) if k),
    )
    return left, cut(variance), tuple(said)
