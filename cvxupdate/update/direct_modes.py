"""Measured modes beside those of the matrices that a direct method made."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.correlate import mac
from cvxupdate.direct.result import DirectUpdate
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.shape_rows import channel_rows, real_shapes
from cvxupdate.update.direct_scene import Scene
from cvxupdate.update.outcome import finite
from cvxupdate.update.result import ModeResult

Real = NDArray[np.float64]
ALIKE = 0.02
"""Of MAC: what these places cannot tell apart goes by frequency."""
SYMMETRIC = 1e-9
"""Of the largest entry: asymmetry beyond rounding."""


def direct_modes(scene: Scene, made: DirectUpdate) -> tuple[ModeResult, ...]:
    """Measured modes beside those of the model and of the updated matrices: by MAC where shapes are
    known; else beside the model's mode that they are paired with, and the one nearest to its
    shape."""
    frequency, shapes = natural(made)
    before = np.sqrt(np.maximum(scene.modes.eigenvalues, 0.0)) / (2.0 * np.pi)
    rigid = scene.modes.rigid
    out = []
    for table, places in zip(scene.tables, scene.places, strict=True):
        rows = channel_rows(table, scene.model) if table.shapes is not None else None
        for i, f in enumerate(table.frequency.tolist()):
            if rows is not None:
                a, mac_a = _nearest(table, i, rows, before, scene.modes.shapes)
                b, mac_b = _nearest(table, i, rows, frequency, shapes)
            elif places[i] < 0:
                continue
            else:
                a, mac_a = int(places[i]), float("nan")
                own = scene.modes.shapes[:, a][:, None]
                b, mac_b = _most_like(mac(shapes, own)[:, 0], frequency, f), float("nan")
            out.append(
                ModeResult(
                    table.origin.name,
                    table.origin.use,
                    f,
                    float(table.frequency_std[i]),
                    float(before[a]),
                    float(frequency[b]),
                    100.0 * abs(float(before[a]) - f) / f,
                    100.0 * abs(float(frequency[b]) - f) / f,
                    a - rigid + 1,
                    b - rigid + 1,
                    finite(mac_a),
                    finite(mac_b),
                )
            )
    return tuple(out)


def natural(made: DirectUpdate) -> tuple[Real, Real]:
    """Frequencies (Hz) and shapes of the updated matrices, lowest first; undamped. Matrices that
    are not symmetric or not definite have them all the same, eigenvalues below zero at 0 Hz."""
    symmetric = all(np.abs(A - A.T).max() <= SYMMETRIC * np.abs(A).max() for A in (made.K, made.M))
    try:
        if not symmetric:
            raise la.LinAlgError
        values, vectors = la.eigh(0.5 * (made.K + made.K.T), 0.5 * (made.M + made.M.T))
    except la.LinAlgError:
        wide, wider = la.eig(made.K, made.M)
        keep = np.isfinite(wide) & (np.abs(wide.imag) <= 1e-6 * np.abs(wide))
        rank = np.argsort(wide[keep].real)
        values, vectors = wide[keep].real[rank], wider[:, keep].real[:, rank]
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), np.asarray(vectors)


def _nearest(
    table: ModeTable, i: int, rows: NDArray[np.int64], frequency: Real, shapes: Real
) -> tuple[int, float]:
    f = float(table.frequency[i])
    if table.shapes is not None:
        shape = real_shapes(table.shapes)[i]
        ok = (rows >= 0) & np.isfinite(shape)
        if ok.sum() >= 2:
            likeness = mac(shapes[rows[ok]], shape[ok][:, None])[:, 0]
            best = _most_like(likeness, frequency, f)
            return best, float(likeness[best])
    return int(np.argmin(np.abs(frequency - f))), float("nan")


def _most_like(likeness: Real, frequency: Real, f: float) -> int:
    alike = np.flatnonzero(likeness > likeness.max() - ALIKE)
    return int(alike[np.argmin(np.abs(frequency[alike] - f))])
