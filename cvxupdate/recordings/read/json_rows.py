"""JSON: rows of numbers, rows of named values, or named columns."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Format, Options

_RATES = (
    "rate",
    "fs",
    "sampling freq",
    "sampling_freq",
    "sampling_rate",
    "sample_rate",
    "sampling frequency",
)


def _numbers(value: Any) -> AnyArray | None:
    """A rectangular array of numbers (null is NaN), or None when it is not one."""
    if not isinstance(value, list) or not value:
        return None
    try:
        array = np.array(value, dtype=float)
    except (ValueError, TypeError, OverflowError):
        return None
    return array


def _by_key(rows: list[dict[str, Any]]) -> dict[str, AnyArray]:
    """Rows of named values to named columns; a key that a row does not have is NaN there."""
    arrays: dict[str, AnyArray] = {}
    for key in dict.fromkeys(key for row in rows for key in row):
        column = _numbers([row.get(key) for row in rows])
        if column is not None:
            arrays[key] = column
    return arrays


def read_json(path: Path, options: Options) -> Contents:
    """Rows under a key (``{"data": [[…], …], "dt": …}``), a bare list of rows, or named columns;
    damage raises `RecordingError`."""
    text = path.read_text(encoding=options.encoding or "utf-8-sig")
    try:
        value = json.loads(text)
    except RecursionError as error:
        raise RecordingError(
            f"{path}: its brackets are nested too deeply for a recording."
        ) from error
    except ValueError as error:
        raise RecordingError(
            f"{path}: it is not JSON ({error}). The file is cut short or damaged, or not JSON "
            "at all."
        ) from error
    if isinstance(value, list):
        value = {"data": value}
    if not isinstance(value, dict):
        raise RecordingError(
            f"{path}: a recording is a list of rows or a table with one; this is a single "
            f"{type(value).__name__}."
        )
    arrays: dict[str, AnyArray] = {}
    notes: list[str] = []
    rate: float | None = None
    for key, item in value.items():
        if isinstance(item, bool):
            continue
        if isinstance(item, int | float):
            if key.lower() in _RATES:
                rate = float(item)
            elif key.lower() == "dt" and item > 0 and rate is None:
                rate = 1.0 / item
            continue
        if isinstance(item, list) and item and all(isinstance(row, dict) for row in item):
            arrays.update(_by_key(item))
            continue
        array = _numbers(item)
        if array is not None:
            arrays[key] = array
        elif isinstance(item, list) and item:
            if key == "data" or all(isinstance(row, list) for row in item):
                lengths = sorted({len(row) for row in item if isinstance(row, list)})
                raise RecordingError(
                    f"{path}: the rows of {key!r} are not all numbers of one length (lengths "
                    f"{lengths[:4]}). Give every row the same columns."
                )
            notes.append(f"{key!r} does not hold numbers; it was left out")
    return Contents(str(path), "json", arrays, rate=rate, notes=tuple(notes))


JSON = Format(
    "json",
    (".json",),
    lambda head: head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"["),
    read_json,
)
