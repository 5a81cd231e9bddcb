"""Modes followed to where a fit begins far from today's model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.another_pairing import nearest_pairing
from cvxupdate.residual.follow import follow
from cvxupdate.residual.modal import ModalPoint, ModalResidual
from cvxupdate.residual.repeated import aligned

STEPS = 16  # sizes on the way, in geometric progression
APART = 1e-10  # relative differences of shapes in their mass that are rounding


def followed(residual: ModalResidual, start: Real) -> ModalResidual:
    """Pairs modes at ``start``, where a fit begins far off, by following them there step by step:
    one large step may mistake them.

    On the way they are sought in the space of the modes at both ends (Ritz). Modes that veer change
    their shapes but not their order, so without measured shapes the order is another way to pair
    them; a third is the nearest measured mode there; and the best one counts.

    Raises
    ------
    ModelError
        A model that is no structure there.
    """
    point = residual.evaluate(start, _nearly(residual, residual.evaluate(start)))
    ways = [point, nearest_pairing(point)]
    if not residual.shapes:
        ways.append(replace(point, places=residual.start.places))
    best = min(ways, key=lambda way: float(np.sum((way.differences[1] * way.differences[0]) ** 2)))
    return replace(residual, start=replace(residual.start, modes=best.modes, places=best.places))


def _nearly(residual: ModalResidual, end: ModalPoint) -> ModalPoint:
    """The last point before ``end`` on the way there from today's model, in `STEPS` steps, its
    modes in the space of those at both ends."""
    begin, count = residual.start, len(end.modes.eigenvalues)
    basis = _independent(np.hstack([begin.modes.shapes, end.modes.shapes]), end.matrices.M)
    fitted = _used(begin.places[: len(residual.fit)])
    # a fitted mode that was measured again goes with it
    scored = np.setdiff1d(_used(begin.places), fitted)
    now = first = np.concatenate([fitted, scored])
    modes = Modes(
        begin.modes.eigenvalues, basis.T @ (end.matrices.M @ begin.modes.shapes), begin.modes.rigid
    )
    for size in np.geomspace(1e-4, 1.0, STEPS)[:-1]:
        m = residual.model.matrices(size * end.p)
        K, M = (basis.T @ (x @ basis) for x in (m.K, m.M))
        values, V = la.eigh((K + K.T) / 2.0, (M + M.T) / 2.0)
        held, mass = modes.shapes[:, now], sp.csc_array(M)
        modes = aligned(
            Modes(values[:count], V[:, :count], end.modes.rigid), replace(m, M=mass), held
        )
        taken = follow(held[:, : len(fitted)], mass, modes)
        now = np.concatenate([taken, follow(held[:, len(fitted) :], mass, modes, taken)])
    went = {-1: -1} | dict(zip(first.tolist(), now.tolist(), strict=True))
    places = tuple(np.array([went[i] for i in q.tolist()], dtype=np.int64) for q in begin.places)
    return replace(end, modes=replace(modes, shapes=basis @ modes.shapes), places=places)


def _used(places: Sequence[Index]) -> Index:
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *places]))
    return every[every >= 0]


def _independent(shapes: Real, M: sp.csc_array) -> Real:
    """Columns (N, q) that span the same as ``shapes`` (N, n), orthonormal in M, those left out that
    rounding alone tells from the others."""
    shapes = shapes / np.sqrt(np.einsum("ij,ij->j", shapes, M @ shapes))
    values, vectors = la.eigh(shapes.T @ (M @ shapes))
    keep = values > APART * values[-1]
    return np.asarray(shapes @ (vectors[:, keep] / np.sqrt(values[keep])))
