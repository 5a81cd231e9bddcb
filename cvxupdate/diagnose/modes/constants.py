"""Modal constants φ_r φ_d of FRFs beside those of a model: logarithms, and how far each may be off.

A sensor, or a drive, that stands beside its node changes all modes at once, by their slopes there;
what a sound model misses of a shape at the drive changes all responses of that mode; a mass that is
off changes everything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from cvxupdate.diagnose.modes.identified import Identified
from cvxupdate.diagnose.modes.mixing import slopes_of
from cvxupdate.diagnose.settings import BESIDE, MASS_STD, SHAPE_DISCREPANCY
from cvxupdate.diagnose.types import Real
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint, modal_residual
from cvxupdate.residual.shape_rows import channel_rows

LEAST = 1.0 / 3.0  # deviation of the logarithm of a constant above which it is not compared
FEWEST = 3  # modes: a factor in fewer is no gain


@dataclass(frozen=True)
class _Row:
    """One constant: where it belongs (``mode``: table and row), its logarithm over the model's, and
    parts of its relative deviation: by itself (``own``), of the mode at the drive (``driven``), and
    by each direction in which sensor and drive may stand beside their nodes."""

    mode: tuple[int, int]
    sensor: str
    drive: str
    log: float
    own: float
    driven: float
    sensor_off: tuple[float, ...]
    drive_off: tuple[float, ...]

    @property
    def where(self) -> tuple[tuple[int, int], str, str]:
        """Mode, sensor and drive."""
        return self.mode, self.sensor, self.drive

    @property
    def deviation(self) -> float:
        """Of all of them."""
        return float(np.linalg.norm([self.own, self.driven, *self.sensor_off, *self.drive_off]))


@dataclass(frozen=True)
class Constants:
    """Logarithms of measured over computed constants, (n,), whitened (``y``), and what one unit of
    each gain's logarithm adds to them, (n, gains), likewise, by ``names``: ("gain", sensor),
    ("force", drives…); the ``rows`` behind them with their covariance, (n, n)."""

    y: Real
    X: Real
    names: tuple[tuple[str, ...], ...]
    rows: tuple[_Row, ...]
    covariance: Real

    @property
    def modes(self) -> tuple[tuple[int, int], ...]:
        """(table, row) of each mode."""
        return tuple(dict.fromkeys(r.mode for r in self.rows))

    def without(self, mode: tuple[int, int]) -> Constants | None:
        """Those of the other modes; None where these are too few."""
        kept = np.flatnonzero([r.mode != mode for r in self.rows])
        return _whitened([self.rows[k] for k in kept], self.covariance[np.ix_(kept, kept)])


def constants_of(
    point: ModalPoint, found: Sequence[Identified], others: Sequence[ModalPoint] = ()
) -> Constants | None:
    """Those of the fitted tables of a point, which are ``found`` in the same order; None where
    there are too few. ``others``: the point as it may be as well."""
    rows = _all_rows(point, found)
    if not rows:
        return None
    covariance = _covariance(rows)
    for other in others:
        apart = _moved(rows, _all_rows(other, found))
        covariance += np.outer(apart, apart)
    return _whitened(rows, covariance)


def beside(point: ModalPoint, found: Sequence[Identified]) -> ModalPoint:
    """The same model beside other tables."""
    tables = [own.table for own in found]
    return modal_residual(point.residual.model, tables, (), shapes=False).evaluate(point.p)


def _whitened(rows: Sequence[_Row], covariance: Real) -> Constants | None:
    """With a column of each gain that `FEWEST` modes tell; None where there is none."""
    sensors = tuple(dict.fromkeys(r.sensor for r in rows))
    drives = tuple(dict.fromkeys(r.drive for r in rows))
    named: list[tuple[tuple[str, ...], list[bool]]] = [
        (("gain", s), [r.sensor == s for r in rows]) for s in sensors
    ]
    named.append((("force", *drives), [True] * len(rows)))
    if len(drives) > 1:
        named += [(("force", d), [r.drive == d for r in rows]) for d in drives]
    modes = [{r.mode for r, own in zip(rows, of, strict=True) if own} for _, of in named]
    kept = [pair for pair, own in zip(named, modes, strict=True) if len(own) >= FEWEST]
    if not kept:
        return None
    factor = cholesky(covariance, lower=True)
    columns = np.array([of for _, of in kept], dtype=float).T
    return Constants(
        solve_triangular(factor, [r.log for r in rows], lower=True),
        solve_triangular(factor, columns, lower=True),
        tuple(name for name, _ in kept),
        tuple(rows),
        covariance,
    )


def _all_rows(point: ModalPoint, found: Sequence[Identified]) -> list[_Row]:
    return [r for k, own in enumerate(found) for r in _rows(point, k, own)]


def _rows(point: ModalPoint, k: int, found: Identified) -> list[_Row]:
    model, table = point.residual.model, found.table
    sensors = channel_rows(table, model).tolist()
    drives = [model.place.get(c.label, -1) for c in found.drives]
    turns = {c.label: slopes_of(model, c) for c in (*table.channels, *found.drives)}
    out = []
    for i, at in enumerate(point.places[k].tolist()):
        own = np.append(point.modes.shapes[:, at], 0.0)
        largest = float(np.max(np.abs(own[[*sensors, *drives]])))
        noise = _relative(table, i)
        for d, drive in enumerate(found.drives):
            for r, sensor in enumerate(table.channels):
                here, there = own[sensors[r]], own[drives[d]]
                computed = here * there
                if at < 0 or not found.constants[i, r, d] * computed > 0.0:
                    continue
                row = _Row(
                    (k, i),
                    sensor.label,
                    drive.label,
                    float(np.log(found.constants[i, r, d] / computed)),
                    float(np.hypot(SHAPE_DISCREPANCY * largest / abs(here), noise[r])),
                    float(SHAPE_DISCREPANCY * largest / abs(there)),
                    tuple((BESIDE * own[turns[sensor.label]] / here).tolist()),
                    tuple((BESIDE * own[turns[drive.label]] / there).tolist()),
                )
                if row.deviation < LEAST:
                    out.append(row)
    return out


def _moved(rows: Sequence[_Row], there: Sequence[_Row]) -> Real:
    """By how much the logarithms differ at another point, (n,); nothing where that has no such
    row."""
    logs = {r.where: r.log for r in there}
    return np.array([logs.get(r.where, r.log) - r.log for r in rows])


def _relative(table: ModeTable, mode: int) -> Real:
    """Deviations of a shape's entries, as parts of them, (channels,)."""
    if table.shapes is None or table.shape_std is None:
        return np.zeros(len(table.channels))
    size = np.abs(table.shapes[mode])
    std = np.broadcast_to(table.shape_std, table.shapes.shape)[mode]
    return np.asarray(std / np.where(size > 0.0, size, np.inf))


def _covariance(rows: Sequence[_Row]) -> Real:
    """Of the logarithms: what a mass that is off does to all, what a shape misses at the drive to
    one mode, what stands beside its node to all modes there."""
    driven = np.array([r.driven for r in rows])
    out = np.diag([r.own**2 for r in rows]) + MASS_STD**2
    out += _same([f"{r.mode} {r.drive}" for r in rows]) * np.outer(driven, driven)
    out += _same([r.sensor for r in rows]) * _products([r.sensor_off for r in rows])
    return out + _same([r.drive for r in rows]) * _products([r.drive_off for r in rows])


def _same(labels: Sequence[str]) -> Real:
    """1 where two rows have the same label, else 0, (rows, rows)."""
    of = np.array(labels)
    return np.asarray(of[:, None] == of[None, :], dtype=float)


def _products(off: Sequence[tuple[float, ...]]) -> Real:
    """Of what the directions in which something may stand beside its node make of each row."""
    by = np.zeros((len(off), max(len(x) for x in off)))
    for row, x in zip(by, off, strict=True):
        row[: len(x)] = x
    return np.asarray(by @ by.T)
