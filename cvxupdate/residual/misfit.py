"""The weighted rows of single modes, and the pairing that makes their squares least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.shape_forms import ShapeForm
from cvxupdate.residual.shape_gradients import ShapeRow
from cvxupdate.residual.shape_rows import Index


def eigenvalue_row(table: ModeTable, i: int) -> tuple[float, float]:
    """(measured eigenvalue in (rad/s)², one over its deviation 2 λ σ_f / f)."""
    f = float(table.frequency[i])
    measured = (2.0 * np.pi * f) ** 2
    return measured, f / (2.0 * measured * float(table.frequency_std[i]))


def least_misfit(
    fit: Sequence[ModeTable],
    places: Sequence[Index],
    modes: Modes,
    shapes: Sequence[ShapeRow],
    form: ShapeForm,
    shape_weight: float,
) -> tuple[Index, ...]:
    """``places`` with the modes of the tables ``fit``, the first of them, paired anew so that the
    sum of weighted squares is least.

    Of shapes that have nothing in common the misfit is very large, so that frequency alone never
    pairs them.
    """
    known = {(s.table, s.mode): s for s in shapes}
    flexible = np.arange(modes.rigid, len(modes.eigenvalues))
    out = list(places)
    for k, table in enumerate(fit):
        who = np.flatnonzero(places[k] >= 0)
        cost = np.zeros((len(who), len(flexible)))
        for a, i in enumerate(who.tolist()):
            measured, weight = eigenvalue_row(table, i)
            cost[a] = (weight * (modes.eigenvalues[flexible] - measured)) ** 2
            if (k, i) in known:
                s = known[k, i]
                phi = modes.shapes[np.ix_(s.sensors, flexible)]
                cost[a] += shape_weight**2 * form.misfits(phi, s.measured, s.std)
        mine, partners = linear_sum_assignment(cost)
        out[k] = places[k].copy()
        out[k][who[mine]] = flexible[partners]
    return tuple(out)
