"""Is it plausible? Probable mistakes in a problem, from units, magnitudes and signs, in about a
second and before anything is fitted.

`examine` looks at model and recordings together. What it says are questions and warnings: nothing
is corrected.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cvxupdate.correlate.plausible.channels import channel_doubts
from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.correlate.plausible.facts import (
    PERCENT,
    facts,
    held,
    material_doubts,
    moved,
    states,
)
from cvxupdate.correlate.plausible.inputs import input_doubts
from cvxupdate.correlate.plausible.mesh import mesh_doubts
from cvxupdate.correlate.plausible.quality import damage_doubts, quality_doubts
from cvxupdate.correlate.plausible.recorded import recorded
from cvxupdate.correlate.plausible.units import QUANTITY, unit_doubts
from cvxupdate.errors import ModelError, RecordingError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.spec import Spec

__all__ = [
    "Doubt",
    "Warn",
    "doubts",
    "examine",
    "facts",
    "held",
    "input_doubts",
    "moved",
    "recorded",
    "states",
]

MODES = 30
"""Modes of the model that measured shapes are held against."""


PHASES = ("polarity", "passivity", "causality")
"""Checks of phases, which a quantity that is another than it is called turns by 90° or 180°."""
Warn = Callable[[str], None]
"""Called with each warning before a command begins its work."""


def examine(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    warn: Warn | None = None,
    meshed: bool = True,
) -> tuple[Doubt, ...]:
    """Every doubt about a problem: damage that was left out, quality, contradictions between
    recordings, plausibility, the mesh (unless ``meshed`` is False); each is handed to ``warn``.

    Raises
    ------
    RecordingError
        Where a doubt leaves nothing that could be compared or fitted (a dead channel).
    ModelError
        The model is no structure.
    """
    modes = model_modes(model, MODES) if recordings else None
    if modes is not None and not len(modes.eigenvalues):
        raise ModelError(
            "the model has no natural modes: it carries no mass. Add density or lumped masses."
        )
    known = doubts(spec, model, modes, recordings)
    fatal = [d.says for d in known if d.fatal]
    if fatal:
        raise RecordingError("\n".join(dict.fromkeys(fatal)))
    other = any(d.check == QUANTITY for d in known)
    quality = (d for d in quality_doubts(recordings) if not (other and d.check in PHASES))
    mesh = mesh_doubts(spec, model, recordings) if meshed else ()
    found = (*damage_doubts(recordings), *quality, *known, *mesh)
    if warn is not None:
        for doubt in found:
            warn(doubt.says)
    return found


def doubts(
    spec: Spec, model: Model, modes: Modes | None, recordings: Sequence[Recording]
) -> tuple[Doubt, ...]:
    """What is probably a mistake in the problem file or its recordings; ``modes`` of the model
    where it has any."""
    units = unit_doubts(spec, model, recordings)
    materials = () if any(d.check == "units of the model" for d in units) else material_doubts(spec)
    return (
        *materials,
        *units,
        *channel_doubts(model, modes, recordings),
        *(d for r in recordings if isinstance(r, ModeTable) for d in _percent(r)),
    )


def _percent(table: ModeTable) -> tuple[Doubt, ...]:
    known = table.damping[np.isfinite(table.damping)]
    if not known.size or np.median(known) < PERCENT:
        return ()
    value = float(np.median(known))
    says = (
        f"{table.origin.name}: half of its damping ratios are {value:.3g} of critical or more, and "
        "such modes hardly ring: are they in per cent?"
    )
    return (Doubt("damping in per cent", says, table.origin.name, value=value),)
