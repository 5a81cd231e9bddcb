"""Which measured modes are those that the reference has, told by what was measured in both states:
a model that is off from both pairs them less surely than they pair with one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.correlate import pair_modes
from cvxupdate.diagnose.modes.common import ALIKE
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.book import AGAIN
from cvxupdate.residual.modal import modal_residual
from cvxupdate.residual.pairing import FAR
from cvxupdate.residual.shape_rows import real_shapes

Known = tuple[int, float, dict[str, float]]  # mode of the model, frequency (Hz), entries by label


def as_before(
    model: Model, tables: Sequence[ModeTable], before: Sequence[ModeTable]
) -> list[ModeTable]:
    """``tables``, the modes to fit that tables ``before`` have as well paired with the same mode of
    ``model`` as there; pairs that the file names stay, and modes without shapes as they are."""
    known = _known(model, before)
    taken: dict[int, float] = {}  # modes of the model, and at which frequency they were measured
    return [_paired(t, known, taken) if t.origin.use == "fit" else t for t in tables]


def _known(model: Model, before: Sequence[ModeTable]) -> list[Known]:
    """Each mode of the model that the reference shows in a table to fit, as it was first measured
    there."""
    fit = [t for t in before if t.origin.use == "fit"]
    point = modal_residual(model, fit, (), False).evaluate(model.zero())
    found: dict[int, Known] = {}
    for table, places in zip(fit, point.places, strict=True):
        for i, at in enumerate(places.tolist()):
            mode = int(at) - point.modes.rigid + 1
            if at >= 0 and mode > 0 and table.shapes is not None:
                found.setdefault(mode, (mode, float(table.frequency[i]), _entries(table, i)))
    return list(found.values())


def _entries(table: ModeTable, i: int) -> dict[str, float]:
    """Of one shape, by the labels of channels; without those that were not measured."""
    if table.shapes is None:
        return {}
    shape = real_shapes(table.shapes[i : i + 1])[0].tolist()
    return {c.label: x for c, x in zip(table.channels, shape, strict=True) if np.isfinite(x)}


def _paired(table: ModeTable, known: Sequence[Known], taken: dict[int, float]) -> ModeTable:
    """A table with the pairs that it has by its own measurements beside the reference's."""
    named, pairs = set(table.pairs[table.pairs > 0].tolist()), table.pairs.copy()
    free = [m for m in known if m[0] not in named]
    mine = [(i, own) for i in np.flatnonzero(pairs <= 0).tolist() if (own := _entries(table, i))]
    labels = [
        c.label
        for c in table.channels
        if all(c.label in m[2] for m in free) and all(c.label in own for _, own in mine)
    ]
    if not free or not mine or len(labels) < 2:
        return table
    phi: list[Real] = [
        np.array([[entries[label] for entries in some] for label in labels])
        for some in ([m[2] for m in free], [own for _, own in mine])
    ]
    f = np.array([m[1] for m in free]), table.frequency[[i for i, _ in mine]]
    found = pair_modes(phi[0], phi[1], f[0], f[1], threshold=ALIKE)
    apart = FAR * np.abs(np.log(f[0][found.model] / f[1][found.measured]))
    near = found.mac >= ALIKE + apart  # few sensors see many a mode alike
    for a, x in zip(found.model[near].tolist(), found.measured[near].tolist(), strict=True):
        mode, here = free[a][0], float(f[1][x])
        if abs(taken.setdefault(mode, here) - here) <= AGAIN * here:
            pairs[mine[x][0]] = mode
    return replace(table, pairs=pairs)
