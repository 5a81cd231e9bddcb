"""How well a model's frequency responses fit recordings of kind "frf", before and after: a score for methods that fit something else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from cvxupdate.correlate import frf_error
from cvxupdate.errors import RecordingError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Complex, FrequencyResponse, Recording
from cvxupdate.system import Array
from cvxupdate.update.result import Metrics

POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}


def receptances(model: Model, p: Array, frf: FrequencyResponse) -> Complex:
    """The model's H (lines, responses, references) at ``p`` in the quantity of ``frf``; NaN at a line where Z is singular.

    Raises
    ------
    RecordingError
        For a channel that is not on the model.
    """
    m = model.matrices(p)
    rows, columns = ([model.place.get(c.label, -1) for c in channels] for channels in (frf.responses, frf.references))
    if -1 in columns:
        raise RecordingError(f"{frf.origin.source}: the force at {frf.references[columns.index(-1)].label} acts on a DOF that the model does not move.")
    damped = bool(np.any(m.C.data) or np.any(m.D.data))
    unit = np.zeros((model.size, len(columns)), dtype=complex if damped else float)
    unit[columns, np.arange(len(columns))] = 1.0
    held = np.array(rows) < 0
    out = np.full((len(frf.frequency), len(rows), len(columns)), np.nan, dtype=complex)
    for k, f in enumerate(frf.frequency.tolist()):
        w = 2.0 * np.pi * f
        Z = m.K - w**2 * m.M
        try:
            x = splu(sp.csc_matrix(Z + 1j * (m.D + w * m.C) if damped else Z)).solve(unit)
        except RuntimeError:
            continue
        out[k] = np.where(held[:, None], 0.0, x[rows]) * (1j * w) ** POWER[frf.quantity]
    return out


def frf_metrics(model: Model, p: Array, recordings: Sequence[Recording]) -> Metrics:
    """{"frf_error": {"before", "after"}} of the hold-out FRFs (‖H − Hₓ‖ / ‖Hₓ‖ over all of them); empty when there is none."""
    frfs = [r for r in recordings if isinstance(r, FrequencyResponse) and r.origin.use == "hold-out" and r.quantity in POWER]
    if not frfs:
        return {}
    score = {}
    for key, at in (("before", model.zero()), ("after", p)):
        pairs = [(receptances(model, at, r), r.H) for r in frfs]
        ok = [np.all(np.isfinite(a), axis=(1, 2)) for a, _ in pairs]
        score[key] = float(frf_error(np.concatenate([a[k].ravel() for (a, _), k in zip(pairs, ok, strict=True)])[:, None, None],
                                     np.concatenate([x[k].ravel() for (_, x), k in zip(pairs, ok, strict=True)])[:, None, None]))
    return {"frf_error": score}
