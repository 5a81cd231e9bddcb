"""Measured modes beside the model's: mode tables of a problem, mode results and their metrics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cvxupdate.correlate import mac
from cvxupdate.errors import InputError
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.shape_rows import channel_rows, real_shapes
from cvxupdate.system import Array
from cvxupdate.update.outcome import finite
from cvxupdate.update.result import Metrics, ModeResult


def modal_tables(
    recordings: Sequence[Recording],
) -> tuple[tuple[ModeTable, ...], tuple[ModeTable, ...]]:
    """Mode tables to fit and to score only.

    Raises
    ------
    InputError
        When there is nothing to fit.
    """
    tables = [r for r in recordings if isinstance(r, ModeTable)]
    fit = tuple(t for t in tables if t.origin.use == "fit")
    if not fit:
        raise InputError(
            'methods frequencies and sensitivity need a recording of kind "modes" with use = '
            '"fit". Add one, or identify modes first.'
        )
    return fit, tuple(t for t in tables if t.origin.use != "fit")


def mode_results(start: ModalPoint, end: ModalPoint) -> tuple[ModeResult, ...]:
    """Every measured mode beside its partner, before and after."""
    out = []
    tables = start.residual.tables
    for k, table in enumerate(tables):
        before, after = start.frequencies(k), end.frequencies(k)
        mac_before, mac_after = _macs(start, k), _macs(end, k)
        for i, fx in enumerate(table.frequency.tolist()):
            if start.places[k][i] < 0 or end.places[k][i] < 0:
                continue
            out.append(
                ModeResult(
                    table.origin.name,
                    table.origin.use,
                    fx,
                    float(table.frequency_std[i]),
                    float(before[i]),
                    float(after[i]),
                    100 * abs(float(before[i]) - fx) / fx,
                    100 * abs(float(after[i]) - fx) / fx,
                    int(start.places[k][i]) - start.modes.rigid + 1,
                    int(end.places[k][i]) - start.modes.rigid + 1,
                    finite(mac_before[i]),
                    finite(mac_after[i]),
                )
            )
    return tuple(out)


def modal_metrics(start: ModalPoint, end: ModalPoint) -> dict[str, Metrics]:
    """The contract's metrics for the fitted and the held-out modes."""
    modes = mode_results(start, end)
    return {
        key: metrics_of([m for m in modes if m.use == use])
        for key, use in (("fit", "fit"), ("hold_out", "hold-out"))
    }


def metrics_of(modes: Sequence[ModeResult]) -> Metrics:
    """Frequency errors in per cent, and MAC where shapes are known; nothing without modes."""
    if not modes:
        return {}
    errors = [m.error_before for m in modes], [m.error_after for m in modes]
    pairs = [
        (m.mac_before, m.mac_after)
        for m in modes
        if m.mac_before is not None and m.mac_after is not None
    ]
    out = {
        "frequency_error_percent_mean": _before_after(np.mean, *errors),
        "frequency_error_percent_max": _before_after(np.max, *errors),
    }
    if pairs:
        macs = [x for x, _ in pairs], [y for _, y in pairs]
        out |= {"mac_mean": _before_after(np.mean, *macs), "mac_min": _before_after(np.min, *macs)}
    return out


def _before_after(
    f: Callable[[Sequence[float]], Any], before: Sequence[float], after: Sequence[float]
) -> dict[str, float]:
    return {"before": float(f(before)), "after": float(f(after))}


def _macs(point: ModalPoint, k: int) -> Array:
    table = point.residual.tables[k]
    out = np.full(len(table.frequency), np.nan)
    if table.shapes is None:
        return out
    rows, shapes = channel_rows(table, point.residual.model), real_shapes(table.shapes)
    for i, at in enumerate(point.places[k].tolist()):
        ok = (rows >= 0) & np.isfinite(shapes[i])
        if at >= 0 and ok.sum() >= 2:
            out[i] = mac(point.modes.shapes[rows[ok], at][:, None], shapes[i][ok][:, None])[0, 0]
    return out
