"""The mesh that tables of modes need."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.refinement import (
    Mesh,
    Wanted,
    fine_enough,
    has_sheets,
    shift_between,
    with_theory_of,
)
from cvxupdate.diagnose.nominal.theory import SHEAR
from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY, MESH_NOISE
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec


def mesh_for(spec: Spec, file: Model, top: float, sheared: bool) -> Mesh:
    """Of sheets, whose thickness bends frequencies and shapes, fine enough for the modes up to
    ``top`` (Hz). Of lines the file's own, with what their theory may leave out: what a mesh does to
    their frequencies extrapolation takes out, at a tenth of the cost. Where shear is sought
    (``sheared``) it is foreseen (`cvxupdate.diagnose.nominal.wanted`): no parameter hides it."""
    bare = undamped(file.with_parameters(()))
    enough = MESH_NOISE * FREQUENCY_DISCREPANCY
    wanted = Wanted(top, enough, enough, partial(shift_between, top=top), sheared)
    if has_sheets(bare):
        return fine_enough(spec, bare, wanted)
    own = with_theory_of(bare, wanted)
    return replace(own, theory=tuple(w for w in own.theory if not (sheared and w == SHEAR)))
