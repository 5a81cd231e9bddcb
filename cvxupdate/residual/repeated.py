"""Repeated eigenvalues: their shapes are determined only up to a rotation among themselves, which
is settled here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.shape_rows import Index, shape_entries

REPEATED = 1e-6  # relative distance of eigenvalues below which a single shape means nothing
IN_SPAN = 0.8  # share of a measured shape that must lie in the span of repeated ones to turn them


def clusters(modes: Modes) -> list[Index]:
    """Places of the flexible modes whose eigenvalues are repeated (closer than 1e-6), cluster by
    cluster."""
    values = modes.eigenvalues[modes.rigid :]
    together = np.diff(values) < REPEATED * np.abs(values[1:])
    return [
        run + modes.rigid
        for run in np.split(np.arange(len(values)), np.flatnonzero(~together) + 1)
        if len(run) > 1
    ]


def turned(modes: Modes, at: Index, Q: Real) -> Modes:
    """``modes`` with the shapes of one cluster turned by Q (r, r)."""
    shapes = modes.shapes.copy()
    shapes[:, at] = shapes[:, at] @ Q
    return Modes(modes.eigenvalues, shapes, modes.rigid)


def aligned(modes: Modes, m: Matrices, before: Real) -> Modes:
    """Shapes of repeated eigenvalues turned as near as possible to those ``before`` (N, b) that
    became them (orthogonal Procrustes in M)."""
    for at in clusters(modes):
        overlap = modes.shapes[:, at].T @ (m.M @ before)
        share = np.sum(overlap**2, axis=0)
        mine = sorted(
            b for b in np.argsort(-share)[: len(at)].tolist() if share[b] > 0.5
        )  # in their own order: equal shares have none
        if mine:
            U, _, Vt = np.linalg.svd(overlap[:, mine])
            k = len(mine)
            modes = turned(modes, at, np.column_stack([U[:, :k] @ Vt, U[:, k:]]))
    return modes


def oriented(
    modes: Modes, model: Model, tables: Sequence[ModeTable]
) -> tuple[Modes, frozenset[int]]:
    """Shapes of repeated eigenvalues turned to the measured shapes that lie in their span: (modes,
    first place of each cluster turned).

    Any rotation of such shapes is as good as another for the model; the recordings say which one
    the structure has.
    """
    done = set()
    for at in clusters(modes):
        found = []
        for k, table in enumerate(tables):
            for i in range(len(table.frequency)):
                rows, x = shape_entries(model, table, i)
                if len(rows) > len(at):
                    B = modes.shapes[np.ix_(rows, at)]
                    q = np.linalg.lstsq(B, x, rcond=None)[0]
                    found.append(
                        (
                            float(np.sum((x - B @ q) ** 2) / np.sum(x**2)),
                            k,
                            i,
                            q / (np.linalg.norm(q) or 1.0),
                        )
                    )
        chosen: list[tuple[float, int, int, Real]] = []
        for one in sorted(found, key=lambda item: item[:3]):
            if (
                one[0] < 1.0 - IN_SPAN
                and len(chosen) < len(at)
                and all(abs(one[3] @ other[3]) < 0.7 for other in chosen)
            ):
                chosen.append(one)
        if chosen:
            U, _, Vt = np.linalg.svd(
                np.column_stack([one[3] for one in sorted(chosen, key=lambda item: item[1:3])])
            )
            k = len(chosen)
            modes = turned(modes, at, np.column_stack([U[:, :k] @ Vt, U[:, k:]]))
            done.add(int(at[0]))
    return modes, frozenset(done)
