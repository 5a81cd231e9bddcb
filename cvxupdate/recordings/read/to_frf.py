"""From a file's contents to frequency response functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.frf_arrays import frf_of_arrays, stated_variance
from cvxupdate.recordings.read.frf_columns import frf_of_columns
from cvxupdate.recordings.read.frf_functions import frf_of_functions
from cvxupdate.recordings.read.frf_parts import FrfParts
from cvxupdate.recordings.read.frf_whole import whole
from cvxupdate.recordings.read.variance import variance_of_frf
from cvxupdate.recordings.read.wanted import Names, Wanted
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin


def frequency_response(
    contents: Contents,
    origin: Origin,
    *,
    quantity: str | None = None,
    wanted: Sequence[Wanted] = (),
    references: Sequence[Channel] = (),
    frequency_column: int | str | None = None,
    names: Names | None = None,
    averages: float | None = None,
    leave_out: bool = False,
) -> FrequencyResponse:
    """FRFs of a file in SI, with their variance (see `read.variance`).

    Three forms are read: functions of a universal file; arrays ``frequency``, ``H``, ``coherence``,
    ``variance``, ``response_node``, ``response_dof`` (1 to 6), ``reference_node``,
    ``reference_dof`` of a container (``variance`` E|H - EH|² in the file's unit squared, where the
    program that made them knows it: it is taken as it is); columns of a table, declared by
    ``wanted`` and ``references``. ``quantity`` of the responses; ``averages`` where it is known.
    The coherence kept with the recording is the least over the references (each is excited alone).
    ``leave_out`` leaves out what is damaged (see `whole`) and says so in the origin's ``damage``.
    Raises `RecordingError` naming file and channel.
    """
    names = names or Names()
    if contents.functions:
        parts = frf_of_functions(contents, quantity, wanted, references)
    elif names["H"] in contents.arrays:
        parts = frf_of_arrays(contents, wanted, references, quantity or "acceleration", names)
        if quantity is None:
            raise RecordingError(
                f"{contents.file}: it does not state the quantity of its FRFs. Give response = "
                '"acceleration" (or velocity, displacement).'
            )
    else:
        parts = frf_of_columns(contents, wanted, references, quantity, frequency_column, names)
    stated = stated_variance(contents, wanted, parts.H, parts.responses, names)
    if leave_out:
        parts, stated, said = whole(parts, stated)
        origin = replace(origin, damage=(*origin.damage, *said))
    _sound(parts, contents.file)
    coherence = None if parts.coherence is None else np.clip(parts.coherence, 0.0, 1.0)
    variance = stated
    if variance is None:
        variance, _ = variance_of_frf(parts.H, coherence, averages)
    least = None
    if coherence is not None:
        filled = np.where(np.isnan(coherence), np.inf, coherence).min(axis=2)
        least = np.where(np.isinf(filled), np.nan, filled)
    return FrequencyResponse(
        origin,
        parts.axis,
        parts.H,
        parts.quantity,
        parts.responses,
        parts.references,
        variance,
        least,
    )


def _sound(parts: FrfParts, where: str) -> None:
    """Raise `RecordingError` unless the frequencies increase and the coherence lies in [0, 1]."""
    axis = parts.axis
    if (
        axis.size < 2
        or not np.all(np.isfinite(axis))
        or np.any(np.diff(axis) <= 0.0)
        or axis[0] < 0.0
    ):
        raise RecordingError(
            f"{where}: its frequencies must be finite, non-negative and increasing. Give the "
            "right frequency_column."
        )
    if parts.coherence is not None and np.any(
        (parts.coherence < -1e-3) | (parts.coherence > 1.001)
    ):
        raise RecordingError(
            f"{where}: its coherence is not between 0 and 1. Name the right column or array."
        )
