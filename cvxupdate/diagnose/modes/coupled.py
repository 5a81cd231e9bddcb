"""What a strong damper does to frequencies and shapes in tables: it couples the modes that it
moves, so that those of the damped structure are none of the undamped one's.

To first order a damper leaves them alone, and the search knows the first order only. A damper that
the ratios tell is taken out of the frequencies as the complex modes have it
(`cvxupdate.diagnose.modes.dashpots`); where nothing else is needed then, it is all that is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.damping import damping_laws
from cvxupdate.diagnose.modes.dashpots import RealModes
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.results import Damper
from cvxupdate.diagnose.settings import UNSTATED_SHAPE
from cvxupdate.physics import candidates_of
from cvxupdate.physics.effect import RATIOS, Effect
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint

TRIED = 4  # dampers, the likeliest first


def without_coupling(
    evidence: Callable[[Sequence[ModeTable]], ModesEvidence],
    whole: ModesEvidence,
    tables: Sequence[ModeTable],
) -> ModesEvidence:
    """The ``whole`` evidence of ``tables`` as it is where the base explains it, or no damper makes
    that it does."""
    base = whole.bases[-1]
    if whole.explained(base, whole.errors(base)):
        return whole
    tables = sorted(tables, key=lambda t: t.origin.use != "fit")  # as points have them
    model = base.point.residual.model

    def effects(zeta: float) -> Sequence[Effect]:
        return candidates_of(whole.context(model), ("viscous_damper",), RATIOS)

    laws = damping_laws(whole.tables, base.point, whole.original, effects)
    for damper in laws.dampers[:TRIED]:
        moved = _moved(base.point, tables, damper)
        if moved is None:
            continue
        rest = evidence(moved[0])
        fit = rest.bases[-1]
        if rest.explained(fit, rest.errors(fit)):
            told = (
                f"The damping ratios tell {damper.effect.title}, which couples modes: their "
                f"frequencies are up to {100 * moved[1]:.2g} % from those of the undamped "
                "structure. That was taken out.",
            )
            return replace(rest, tables=replace(rest.tables, told=told))
    return whole


def _moved(
    point: ModalPoint, tables: Sequence[ModeTable], damper: Damper
) -> tuple[list[ModeTable], float] | None:
    """Tables with the frequencies of the undamped structure, shapes as much less sure as they
    differ; and by how much frequencies do, at most."""
    if damper.effect.change is None:
        return None
    real = RealModes.of(point)
    used = len(point.modes.eigenvalues)
    found = real.with_damping(damper.size * real.damping(damper.effect.change), used)
    shift, turned = found.shift, found.turned
    out, most = [], 0.0
    for table, at in zip(tables, point.places, strict=True):
        by = np.where(at >= 0, shift[np.maximum(at, 0)], 0.0)
        most = max(most, float(np.abs(by).max(initial=0.0)))
        std = table.shape_std
        if table.shapes is not None:
            size = np.nanmax(np.abs(table.shapes), axis=1, initial=0.0)
            more = (np.where(at >= 0, turned[np.maximum(at, 0)], 0.0) * size)[:, None]
            known = np.full(table.shapes.shape, np.nan if std is None else std)
            std = np.hypot(np.where(np.isfinite(known), known, UNSTATED_SHAPE), more)
        f = table.frequency / (1.0 + by)
        out.append(replace(table, frequency=f, shape_std=std))
    return (out, most) if np.isfinite(most) else None
