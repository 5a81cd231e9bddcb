"""The weighted rows of single modes, and the pairing that makes their squares least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
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


def scored_by_frequency(
    hold: Sequence[ModeTable],
    loose: Sequence[NDArray[np.bool_]],
    places: Sequence[Index],
    modes: Modes,
) -> tuple[Index, ...]:
    """``places`` (of the tables to fit, then of those to ``hold`` out) with every held-out mode
    that frequency alone pairs (``loose``) found again by its frequency: of a model that has come
    nearer it may be another. Among the modes that no fitted one has, and no other of its table;
    where it is a fitted one measured again, it stays that."""
    if not (hold and loose):
        return tuple(places)
    fitted = set(np.concatenate([np.zeros(0, dtype=np.int64), *places[: -len(hold)]]).tolist())
    out = list(places)
    for k, table in enumerate(hold, len(places) - len(hold)):
        own = places[k]
        who = [i for i in np.flatnonzero(loose[k]).tolist() if int(own[i]) not in fitted | {-1}]
        taken = fitted | {int(own[i]) for i in range(len(own)) if i not in who}
        free = np.array(
            [i for i in range(modes.rigid, len(modes.eigenvalues)) if i not in taken], dtype=int
        )
        if not who or len(free) < len(who):
            continue
        cost = modes.frequencies[free] / table.frequency[who][:, None] - 1.0
        mine, partners = linear_sum_assignment(cost**2)
        out[k] = own.copy()
        out[k][np.array(who)[mine]] = free[partners]
    return tuple(out)
