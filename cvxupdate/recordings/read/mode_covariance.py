"""The covariance of a table of modes: found in a file, refused where it is none, and brought into
the table's order.

As declared it is of the frequencies in the order of the rows, [Hz²], or of those and then of the
entries of every shape, row by row, as the rows have them. In a `ModeTable` the shapes' part is by
channel, in SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.to_modes import ModeValues
from cvxupdate.recordings.read.wanted import Names, real_values
from cvxupdate.recordings.types import Real

SYMMETRIC = 1e-6  # of σᵢσⱼ: digits that a text file may have dropped
NEGATIVE = 1e-5  # least eigenvalue of the correlations that may be rounding
AGREE = 0.01  # deviations stated twice
ARRAY = "covariance"


def covariance_of(
    declared: Path | Sequence[Sequence[float]] | None,
    contents: Contents | None,
    names: Names,
    modes: Sequence[ModeValues],
    where: str,
) -> Real | None:
    """The covariance that a recording names, or that stands beside its modes in ``contents`` as
    an array ``covariance``; symmetric, of ``modes`` in their order; None where there is none.

    Beside ``eigenvalue`` in place of ``frequency`` an array is of the eigenvalues, [(rad/s)⁴].

    Raises
    ------
    RecordingError
        Where it is no covariance of these modes.
    """
    if isinstance(declared, Path):
        where = str(declared)
        C = _in_file(declared, names)
    elif declared is not None:
        where = f"{where}: covariance"
        if len({len(row) for row in declared} | {len(declared)}) > 1:
            raise RecordingError(f"{where}: its rows are not as long as there are rows.")
        C = np.array(declared, dtype=float)
    elif contents is not None and names[ARRAY] in contents.arrays:
        where = f"{contents.file}: {names[ARRAY]}"
        C = real_values(contents.arrays[names[ARRAY]], where)
        if C.ndim == 2 and len(C) >= len(modes) and names["frequency"] not in contents.arrays:
            rate = np.ones(len(C))
            rate[: len(modes)] = 1.0 / (8.0 * np.pi**2 * np.array([m.frequency for m in modes]))
            C = C * np.outer(rate, rate) if C.shape == (len(C), len(C)) else C
    else:
        return None
    _check(C, modes, where)
    return np.asarray((C + C.T) / 2.0)


def _in_file(path: Path, names: Names) -> Real:
    contents = read_file(path)
    if contents.damage or contents.cut:
        said = (contents.damage or contents.cut)[0]
        raise RecordingError(f"{path}: {said}. Export the covariance again.")
    square = {k: v for k, v in contents.arrays.items() if v.ndim == 2}
    name = names[ARRAY] if names[ARRAY] in square else next(iter(square), "")
    if not name or (len(square) > 1 and name != names[ARRAY]):
        raise RecordingError(
            f"{path}: there is no array {names[ARRAY]!r} of two axes among "
            f"{', '.join(contents.arrays) or 'its data'}. Name it with variables."
        )
    return real_values(square[name], f"{path}: {name}")


def _check(C: Real, modes: Sequence[ModeValues], where: str) -> None:
    n, entries = len(modes), sum(widths(modes))
    allowed = {(n, n), (n + entries, n + entries)}
    if C.shape not in allowed:
        both = f", or {n + entries} × {n + entries} with the {entries} entries of their shapes"
        raise RecordingError(
            f"{where}: is {' × '.join(map(str, C.shape))}; {n} frequencies need {n} × {n}"
            f"{both if entries else ''}, in the order of the rows."
        )
    if not np.all(np.isfinite(C)):
        raise RecordingError(f"{where}: an entry is no finite number.")
    variance = np.diag(C)
    if np.any(variance < 0.0) or np.any(variance[:n] == 0.0):
        at = int(
            np.flatnonzero((variance < 0.0) | ((variance == 0.0) & (np.arange(len(C)) < n)))[0]
        )
        raise RecordingError(
            f"{where}: the variance in row {at + 1} is {variance[at]:g}. One of a frequency is "
            "above 0, one of a shape's entry 0 only where it is fixed by normalisation."
        )
    std = np.sqrt(variance)
    scale = np.where(std > 0.0, std, std[std > 0.0].min())
    R = C / np.outer(scale, scale)
    skew = np.abs(R - R.T)
    if skew.max() > SYMMETRIC:
        i, j = np.unravel_index(int(np.argmax(skew)), skew.shape)
        raise RecordingError(
            f"{where}: is not symmetric: entry ({i + 1}, {j + 1}) is {C[i, j]:g}, "
            f"({j + 1}, {i + 1}) is {C[j, i]:g}."
        )
    least = float(np.linalg.eigvalsh((R + R.T) / 2.0)[0])
    if least < -NEGATIVE:
        raise RecordingError(
            f"{where}: is not positive semidefinite: the least eigenvalue of its correlations is "
            f"{least:.2g}, so some combination would have a negative variance."
        )
    if len(C) > n and any(isinstance(v, complex) for m in modes for v in m.shape or ()):
        raise RecordingError(
            f"{where}: is of real entries, but the shapes are complex. Give the covariance of the "
            f"frequencies alone ({n} × {n}), or normal modes (`identify --normal`)."
        )
    _check_deviations(std[:n], modes, where)


def _check_deviations(std: Real, modes: Sequence[ModeValues], where: str) -> None:
    """Deviations of frequencies that may be meant, and are not stated otherwise."""
    for mode, found in zip(modes, std.tolist(), strict=True):
        if found >= mode.frequency:
            raise RecordingError(
                f"{where}: gives the mode at {mode.frequency:.5g} Hz a deviation of {found:.3g} "
                "Hz. Its part of the frequencies is in Hz²."
            )
        told = mode.frequency_std
        if told is not None and abs(told - found) > AGREE * found:
            raise RecordingError(
                f"{where}: gives the mode at {mode.frequency:.5g} Hz a deviation of {found:.4g} "
                f"Hz, its row {told:.4g} Hz. Leave frequency_std out, or correct one of them."
            )


def widths(modes: Sequence[ModeValues]) -> list[int]:
    """How many entries the shape of each mode has; 0 without one."""
    return [0 if mode.shape is None else len(mode.shape) for mode in modes]


def chosen(C: Real, modes: Sequence[ModeValues], which: Sequence[int]) -> Real:
    """The covariance of those of ``modes`` whose numbers are ``which``, in that order."""
    n = len(modes)
    at = list(which)
    if len(C) > n:
        size = widths(modes)
        begin = n + np.concatenate([[0], np.cumsum(size)[:-1]]).astype(int)
        at += [int(begin[i]) + k for i in which for k in range(size[i])]
    return np.asarray(C[np.ix_(at, at)])


def told(modes: Sequence[ModeValues], C: Real) -> list[ModeValues]:
    """The modes with the deviations of their covariance."""
    n, std, size = len(modes), np.sqrt(np.diag(C)).tolist(), widths(modes)
    out = [replace(mode, frequency_std=std[m]) for m, mode in enumerate(modes)]
    if len(C) > n:
        begin = n + np.concatenate([[0], np.cumsum(size)]).astype(int)
        spread = [std[begin[m] : begin[m + 1]] or None for m in range(n)]
        out = [replace(mode, shape_std=s) for mode, s in zip(out, spread, strict=True)]
    return out


def by_channel(C: Real, modes: Sequence[ModeValues], places: Sequence[tuple[int, float]]) -> Real:
    """The covariance of the frequencies and of the shapes at the channels, (modes × (1 + channels),
    same), NaN for a mode without shape; ``places`` are place and factor of each channel."""
    n = len(modes)
    if len(C) == n:
        return C
    size = widths(modes)
    begin = n + np.concatenate([[0], np.cumsum(size)[:-1]]).astype(int)
    at = np.arange(n * (1 + len(places)))
    factor = np.concatenate([np.ones(n), np.tile([f for _, f in places], n)])
    for m in range(n):
        for c, (place, _) in enumerate(places):
            known = 0 <= place < size[m]
            at[n + m * len(places) + c] = begin[m] + place if known else -1
    out = C[np.ix_(at, at)] * np.outer(factor, factor)
    out[at < 0] = np.nan
    out[:, at < 0] = np.nan
    return np.asarray(out)
