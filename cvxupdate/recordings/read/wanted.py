"""Channels as a problem file declares them, and the step from a file's column to SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents
from cvxupdate.recordings.types import Channel
from cvxupdate.recordings.units import is_unit, scale_to_si

FORMS = ("complex", "real-imaginary", "magnitude-phase", "db-phase")


@dataclass(frozen=True)
class Wanted:
    """One declared channel.

    ``column`` is a column of the table (number, or name in its header) or the name of an array of
    the file; ``index`` picks one row of an array with more axes (its leading axes). ``unit`` and
    ``sensitivity`` as in `units.scale_to_si` (an empty unit: what the file states, else SI). For an
    FRF in columns: ``form`` (one of `FORMS`), ``pair`` the column of the imaginary part or phase,
    ``coherence`` that of the coherence, ``reference`` the place of its reference in the list of
    references.
    """

    column: int | str
    quantity: str
    node: int = 0
    dof: str = ""
    unit: str = ""
    sensitivity: float | str | None = None
    sign: int = 1
    index: tuple[int, ...] = ()
    form: str = "complex"
    pair: int | str | None = None
    phase_unit: str = "deg"
    coherence: int | str | None = None
    reference: int = 0

    @property
    def label(self) -> str:
        """How messages name it."""
        place = f" at n{self.node}.{self.dof}" if self.dof else ""
        return f"channel {self.column} ({self.quantity}{place})"


@dataclass(frozen=True)
class Names:
    """Names of the arrays inside a file, where they differ from the customary ones (``variables``
    in the problem file)."""

    given: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> str:
        return self.given.get(name, name)


def table_of(contents: Contents, names: Names) -> AnyArray | None:
    """The table of the file as (rows, columns): the array ``data``, or the file's only numeric
    array of two axes; else None.

    A table with fewer rows than columns whose rows are the channels (16 or more samples to a
    channel) is turned.
    """
    name = names["data"]
    array = contents.arrays.get(name)
    if array is None and "data" in names.given:
        raise RecordingError(
            f"{contents.file}: there is no array {name!r}. It holds: {_listed(contents)}."
        )
    if array is None:
        tables = [
            value
            for value in contents.arrays.values()
            if value.ndim == 2 and min(value.shape) > 0 and value.size > 64
        ]
        array = tables[0] if len(tables) == 1 else None
    if array is None:
        return None
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2:
        return None
    if contents.format != "text" and array.shape[1] > 16 * array.shape[0]:
        array = array.T
    return array


def _listed(contents: Contents) -> str:
    found = [
        f"{name} {'x'.join(map(str, array.shape))}"
        for name, array in list(contents.arrays.items())[:12]
    ]
    return (
        ", ".join(
            [*found, *(["columns " + ", ".join(contents.columns)] if contents.columns else [])]
        )
        or "no arrays"
    )


def values_of(
    contents: Contents, names: Names, column: int | str, index: tuple[int, ...] = (), who: str = ""
) -> NDArray[Any]:
    """One column (or named array) as a 1-D array of numbers; raises `RecordingError` with what the
    file does hold."""
    where = f"{contents.file}{': ' + who if who else ''}"
    if isinstance(column, str):
        array = contents.arrays.get(names[column], contents.arrays.get(column))
        if array is not None:
            if index:
                if len(index) >= array.ndim or any(
                    not -n <= i < n for i, n in zip(index, array.shape, strict=False)
                ):
                    raise RecordingError(
                        f"{where}: index {list(index)} does not fit array {column!r} of shape "
                        f"{array.shape}."
                    )
                array = array[index]
            array = np.squeeze(array)
            if array.ndim != 1:
                raise RecordingError(
                    f"{where}: array {column!r} has shape {array.shape}; one row of it is "
                    "needed. Give index."
                )
            return np.asarray(array)
        if column in contents.columns:
            if contents.columns.count(column) > 1:
                raise RecordingError(
                    f"{where}: {contents.columns.count(column)} columns are named {column!r}. "
                    "Give its number."
                )
            column = contents.columns.index(column)
        else:
            raise RecordingError(
                f"{where}: there is no column or array {column!r}. The file holds: "
                f"{_listed(contents)}."
            )
    table = table_of(contents, names)
    if table is None:
        raise RecordingError(
            f"{where}: the file has no array 'data', so a column's number says nothing. It holds: "
            f"{_listed(contents)}. Name the array with column or variables."
        )
    if not 0 <= column < table.shape[1]:
        raise RecordingError(
            f"{where}: there is no column {column}; the table has {table.shape[1]} (0 to "
            f"{table.shape[1] - 1})."
        )
    return np.asarray(table[:, column])


def stated_unit(contents: Contents, column: int | str) -> str:
    """The unit that the file's header gives to a column, "" where it gives none that is known."""
    if isinstance(column, str):
        column = contents.columns.index(column) if column in contents.columns else -1
    unit = contents.units[column] if 0 <= column < len(contents.units) else ""
    return unit if is_unit(unit) else ""


def channel_of(contents: Contents, wanted: Wanted, per: str | None = None) -> Channel:
    """The labelled channel with its factor to SI; a fault of the unit names the file and the
    channel."""
    unit = wanted.unit or (
        "" if wanted.sensitivity is not None else stated_unit(contents, wanted.column)
    )
    if wanted.form == "db-phase" and not wanted.unit:
        unit = ""
    try:
        scale = scale_to_si(wanted.quantity, unit, wanted.dof, wanted.sensitivity, wanted.sign, per)
    except RecordingError as error:
        raise RecordingError(f"{contents.file}: {wanted.label}: {error}") from error
    return Channel(wanted.node, wanted.dof, wanted.quantity, unit, scale)


def real_values(values: NDArray[Any], where: str) -> NDArray[np.float64]:
    """Numbers as float; complex ones are refused unless their imaginary part is zero."""
    if values.dtype.kind == "c":
        if np.any(values.imag != 0.0):
            raise RecordingError(f"{where}: it is complex where real numbers are needed.")
        values = values.real
    if values.dtype.kind not in "biuf":
        raise RecordingError(f"{where}: it does not hold numbers.")
    return np.asarray(values, dtype=np.float64)
