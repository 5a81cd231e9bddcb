"""Where the single parameters are most probable: the point from which groups are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import P_VALUES
from cvxupdate.recordings.types import Recording
from cvxupdate.registry import REGULARISERS
from cvxupdate.spec import Spec
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.first import first_system
from cvxupdate.update.grouping.seen import Seen, seen
from cvxupdate.update.invisible import invisible

LIKELY = 0.2
"""Deviation of a single p before anything is recorded: errors that updating looks for are 8 to 30 %
(thesis, chapter 8). It is the prior of the search for groups alone, not of the update."""
UNIT = 1.0
"""The same, of a property that is nothing today, in units of its `scale`."""
LOOSE = 2.0
"""Factor between the deviations that the rows really have and those that weighted the prior, above
which the point is sought anew with them: overstated ones leave everything to the prior, understated
ones nothing."""
PASSES = 3
LEAST = 1e-6
"""Weight of the prior at least: something must choose what no recording sees."""


@dataclass(frozen=True, eq=False)
class Best:
    """``p`` (n,) and the ``system`` linearised there, what it says of the columns (``known``)."""

    p: Array
    system: LinearSystem
    known: Seen


def most_probable(
    spec: Spec, model: Model, recordings: Sequence[Recording], columns: Sequence[int]
) -> Best:
    """The maximum a posteriori of all parameters, those of ``columns`` with a prior about the file.

    The first linear system would do where the mismatch is small; h enters a plate by its cube, and
    a resonance that crosses a line is far from linear. Methods ceam and modal-dynamic
    keep the first system, and so does a problem whose fit fails.

    Raises
    ------
    InputError, ModelError, RecordingError
        What the problem names cannot be used.
    """
    factors = [q.of in P_VALUES or q.nominal != 0.0 for q in model.parameters]
    weight = 1.0
    for _ in range(PASSES):
        p, system, relative = _fitted(spec, model, recordings, columns, factors, weight)
        silent = [i.direction for i in invisible(model, p)]
        known = seen(system, columns, relative, p, factors, silent)
        before, weight = weight, max(known.scatter**2, LEAST)
        if 1.0 / LOOSE**2 <= weight / before <= LOOSE**2 or not np.any(p):
            break
    return Best(p, system, known)


def _fitted(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    columns: Sequence[int],
    factors: Sequence[bool],
    weight: float,
) -> tuple[Array, LinearSystem, bool]:
    """p, the system there, and whether its weights are relative only."""
    from cvxupdate.update.modal_fit import modal_fit
    from cvxupdate.update.rfm import fit_loop, prepare

    table = spec.update
    if table is None or table.method in ("ceam", "modal-dynamic"):
        return model.zero(), *first_system(spec, model, recordings)
    variance = np.full(len(factors), np.inf)
    variance[list(columns)] = [(LIKELY if factors[c] else UNIT) ** 2 for c in columns]
    # the others are not held: their deviation is a hundred times as wide
    variance[~np.isfinite(variance)] = (100.0 * UNIT) ** 2
    prior = REGULARISERS.named("prior")(weight, variance)
    own = replace(spec.own, regularisers=(*spec.own.regularisers, prior))
    own_kind = table.method if table.method != "minimum-variance" else "sensitivity"
    table = table.model_copy(update={"solution": "convex", "starts": 0, "method": own_kind})
    free = replace(spec, update=table, regularisation=(), own=own)
    try:
        if table.method == "rfm":
            prepared = prepare(free, model, recordings)
            loop = fit_loop(free, model, recordings, prepared)
            relative = all(d.relative_only for d in prepared.chosen)
            if loop.status != "infeasible":
                return loop.point.p, loop.point.system(), relative
        else:
            fit = modal_fit(free, model, recordings)
            ended, _ = fit.run(model.zero())
            if ended.status != "infeasible":
                relative = all(t.relative_only for t in fit.residual.fit)
                return ended.point.p, ended.point.system(), relative
    except ModelError:
        pass  # the update itself says it
    return model.zero(), *first_system(spec, model, recordings)
