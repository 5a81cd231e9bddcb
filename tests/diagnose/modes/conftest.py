"""Four modes of a cantilever with a stiff support, beside the bare one."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.mesh import NONE
from cvxupdate.diagnose.nominal.refinement import PLAIN
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.supports import held_dofs, release_from
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from tests.cases.cantilever import load, text

WORDS = ("stiffness_change", "mass_change", "added_mass", "grounding_spring", "joint_flexibility")
SUPPORT = (
    '[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{ id = 90, nodes = [8], k = 2e6 }]'
)
SENSORS = (3, 6, 9, 12)


@pytest.fixture(params=[False, True], ids=["frequencies", "shapes"])
def tried(tmp_path, request):
    """(evidence, fit of the nuisance parameters, candidates) of the bare cantilever beside four
    modes of one with a stiff support at node 8, with their shapes or without."""
    _, real = load(tmp_path, text(extra=SUPPORT, E="205.5e9"))
    spec, model = load(tmp_path, text())
    start = with_nuisance(undamped(model))
    modes = model_modes(real, 4)
    f, nothing = modes.frequencies[:4], np.full(4, np.nan)
    shapes = (
        modes.shapes[[real.place[f"n{n}.z"] for n in SENSORS], :4].T
        / np.abs(modes.shapes[:, :4]).max()
    )
    channels = tuple(Channel(n, "z", "displacement") for n in SENSORS)
    seen = (channels, shapes) if request.param else ((), None)
    table = ModeTable(
        Origin("table", "table", "fit"), f, 1e-3 * f, nothing, nothing, *seen, None, np.arange(1, 5)
    )
    data = prepared(start, [table], NONE)
    evidence = ModesEvidence(
        model,
        start,
        data,
        NONE,
        PLAIN,
        WORDS,
        (),
        held_dofs(spec, model),
        release_from(spec),
        (0,),
        lambda said: None,
    )
    return evidence, evidence.bases[0], evidence.candidates(start)
