"""The mesh that tables of modes need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.mesh import NONE
from cvxupdate.diagnose.nominal.refinement import (
    PLAIN,
    Mesh,
    Wanted,
    fine_enough,
    shift_between,
    wants_finer,
)
from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY, MESH_NOISE
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec import Spec

LEAST = 1e-5  # relative: finer than this no frequency is asked for
LITTLE = 0.03  # of the discrepancy of a sound model: coordinates that matter less are left out


def mesh_of_tables(spec: Spec, file: Model, tables: Sequence[ModeTable], sheared: bool) -> Mesh:
    """Fine enough for the frequencies of the tables."""
    bare = undamped(file.with_parameters(()))
    if not wants_finer(file):
        return PLAIN
    measured = prepared(bare, tables, NONE).measured
    top = max(float(t.frequency.max()) for t in tables)
    spread = np.concatenate([t.frequency_std / t.frequency for t in measured])
    noise = max(float(np.median(spread)), LITTLE * FREQUENCY_DISCREPANCY)

    def differ(model: Model, better: Model) -> float:
        return shift_between(model, better, top)

    precision = max(LEAST, LITTLE * FREQUENCY_DISCREPANCY)
    wanted = Wanted(top, precision, MESH_NOISE * noise, differ, sheared)
    return fine_enough(spec, bare, wanted)
