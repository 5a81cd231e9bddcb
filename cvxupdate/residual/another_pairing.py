"""Another pairing of measured modes whose partner was a guess, once the model has come nearer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate.fe.elements.base import Real
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.residual.pairing import Start
from cvxupdate.residual.repeated import clusters
from cvxupdate.residual.shape_rows import channel_rows, real_shapes

ALIKE = 0.05  # of MAC: as much as noise and a few sensors make


def another_pairing(point: ModalPoint) -> Start | None:
    """Another pairing of those fitted modes whose partner was a guess, with the modes of the model
    as it is at ``point``.

    Modes paired by frequency alone may go to any mode that no other measured mode has; modes that
    shared a repeated eigenvalue at the start may change places among themselves (which was which
    meant nothing there). The assignment of least weighted squared eigenvalue differences; None
    where that is the pairing at hand.
    """
    fit, start = point.residual.fit, point.residual.start
    every = [
        (k, i)
        for k, places in enumerate(point.places[: len(fit)])
        for i in np.flatnonzero(places >= 0).tolist()
    ]
    held = {int(point.places[k][i]) for k, i in every if not (start.loose and start.loose[k][i])}
    mine: dict[
        int, list[tuple[int, int]]
    ] = {}  # place → who is there: one mode in several tables stays together
    for k, i in every:
        mine.setdefault(int(point.places[k][i]), []).append((k, i))
    loose = [at for at in mine if at not in held]
    free = [i for i in range(point.modes.rigid, len(point.modes.eigenvalues)) if i not in held]
    groups = [(loose, free)]
    for at in clusters(start.modes):
        alike = [
            place
            for place, who in mine.items()
            if place in held and all(start.places[k][i] in at for k, i in who)
        ]
        groups.append((alike, alike))
    places = [q.copy() for q in point.places]
    for who, where in groups:
        f = point.modes.frequencies[where]
        cost = np.array(
            [np.sum([_distance(fit[k], i, f) for k, i in mine[at]], axis=0) for at in who]
        ).reshape(len(who), len(where))
        for x, a in zip(*linear_sum_assignment(cost), strict=True):
            for k, i in mine[who[int(x)]]:
                places[k][i] = where[int(a)]
    if all(np.array_equal(new, old) for new, old in zip(places, point.places, strict=True)):
        return None
    return Start(point.modes, tuple(places), start.loose)


def nearest_pairing(point: ModalPoint) -> ModalPoint:
    """The same model with every fitted mode paired anew, by least weighted squares of eigenvalues
    and shape entries: modes that a gross effect mixes are not told by following the model's own.

    Modes that are only scored go with a fitted one that they shared; else another that looks as
    they do may be nearer by now: a few sensors see alike what are different modes.
    """
    fit, modes, places = point.residual.fit, point.modes, [q.copy() for q in point.places]
    shapes: dict[tuple[int, int], Real] = {}
    if point.residual.shapes:
        for k, i, _, rows, x, std in point.shape_rows():
            shapes[k, i] = shape_distances(modes.shapes[rows][None], x, std)[0]
    went: dict[int, int] = {}
    for k, table in enumerate(fit):
        who = np.flatnonzero(places[k] >= 0).tolist()
        cost = np.array(
            [_distance(table, i, modes.frequencies) + shapes.get((k, i), 0.0) for i in who]
        )
        cost = cost.reshape(len(who), -1)
        if cost.shape[1] - modes.rigid >= len(who):
            cost[:, : modes.rigid] = np.inf  # measured modes swing
        for x, a in zip(*linear_sum_assignment(cost), strict=True):
            went[int(places[k][who[int(x)]])] = int(a)
            places[k][who[int(x)]] = a
    taken = set(went.values())
    for k, table in enumerate(point.residual.hold_out, len(fit)):
        moved = [_moved(int(at), went, taken) for at in places[k]]
        for i, (at, now) in enumerate(zip(places[k].tolist(), moved, strict=True)):
            if now >= 0 and at not in went:
                others = {a for j, a in enumerate(moved) if j != i}
                moved[i] = _nearest(point, table, i, now, taken | others)
        places[k] = np.array(moved, dtype=np.int64)
    return replace(point, places=tuple(places))


def _moved(at: int, went: dict[int, int], taken: set[int]) -> int:
    return went.get(at, -1 if at in taken else at)


def _nearest(point: ModalPoint, table: ModeTable, i: int, at: int, taken: set[int]) -> int:
    """Of the modes that none has, the nearest in frequency that looks like a measured one at least
    as much as the one ``at`` which it is, to within `ALIKE`; itself where it has no shape."""
    x = np.full(0, np.nan) if table.shapes is None else real_shapes(table.shapes[i : i + 1])[0]
    rows = channel_rows(table, point.residual.model) if len(x) else np.zeros(0, dtype=np.int64)
    on = np.isfinite(x) & (rows >= 0)
    if on.sum() < 2:
        return at
    phi, x = point.modes.shapes[rows[on]], x[on]
    size = np.maximum(np.sum(phi**2, axis=0) * float(x @ x), np.finfo(float).tiny)
    likeness = (x @ phi) ** 2 / size
    free = [
        m
        for m in range(point.modes.rigid, len(likeness))
        if m not in taken and likeness[m] >= likeness[at] - ALIKE
    ]
    f = point.modes.frequencies
    return min(free, key=lambda m: abs(float(f[m]) - float(table.frequency[i])), default=at)


def shape_distances(phi: Real, x: Real, std: Real) -> Real:
    """Weighted squares (n, m) that are left of measured entries ``x`` (DOFs,) of deviations
    ``std`` beside each of the shapes ``phi`` (n, DOFs, m), scaled to them; of a shape that moves
    none of the DOFs all of them."""
    w = 1.0 / std**2
    along = np.einsum("d,ndm->nm", w * x, phi)
    size = np.maximum(np.einsum("d,ndm->nm", w, phi**2), np.finfo(float).tiny)
    return np.asarray(np.maximum(np.sum(w * x**2) - along**2 / size, 0.0))


def _distance(table: ModeTable, i: int, frequencies: Real) -> Real:
    """Weighted squared difference of eigenvalues between a measured mode and modes of the model."""
    f, std = float(table.frequency[i]), float(table.frequency_std[i])
    return np.asarray(((frequencies**2 - f**2) / (2.0 * f * std)) ** 2)
