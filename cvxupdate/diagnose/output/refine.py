"""A diagnosed model on a finer mesh: what diagnosis took out as the mesh's own error is then not in
it any more. Plates are left to the analyst."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import text_of
from cvxupdate.spec.write import Written, compacted, tables_of

MODES = 12  # compared on two meshes
# parts of an element: frequencies of rods converge with the square of its length, of beams with the
# fourth power, of those that deform in shear with the square where they are short
LINES = {"rod": 4, "beam2d": 2, "beam3d": 2}
SECOND_ORDER = 4
SHEETS = {"rectangle", "surface", "solid"}  # outlines that are left to the analyst
NOT_HERE = ("update", "constraints", "regularisation", "solver")  # they name elements
HEAD = (
    "The diagnosed model (problem.toml beside this file) on a finer mesh: every rod and beam "
    "divided, all numbers kept, new ones above.",
    "For comparison with recordings (cvxupdate correlate); update the other file.",
)


def finer(spec: Spec) -> Spec | None:
    """A problem with every rod and beam divided; None where there is none, or plates."""
    kinds = {block.type for block in spec.model.elements}
    outlines = {text_of(block).outline for block in spec.model.elements}
    if not kinds & set(LINES) or outlines & SHEETS:
        return None

    def parts(block: Any, row: Any) -> int:
        if block.type not in LINES:
            return 1
        section = spec.model.sections.get(row.section or block.section)
        sheared = getattr(section, "kappa", None) is not None
        return SECOND_ORDER if sheared else LINES[block.type]

    return replace(spec, model=refined(spec.model, parts, renumber=True).model, update=None)


def finer_file(fine: Spec) -> Written:
    """As a problem file, for comparison only."""
    tables = compacted(tables_of(fine))
    return Written({k: v for k, v in tables.items() if k not in NOT_HERE}, HEAD)


def shift(coarse: Model, fine: Model) -> float:
    """Largest relative difference of the lowest `MODES` frequencies of two models, which differ in
    their mesh only.

    Raises
    ------
    ModelError
        For a model that is no structure.
    """
    f, g = (model_modes(m, MODES).flexible().frequencies for m in (coarse, fine))
    n = min(len(f), len(g))
    return float(np.abs(f[:n] / g[:n] - 1.0).max(initial=0.0))
