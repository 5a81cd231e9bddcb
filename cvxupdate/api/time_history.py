"""Sampled channels in memory as a recording."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from cvxupdate.api.arrays import numbers, optional
from cvxupdate.api.held import Held
from cvxupdate.api.places import Place, places_of
from cvxupdate.api.shared import counted, origin_keys, settings_of
from cvxupdate.errors import InputError, RecordingError
from cvxupdate.recordings.types import QUANTITIES
from cvxupdate.recordings.types import TimeHistory as Sampled
from cvxupdate.recordings.units import scale_to_si


class TimeHistory:
    """Sampled channels.

    Parameters
    ----------
    data : (samples, channels), in SI unless ``units`` says otherwise.
    rate : Hz.
    channels : for each column the place and what it reads: ``("n4.z", "acceleration")``,
        ``(4, "z", "force")``.
    units : for each column, e.g. ``["N", "g"]``; "" is SI.
    settings : further keys of [[recordings]]: ``use``, ``name``, ``level``, ``band``.

    Raises
    ------
    InputError
        When shapes do not agree, or something is no number.
    """

    def __init__(
        self,
        data: Any,
        rate: float,
        channels: Sequence[Any],
        *,
        units: Sequence[str] | None = None,
        **settings: Any,
    ) -> None:
        values = numbers(data, "data", (1, 2))
        values = values[:, None] if values.ndim == 1 else values
        step = numbers(rate, "rate", 0)
        if step <= 0.0 or len(values) < 2:
            raise InputError("give a rate above 0 Hz and at least two samples (rows of data).")
        listed = isinstance(channels, Sequence) and not isinstance(channels, str)
        given = list(channels) if listed else []
        if len(given) != values.shape[1]:
            raise InputError(
                f"channels: {len(given)} for {values.shape[1]} columns of data. Give one for each: "
                '("n4.z", "acceleration").'
            )
        places, self.quantities = zip(*map(_read_channel, given), strict=True)
        told = [""] * len(places) if units is None else list(units)
        if len(told) != len(places):
            raise InputError(f"units: {len(told)} for {len(places)} channels. Give one for each.")
        try:
            scale = [
                scale_to_si(q, u, p.dof, None, p.sign)
                for p, q, u in zip(places, self.quantities, told, strict=True)
            ]
        except RecordingError as error:
            raise InputError(f"units: {error}") from None
        self.channels = tuple(Place(p.node, p.dof) for p in places)
        self.data, self.rate = values * np.array(scale), float(step)
        self._settings = settings_of(settings)

    @classmethod
    def of_recording(cls, history: Sampled) -> TimeHistory:
        """From a recording that was read."""
        at = [(c.node, c.dof, c.quantity) for c in history.channels if c.dof]
        if len(at) < len(history.channels):
            raise InputError(f"{history.origin.name}: a channel has no place in the model.")
        return cls(
            history.data,
            history.rate,
            at,
            **origin_keys(history.origin),
        )

    @classmethod
    def from_file(cls, file: str | os.PathLike[str], **keys: Any) -> TimeHistory:
        """From a file of any format that `inspect` knows; ``keys`` are those of [[recordings]]:
        channels, rate, time_column, start, stop …"""
        from cvxupdate.api.files import recording_of

        found = recording_of("time", file, keys)
        if not isinstance(found, Sampled):
            raise InputError(f"{file}: holds no time history.")
        return cls.of_recording(found)

    @classmethod
    def from_pandas(
        cls, frame: Any, channels: Any, rate: float | None = None, **keys: Any
    ) -> TimeHistory:
        """From a DataFrame with a column for each channel; without ``rate`` its index is the time
        in s (or a TimedeltaIndex). ``channels`` as above, or {column: channel}."""
        if isinstance(channels, Mapping):
            missing = [str(c) for c in channels if c not in frame.columns]
            if missing:
                raise InputError(f"the DataFrame has no column {', '.join(missing)}.")
            frame, channels = frame[list(channels)], list(channels.values())
        if rate is None:
            rate = _rate_of(frame.index)
        return cls(frame.to_numpy(), rate, channels, **keys)

    @cached_property
    def _held(self) -> Held:
        return Held("time", {"data": self.data})

    def table(self) -> dict[str, Any]:
        """The [[recordings]] table that stands for it."""
        rows = [
            {"column": i, "quantity": q, "node": c.node, "dof": c.dof}
            for i, (c, q) in enumerate(zip(self.channels, self.quantities, strict=True))
        ]
        names = {"data": "data"}
        made = {"kind": "time", "file": str(self._held.path), "rate": self.rate, "channels": rows}
        return {**made, "variables": names, **self._settings}

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: times in s as index, a column for each channel."""
        pandas = optional("pandas", "to_dataframe")
        index = pandas.Index(np.arange(len(self.data)) / self.rate, name="time (s)")
        return pandas.DataFrame(self.data, index, self._names())

    def plot(self) -> Any:
        """Every channel over time, as a matplotlib figure."""
        from cvxupdate.report.plots import time_figure

        return time_figure(np.arange(len(self.data)) / self.rate, self.data, self._names())

    def _names(self) -> list[str]:
        return [f"{c.label} {q}" for c, q in zip(self.channels, self.quantities, strict=True)]

    def __repr__(self) -> str:
        seconds = len(self.data) / self.rate
        return (
            f"TimeHistory({counted(len(self.channels), 'channel')}, {len(self.data)} samples at "
            f"{self.rate:g} Hz ({seconds:.4g} s))"
        )


def _read_channel(given: Any) -> tuple[Place, str]:
    """Place and quantity of ``("n4.z", "force")`` or ``(4, "z", "force")``."""
    parts = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else []
    if len(parts) not in (2, 3) or parts[-1] not in QUANTITIES:
        raise InputError(
            f'channels: {given!r} is not understood. Give place and quantity, ("n4.z", '
            '"acceleration"); quantities are ' + ", ".join(QUANTITIES) + "."
        )
    at = parts[0] if len(parts) == 2 else tuple(parts[:2])
    return places_of([at], 1, "channels")[0], parts[-1]


def _rate_of(index: Any) -> float:
    seconds = getattr(index, "total_seconds", None)
    times = numbers(seconds() if callable(seconds) else index, "the index of the DataFrame", 1)
    steps = np.diff(times)
    if not steps.size or steps.min() <= 0.0 or np.ptp(steps) > 0.002 * steps.mean():
        raise InputError("the index of the DataFrame is no time in even steps. Give rate.")
    return float(1.0 / steps.mean())
