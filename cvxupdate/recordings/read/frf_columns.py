"""FRFs from the columns of a table, declared by channels and references."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.column_words import FORM, PARTNER, role_of
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.frf_parts import FrfParts, distinct
from cvxupdate.recordings.read.wanted import (
    FORMS,
    Names,
    Wanted,
    channel_of,
    real_values,
    stated_unit,
    values_of,
)
from cvxupdate.recordings.types import Channel, Real
from cvxupdate.recordings.units import parse_unit


def _column_frf(contents: Contents, want: Wanted, names: Names) -> NDArray[np.complex128]:
    """One FRF from its columns: complex text, real and imaginary part, magnitude and phase, or
    decibel and phase."""
    where = f"{contents.file}: {want.label}"
    first = values_of(contents, names, want.column, want.index, want.label)
    if want.form not in FORMS:
        raise RecordingError(f"{where}: form {want.form!r} is not one of {', '.join(FORMS)}.")
    if want.form == "complex":
        _whole(contents, want, where)
        if first.dtype.kind not in "biufc":
            raise RecordingError(f"{where}: it does not hold numbers.")
        return np.asarray(first, dtype=complex)
    real = real_values(first, where)
    if want.form == "magnitude-phase" and want.pair is None:
        return np.asarray(real, dtype=complex)
    if want.form == "db-phase" and want.pair is None:
        return np.asarray(10.0 ** (real / 20.0), dtype=complex)
    if want.pair is None:
        raise RecordingError(
            f"{where}: form {want.form!r} needs pair, the column of the imaginary part."
        )
    second = real_values(values_of(contents, names, want.pair, want.index, want.label), where)
    if second.shape != real.shape:
        raise RecordingError(f"{where}: its two columns have {real.size} and {second.size} lines.")
    if want.form == "real-imaginary":
        return np.asarray(real + 1j * second)
    unit = want.phase_unit or stated_unit(contents, want.pair) or "deg"
    magnitude = 10.0 ** (real / 20.0) if want.form == "db-phase" else real
    return np.asarray(magnitude * np.exp(1j * parse_unit(unit).factor * second))


def _whole(contents: Contents, want: Wanted, where: str) -> None:
    """Raise `RecordingError` where a channel of form "complex" would lose half of its number: a
    ``pair`` is given, or its column is by its name the first of two."""
    if want.pair is not None:
        raise RecordingError(
            f"{where}: pair is given, but not how the two columns write a number. Set form = "
            '"real-imaginary", "magnitude-phase" or "db-phase".'
        )
    if isinstance(want.column, str):
        at = contents.columns.index(want.column) if want.column in contents.columns else -1
    else:
        at = want.column
    if not 0 <= at < len(contents.columns):
        return
    units = contents.units or ("",) * len(contents.columns)
    roles = [role_of(*both) for both in zip(contents.columns, units, strict=True)]
    role, rest = roles[at]
    partner = (PARTNER.get(role, ""), rest)
    if partner in roles:
        other = contents.columns[roles.index(partner)]
        raise RecordingError(
            f"{where}: by its name this column is the {role} part of a number, and {other!r} "
            f'beside it the other: set form = "{FORM[role]}" and pair = "{other}".'
            if role == "real"
            else f"{where}: by its name this column is a {role}, and {other!r} beside it its "
            f'phase: set form = "{FORM[role]}" and pair = "{other}".'
        )


def frf_of_columns(
    contents: Contents,
    wanted: Sequence[Wanted],
    references: Sequence[Channel],
    quantity: str | None,
    frequency_column: int | str | None,
    names: Names,
) -> FrfParts:
    """One FRF for each declared channel. Raises `RecordingError` naming file and channel."""
    where = contents.file
    if not wanted or not references:
        raise RecordingError(
            f"{where}: FRFs in columns need channels and references in the [[recordings]] block: "
            "which column is which sensor, and where it was excited. 'cvxupdate inspect' writes "
            "a block to start from."
        )
    axis = _axis(contents, frequency_column, names)
    kind = _quantity_of(wanted, quantity, where)
    places = distinct([(want.node, want.dof) for want in wanted])
    H = np.full((axis.size, len(places), len(references)), np.nan, dtype=complex)
    coherence = np.full(H.shape, np.nan)
    first: dict[tuple[int, str], Channel] = {}
    for want in wanted:
        if not 0 <= want.reference < len(references):
            raise RecordingError(
                f"{where}: {want.label}: no reference {want.reference}; "
                f"{len(references)} are declared."
            )
        channel = channel_of(contents, want, references[want.reference].quantity)
        first.setdefault((want.node, want.dof), channel)
        values = _column_frf(contents, want, names)
        if values.size != axis.size:
            raise RecordingError(
                f"{where}: {want.label}: {values.size} lines, but {axis.size} frequencies."
            )
        r = places.index((want.node, want.dof))
        if not np.isnan(H[0, r, want.reference]):
            raise RecordingError(
                f"{where}: {want.label} is declared twice for one reference. Leave one out; an "
                "imaginary part or a phase is no channel of its own, but the pair of one."
            )
        H[:, r, want.reference] = values * channel.scale
        if want.coherence is not None:
            coherence[:, r, want.reference] = real_values(
                values_of(contents, names, want.coherence, want.index), f"{where}: coherence"
            )
    return FrfParts(
        axis,
        H,
        None if np.all(np.isnan(coherence)) else coherence,
        tuple(first[place] for place in places),
        tuple(references),
        kind,
    )


def _axis(contents: Contents, frequency_column: int | str | None, names: Names) -> Real:
    column = (
        frequency_column
        if frequency_column is not None
        else ("frequency" if names["frequency"] in contents.arrays else 0)
    )
    values = values_of(contents, names, column)
    if values.dtype.kind == "c" and np.all(values.imag == 0):
        values = values.real
    return real_values(values, f"{contents.file}: frequency")


def _quantity_of(wanted: Sequence[Wanted], quantity: str | None, where: str) -> str:
    kinds = {want.quantity for want in wanted}
    if quantity is None and len(kinds) != 1:
        raise RecordingError(
            f"{where}: its responses are of several quantities "
            f"({', '.join(sorted(kinds))}). Give them apart."
        )
    kind = quantity or next(iter(kinds))
    for want in wanted:
        if want.quantity not in (kind, "unknown", "voltage"):
            raise RecordingError(
                f"{where}: {want.label}: this contradicts response = {kind!r}. Correct the one "
                "that is wrong."
            )
    return kind
