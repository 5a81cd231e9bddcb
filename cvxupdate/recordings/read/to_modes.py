"""From rows or arrays to a table of modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.wanted import Names, Wanted, channel_of, real_values
from cvxupdate.recordings.types import DOF_KINDS, Channel, ModeTable, Origin, Real

WEIGHT = 0.01
"""Deviation of a frequency, as a fraction, where nobody gave one: a weight, not a measurement
(``relative_only``)."""


@dataclass(frozen=True)
class ModeValues:
    """One mode as declared: ``shape`` and ``shape_std`` by place, None where unknown; ``pair`` 0
    for "find it"."""

    frequency: float
    frequency_std: float | None = None
    damping: float | None = None
    damping_std: float | None = None
    shape: Sequence[complex | float] | None = None
    shape_std: float | Sequence[float] | None = None
    pair: int = 0


def mode_table(
    modes: Sequence[ModeValues],
    origin: Origin,
    wanted: Sequence[Wanted] = (),
    *,
    frequency_std: float | None = None,
    frequency_std_relative: float | None = None,
    channels: Sequence[Channel] = (),
) -> ModeTable:
    """A `ModeTable` from declared modes, in rising order of frequency.

    ``wanted`` says which node and DOF each entry of a shape is (``column`` is its place). A mode
    without its own deviation takes ``frequency_std`` (Hz), else ``frequency_std_relative`` times
    its frequency; if no mode and no default has one, 1 % is set for all as a mere weight and
    ``relative_only`` is True. A deviation that only some modes have is an error. Raises
    `RecordingError`.
    """
    where = origin.source
    if not modes:
        raise RecordingError(f"{where}: the table of modes is empty. Give rows.")
    modes = sorted(modes, key=lambda mode: mode.frequency)
    frequency = np.array([mode.frequency for mode in modes], dtype=float)
    if not np.all(np.isfinite(frequency)) or np.any(frequency <= 0.0):
        raise RecordingError(f"{where}: a frequency is not a positive number.")
    given = _column([mode.frequency_std for mode in modes])
    std, relative_only = _deviations(frequency, given, frequency_std, frequency_std_relative, where)
    places, labels = places_of(where, wanted, channels)
    shapes, deviations = _shapes(where, modes, places, len(labels))
    return ModeTable(
        origin,
        frequency,
        std,
        _column([mode.damping for mode in modes]),
        _column([mode.damping_std for mode in modes]),
        labels,
        shapes,
        deviations,
        np.array([mode.pair for mode in modes], dtype=np.int64),
        relative_only,
    )


def _column(values: list[float | None]) -> Real:
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _deviations(
    frequency: Real, given: Real, fallback: float | None, relative: float | None, where: str
) -> tuple[Real, bool]:
    """Deviation of every frequency in Hz, and whether it is a mere weight; see `mode_table`."""
    std = given
    if fallback is not None:
        std = np.where(np.isnan(std), fallback, std)
    elif relative is not None:
        std = np.where(np.isnan(std), relative * frequency, std)
    relative_only = bool(np.all(np.isnan(std)))
    if relative_only:
        std = WEIGHT * frequency
    elif np.any(np.isnan(std)):
        missing = frequency[np.isnan(std)][0]
        raise RecordingError(
            f"{where}: the mode at {missing:g} Hz has no frequency_std, others have. Give it, "
            "or frequency_std for all."
        )
    if np.any(std <= 0.0):
        raise RecordingError(f"{where}: a frequency_std is not positive.")
    return std, relative_only


def places_of(
    where: str, wanted: Sequence[Wanted], channels: Sequence[Channel]
) -> tuple[list[tuple[int, float]], tuple[Channel, ...]]:
    """Place in ``shape`` and factor (sign, scale) of each channel, and the channels: those
    ``wanted``, or ``channels`` in their order."""
    if channels:
        return [(place, 1.0) for place in range(len(channels))], tuple(channels)
    places, labels = [], []
    for want in wanted:
        if isinstance(want.column, str):
            raise RecordingError(
                f"{where}: {want.label}: the place of a mode shape's entry is a number."
            )
        channel = channel_of(Contents(where, "modes"), want)
        places.append((want.column, channel.scale))
        labels.append(channel)
    return places, tuple(labels)


def _shapes(
    where: str, modes: Sequence[ModeValues], places: Sequence[tuple[int, float]], count: int
) -> tuple[np.ndarray | None, Real | None]:
    if all(mode.shape is None for mode in modes):
        return None, None
    if not count:
        raise RecordingError(
            f"{where}: the modes have shapes, but channels does not say which node and dof "
            "each entry is."
        )
    is_complex = any(
        isinstance(entry, complex)
        for mode in modes
        if mode.shape is not None
        for entry in mode.shape
    )
    shapes = np.full((len(modes), count), np.nan, dtype=complex if is_complex else float)
    deviations = np.full((len(modes), count), np.nan)
    for m, mode in enumerate(modes):
        if mode.shape is None:
            continue
        for c, (place, factor) in enumerate(places):
            if not 0 <= place < len(mode.shape):
                raise RecordingError(
                    f"{where}: the shape at {mode.frequency:g} Hz has {len(mode.shape)} "
                    f"entries; channel column {place} is not one of them."
                )
            shapes[m, c] = mode.shape[place] * factor
            if mode.shape_std is not None:
                value = (
                    mode.shape_std
                    if isinstance(mode.shape_std, int | float)
                    else mode.shape_std[place]
                )
                deviations[m, c] = value * abs(factor)
    return shapes, None if np.all(np.isnan(deviations)) else deviations


def modes_of_contents(
    contents: Contents, names: Names, wanted: Sequence[Wanted] = ()
) -> tuple[list[ModeValues], tuple[Channel, ...]]:
    """Modes from a file: data sets 55 of a universal file, or arrays.

    Arrays: ``frequency`` (Hz) or ``eigenvalue`` (rad²/s²), with ``frequency_std`` or
    ``eigenvalue_std``, ``damping``, ``damping_std``; ``shape`` (modes, entries) or
    ``shape_columns`` (entries, modes), and likewise ``shape_std`` or ``shape_std_columns``. The
    deviation of λ = (2πf)² gives that of f by σ_f = σ_λ / (8π²f). Also returns the channels of the
    shapes where the file itself labels them (55).
    """
    if contents.shapes:
        return _from_shapes(contents)
    frequency, std = _frequencies(contents, names)
    count = frequency.size
    damping, damping_std = (_vector(contents, names, key) for key in ("damping", "damping_std"))
    for name, values in (
        ("frequency_std", std),
        ("damping", damping),
        ("damping_std", damping_std),
    ):
        if values is not None and values.size != count:
            raise RecordingError(
                f"{contents.file}: {count} frequencies, but {values.size} values of {name}."
            )
    shape, shape_std = (_matrix(contents, names, key, count) for key in ("shape", "shape_std"))
    if shape is not None and not wanted:
        shape = None  # without channels nobody knows where its entries are
    if shape is not None and shape_std is not None and shape.shape != shape_std.shape:
        raise RecordingError(
            f"{contents.file}: shape {shape.shape} and shape_std {shape_std.shape} do not agree."
        )
    return [
        ModeValues(
            float(frequency[m]),
            _entry(std, m),
            _entry(damping, m),
            _entry(damping_std, m),
            None if shape is None else list(shape[m].tolist()),
            None
            if shape is None or shape_std is None
            else [float(v) for v in np.real(shape_std[m])],
        )
        for m in range(count)
    ], ()


def _entry(values: Real | None, m: int) -> float | None:
    return None if values is None or np.isnan(values[m]) else float(values[m])


def _vector(contents: Contents, names: Names, name: str) -> Real | None:
    """One number for each mode, from an array or a named column; None where there is none."""
    array = contents.arrays.get(names[name])
    if array is None and names[name] in contents.columns:
        array = contents.arrays["data"][:, contents.columns.index(names[name])]
    if array is None:
        return None
    where = f"{contents.file}: {names[name]}"
    values = real_values(np.atleast_1d(np.squeeze(array)), where)
    if values.ndim != 1:
        raise RecordingError(
            f"{contents.file}: {names[name]!r} has shape {array.shape}; one number for each mode "
            "is needed."
        )
    return values


def _frequencies(contents: Contents, names: Names) -> tuple[Real, Real | None]:
    """Frequencies in Hz and their deviations, from eigenvalues where the file has those instead."""
    frequency, eigenvalue = (_vector(contents, names, key) for key in ("frequency", "eigenvalue"))
    std = _vector(contents, names, "frequency_std")
    if frequency is None and eigenvalue is not None:
        if np.any(eigenvalue <= 0.0):
            raise RecordingError(f"{contents.file}: an eigenvalue is not positive.")
        frequency = np.sqrt(eigenvalue) / (2.0 * np.pi)
        eigenvalue_std = _vector(contents, names, "eigenvalue_std")
        if eigenvalue_std is not None and eigenvalue_std.shape == frequency.shape:
            std = eigenvalue_std / (8.0 * np.pi**2 * frequency)
    if frequency is None:
        raise RecordingError(
            f"{contents.file}: there is no array 'frequency' (Hz) or 'eigenvalue' (rad²/s²) among "
            f"{', '.join(contents.arrays) or 'its data'}. Name it with variables."
        )
    return frequency, std


def _matrix(contents: Contents, names: Names, name: str, count: int) -> np.ndarray | None:
    """Shapes (modes, entries), turned where the file has them by columns; None without any."""
    rows, turned = (
        contents.arrays.get(names[name]),
        contents.arrays.get(names[f"{name}_columns"]),
    )
    array = rows if rows is not None else (turned.T if turned is not None else None)
    if array is not None and (
        array.ndim != 2 or array.shape[0] != count or array.dtype.kind not in "biufc"
    ):
        raise RecordingError(
            f"{contents.file}: {name} has shape {array.shape}; {count} modes were given. Use "
            "shape for (modes, entries) and shape_columns for (entries, modes)."
        )
    return array


def _from_shapes(contents: Contents) -> tuple[list[ModeValues], tuple[Channel, ...]]:
    """Data sets 55: DOFs that are zero in every mode were not measured and are left out."""
    first = contents.shapes[0]
    for shape in contents.shapes:
        if not np.array_equal(shape.nodes, first.nodes) or shape.values.shape != first.values.shape:
            raise RecordingError(
                f"{contents.file}: its mode shapes are not given at the same nodes. Export "
                "one set of modes."
            )
    used = np.any([shape.values != 0.0 for shape in contents.shapes], axis=0)
    channels = tuple(
        Channel(int(first.nodes[i]), DOF_KINDS[j], first.quantity)
        for i in range(used.shape[0])
        for j in range(used.shape[1])
        if used[i, j]
    )
    modes = [
        ModeValues(
            shape.frequency,
            None,
            None if np.isnan(shape.damping) else shape.damping,
            None,
            shape.values[used].tolist(),
        )
        for shape in contents.shapes
    ]
    return modes, channels
