"""Frequency responses of the model beside the recorded ones, as `correlate` shows them."""

from __future__ import annotations

import numpy as np

from cvxupdate.correlate.frf import frf_correlation
from cvxupdate.correlate.response_error import (
    Stated,
    metric_of,
    modelled,
    simulated_history,
    stated_errors,
)
from cvxupdate.correlate.result import FrfComparison
from cvxupdate.errors import ConvergenceError, ModelError, RecordingError
from cvxupdate.fe.internal import is_nonlinear
from cvxupdate.fe.model import Model
from cvxupdate.recordings.measured import MOTION, measured_responses
from cvxupdate.recordings.spectral import frf_from_time
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

FDAC_LINES = 120
"""Lines of the FDAC map."""
H1 = "H1 of the time history (Hann window, half overlap)"


def compare_responses(
    model: Model, recording: FrequencyResponse | TimeHistory
) -> tuple[FrfComparison | None, tuple[str, ...], tuple[Stated, ...]]:
    """The curves of one recording beside the model's with the file's damping (None with the reason
    where they cannot be compared), what is to be said of them, and the recording's error.

    A time history is shown by its H1; its error is that of its own spectra (`response_error`).
    """
    if isinstance(recording, FrequencyResponse):
        compared, said = _compare(model, recording, "as measured")
        if compared is None:
            return None, said, stated_errors(model, (recording,))
        error = Stated(
            compared.use, metric_of(recording), compared.correlation.total, recording.origin.name
        )
        return compared, said, (error,)
    errors = stated_errors(model, (recording,))
    frf, why = frf_of_time(recording)
    if frf is None:
        return None, (why,), errors
    if not is_nonlinear(model):
        return *_compare(model, frf, H1), errors
    try:
        own, why = frf_of_time(simulated_history(model, recording))
    except (ModelError, ConvergenceError) as error:
        return None, (f"{recording.origin.name}: {error} Not compared.",), errors
    if own is None:
        return None, (why,), errors
    return *_compare(model, frf, f"{H1}, the model's of its simulation", own), errors


def _compare(
    model: Model, frf: FrequencyResponse, how: str, simulation: FrequencyResponse | None = None
) -> tuple[FrfComparison | None, tuple[str, ...]]:
    name = frf.origin.name
    found = measured_responses(frf)
    if not found:
        return None, (f"{name}: {_why_not(frf)}; not compared.",)
    (measured,) = found
    try:
        own = (
            modelled(model, measured) if simulation is None else measured_responses(simulation)[0].Y
        )
    except ModelError as error:
        return None, (f"{name}: {error} Not compared.",)
    f = measured.s.imag / (2.0 * np.pi)
    notes = (
        ()
        if is_damped(model)
        else (
            f"{name}: the model has no damping, so its peaks are unlimited and the error of "
            "its responses says little; give the model [model.damping].",
        )
    )
    return FrfComparison(
        name,
        frf.origin.use,
        frf.quantity,
        f,
        measured.Y,
        own,
        measured.variance,
        tuple(c.label for c in measured.responses),
        tuple(c.label for c in measured.references),
        frf_correlation(f, own, measured.Y, FDAC_LINES),
        how,
    ), notes


def _why_not(frf: FrequencyResponse) -> str:
    if frf.quantity not in MOTION:
        return f"responses of {frf.quantity} have no counterpart in the model"
    if not any(c.dof and c.quantity == "force" for c in frf.references):
        return "no force was recorded, so its spectra are no frequency responses"
    return "no response channel sits at a DOF of the model"


def frf_of_time(history: TimeHistory) -> tuple[FrequencyResponse | None, str]:
    """H1 of a time history over its band, or None with the reason; of several quantities the one
    with most channels (acceleration first)."""
    kinds = [c.quantity for c in history.channels if c.dof]
    found = sorted(
        (q for q in set(kinds) & set(MOTION)), key=lambda q: (-kinds.count(q), -MOTION.index(q))
    )
    if not found:
        return None, f"{history.origin.name}: no motion was recorded; not compared."
    try:
        frf = frf_from_time(history, quantity=found[0])
    except RecordingError as error:
        return None, f"{history.origin.name}: no frequency responses ({error}); not compared."
    band = history.band
    if band is None:
        return frf, ""
    keep = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    if np.count_nonzero(keep) < 2:
        return None, f"{history.origin.name}: fewer than two lines lie in its band; not compared."
    cut = [None if part is None else part[keep] for part in (frf.variance, frf.coherence)]
    return FrequencyResponse(
        frf.origin,
        frf.frequency[keep],
        frf.H[keep],
        frf.quantity,
        frf.responses,
        frf.references,
        *cut,
    ), ""


def is_damped(model: Model) -> bool:
    """Whether anything in the model dissipates."""
    if any(z > 0.0 for z in model.modal_damping):
        return True
    return any(
        m in ("C", "D") and bool(np.any(np.asarray(v) != 0.0))
        for b, values in zip(model.blocks, model.properties(), strict=True)
        for m, _, v in b.scalars(values)
    )
