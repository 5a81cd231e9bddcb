"""The mesh that tables of modes need."""

from __future__ import annotations

from functools import partial

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.refinement import (
    PLAIN,
    Mesh,
    Wanted,
    fine_enough,
    has_sheets,
    shift_between,
)
from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY, MESH_NOISE
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec


def mesh_for(spec: Spec, file: Model, top: float, sheared: bool) -> Mesh:
    """Of sheets, whose thickness bends frequencies and shapes, fine enough for the modes up to
    ``top`` (Hz). Of lines the file's own: what a mesh does to their frequencies extrapolation takes
    out, at a tenth of the cost."""
    bare = undamped(file.with_parameters(()))
    if not has_sheets(bare):
        return PLAIN
    enough = MESH_NOISE * FREQUENCY_DISCREPANCY
    differ = partial(shift_between, top=top)
    return fine_enough(spec, bare, Wanted(top, enough, enough, differ, sheared))
