"""A few frequency responses as measured, and of the model before and after an update: what a page
shows beside the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate.frf import frf_errors
from cvxupdate.correlate.response_error import modelled
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.measured import Measured, measured_responses
from cvxupdate.recordings.types import FrequencyResponse, Recording

Real = NDArray[np.float64]

RECORDINGS = 2
"""Recordings shown at most, of those to fit and of those held out."""
CHANNELS = 2
"""Responses shown of each: the one at the force (else the first), and the one that is furthest off
after the update."""
LINES = 1200
"""Points of a curve at most: more than a figure has pixels across."""


@dataclass(frozen=True, eq=False)
class FrfOverlay:
    """Moduli (n,) at ``frequency`` (Hz) in the recorded ``quantity`` per N, with the error of the
    response over these lines before and after; ``fitted`` are the frequencies that the problem file
    names (none: it names no lines, or the recording was held out)."""

    recording: str
    use: str
    response: str
    reference: str
    quantity: str
    frequency: Real
    measured: Real
    before: Real
    after: Real
    error_before: float
    error_after: float
    fitted: tuple[float, ...] = ()


def frf_overlays(
    model: Model,
    recordings: Sequence[Recording],
    p: Sequence[float],
    lines: Sequence[float] | str = (),
) -> tuple[FrfOverlay, ...]:
    """The model as it came and at ``p`` beside the first `RECORDINGS` of each use; ``lines`` [Hz]
    that are fitted, or the rule that chose them. A recording is left out where the model has no
    finite response."""
    out: list[FrfOverlay] = []
    for use in ("fit", "hold-out"):
        frfs = [r for r in recordings if isinstance(r, FrequencyResponse) and r.origin.use == use]
        for recording in frfs[:RECORDINGS]:
            for measured in measured_responses(recording):
                named = use == "fit" and not isinstance(lines, str)
                fitted = tuple(float(f) for f in lines) if named else ()
                out += _of(model, recording, _thinned(measured), np.array(p), fitted)
    return tuple(out)


def _thinned(measured: Measured) -> Measured:
    step = max(1, -(-len(measured.s) // LINES))
    return replace(
        measured, s=measured.s[::step], Y=measured.Y[::step], U=measured.U[::step], variance=None
    )


def _of(
    model: Model,
    recording: FrequencyResponse,
    measured: Measured,
    p: Real,
    fitted: tuple[float, ...],
) -> list[FrfOverlay]:
    try:
        before, after = (modelled(model, measured, at) for at in (None, p))
    except ModelError:
        return []
    errors = [frf_errors(Y, measured.Y) for Y in (before, after)]
    f = measured.s.imag / (2.0 * np.pi)
    return [
        FrfOverlay(
            recording.origin.name,
            recording.origin.use,
            measured.responses[i].label,
            measured.references[j].label,
            measured.quantity,
            f,
            np.abs(measured.Y[:, i, j]),
            np.abs(before[:, i, j]),
            np.abs(after[:, i, j]),
            float(errors[0][i, j]),
            float(errors[1][i, j]),
            fitted,
        )
        for i, j in _shown(measured, errors[1])
    ]


def _shown(measured: Measured, errors: Real) -> list[tuple[int, int]]:
    """(response, reference) of what is drawn."""
    forces = [c.label for c in measured.references]
    drive = [
        (i, forces.index(c.label)) for i, c in enumerate(measured.responses) if c.label in forces
    ]
    first = drive[0] if drive else (0, 0)
    ranked = np.where(np.isfinite(errors), errors, -1.0)
    ranked[first] = -1.0
    worst = np.unravel_index(int(np.argmax(ranked)), ranked.shape)
    rest = [(int(worst[0]), int(worst[1]))] if ranked[worst] >= 0.0 else []
    return [first, *rest][:CHANNELS]
