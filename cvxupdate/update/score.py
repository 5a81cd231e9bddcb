"""How well a model's frequency responses fit recordings of kind "frf", before and after: a score
for methods that fit something else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.correlate import frf_error, model_frf
from cvxupdate.correlate.response import POWERS
from cvxupdate.errors import RecordingError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Complex, FrequencyResponse, Recording
from cvxupdate.system import Array
from cvxupdate.update.result import Metrics


def responses_like(model: Model, p: Array, frf: FrequencyResponse) -> Complex:
    """The model's H (lines, responses, references) at ``p`` at the lines and channels of ``frf``,
    in its quantity; 0 at held DOFs.

    Raises
    ------
    RecordingError
        For a force on a DOF that is not on the model. ModelError: the model is a mechanism there.
    """
    rows, columns = (
        np.array([model.place.get(c.label, -1) for c in channels], dtype=np.int64)
        for channels in (frf.responses, frf.references)
    )
    if np.any(columns < 0):
        label = frf.references[int(np.argmax(columns < 0))].label
        raise RecordingError(
            f"{frf.origin.source}: the force at {label} acts on a DOF that the model does not move."
        )
    return model_frf(model, frf.frequency, rows, columns, frf.quantity, p)


def frf_metrics(model: Model, p: Array, recordings: Sequence[Recording]) -> Metrics:
    """{"frf_error": {"before", "after"}} of the hold-out FRFs (‖H − Hₓ‖ / ‖Hₓ‖ over all of them);
    empty when there is none."""
    frfs = [
        r
        for r in recordings
        if isinstance(r, FrequencyResponse) and r.origin.use == "hold-out" and r.quantity in POWERS
    ]
    if not frfs:
        return {}
    score = {}
    for key, at in (("before", model.zero()), ("after", p)):
        pairs = [(responses_like(model, at, r), r.H) for r in frfs]
        own, recorded = (
            np.concatenate([pair[i].ravel() for pair in pairs])[:, None, None] for i in (0, 1)
        )
        score[key] = float(frf_error(own, recorded))
    return {"frf_error": score}
