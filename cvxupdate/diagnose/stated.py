"""The figures of the diagnosis in the one definition of `correlate.response_error`: as the file
came, as fitted, and what noise alone would leave.

The engine itself ranks and accepts by its own error (`residual.channel_errors`: every channel
counts alike, the mesh error taken out); these figures are what is stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.correlate.frf import frf_error
from cvxupdate.correlate.response_error import (
    Stated,
    metric_of,
    pooled,
    stated_errors,
    together,
)
from cvxupdate.diagnose.finding import finite
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.signals import ORDER, Signal
from cvxupdate.fe.model import Model
from cvxupdate.recordings.measured import measured_responses
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

Responses = Sequence[FrequencyResponse | TimeHistory]


def nominal_errors(model: Model, recordings: Responses) -> tuple[Stated, ...]:
    """The model as it came: mesh included, damping of the file; the figures of `run` and
    `correlate` before anything is changed."""
    return stated_errors(model, recordings)


def fitted_errors(fitted: Fit, recordings: Responses, meshed: bool = True) -> tuple[Stated, ...]:
    """The fitted model on the mesh of the file, sensor faults and fitted damping included, the
    mesh error not taken out."""
    signals, names = [], []
    for recording in recordings:
        for m in measured_responses(recording):
            names.append((recording.origin.use, metric_of(recording)))
            signals.append(
                Signal(
                    recording.origin.name,
                    recording.origin.use,
                    recording.origin.level,
                    m.s,
                    None,
                    m.Y,
                    m.U,
                    np.zeros(m.Y.shape),
                    ORDER[m.quantity],
                    tuple(c.label for c in m.responses),
                    tuple(c.label for c in m.references),
                )
            )
    setting = replace(
        fitted.setting, signals=tuple(signals), mesh=None if meshed else fitted.setting.mesh
    )
    own = setting.evaluate(fitted.p, fitted.point).modelled()
    return tuple(
        Stated(use, metric, frf_error(values, signal.Y))
        for (use, metric), values, signal in zip(names, own, signals, strict=True)
    )


def noise_of(signals: Sequence[Signal]) -> float | None:
    """What a perfect model would be left with: ‖noise‖/‖Yₓ‖, r.m.s. over the signals."""
    if not signals:
        return None
    ratios = [np.sum(s.std**2) / np.sum(np.abs(s.Y) ** 2) for s in signals]
    return float(np.sqrt(np.mean(ratios)))


def stated_metrics(
    before: Sequence[Stated], after: Sequence[Stated]
) -> dict[str, dict[str, dict[str, float]]]:
    """The contract's metrics of a diagnosis, ``before`` the file as it came."""
    first, last = pooled(before), pooled(after)
    return {
        key: {name: {"before": first[key][name], "after": last[key][name]} for name in first[key]}
        for key in ("fit", "hold_out")
    }


def stated_fit(
    before: Sequence[Stated],
    ordinary: Sequence[Stated],
    after: Sequence[Stated],
    noise: tuple[float | None, float | None],
) -> dict[str, dict[str, float | None]]:
    """The contract's ``fit``: the r.m.s. over all recordings of a use, whatever their kind."""
    return {
        key: {
            "before": finite(together(before, use)),
            "ordinary": finite(together(ordinary, use)),
            "after": finite(together(after, use)),
            "noise": None if floor is None else finite(floor),
        }
        for (use, key), floor in zip((("fit", "fit"), ("hold-out", "hold_out")), noise, strict=True)
    }
