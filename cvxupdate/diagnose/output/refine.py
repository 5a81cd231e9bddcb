"""A written problem file on a finer mesh: what diagnosis took out as the mesh's own error is then
not in the model any more.

Nodes, groups, sections, supports, other elements and recordings stay as they are, with their
numbers. Every rod and beam is divided evenly; its first part keeps the number, further parts and
the nodes between get numbers above all others.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from cvxupdate.diagnose.output.export import Written
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes

MODES = 12  # compared on two meshes

LINES = {
    "rod": 4,
    "beam2d": 2,
    "beam3d": 2,
    # parts: frequencies of rods converge with the square of the length, of beams with its fourth
    # power
}
SECOND_ORDER = (
    4  # parts of a beam that deforms in shear, which converges with the square where it is short
)
SHEET = ("plate",)
NOT_HERE = ("update", "constraints", "regularisation", "solver")  # they name elements


def refined(written: Written) -> Written | None:
    """A problem file with every rod and beam divided; None where there is none, or plates, whose
    mesh is left to the analyst."""
    tables = copy.deepcopy(written.tables)
    model: dict[str, Any] = tables["model"]
    kinds = {block["type"] for block in model["elements"]}
    if not kinds & set(LINES) or kinds & set(SHEET):
        return None
    at = {n["id"]: [n.get(k, 0.0) for k in "xyz"] for n in model["nodes"]}
    node, element = max(at), max(row["id"] for block in model["elements"] for row in block["rows"])
    fresh: list[int] = []
    for block in model["elements"]:
        if block["type"] not in LINES:
            continue
        rows: list[dict[str, Any]] = []
        for row in block["rows"]:
            section = model.get("sections", {}).get(row.get("section", block.get("section")), {})
            parts = SECOND_ORDER if "kappa" in section else LINES[block["type"]]
            a, b = row["nodes"]
            between = list(range(node + 1, node + parts))
            node += parts - 1
            for k, n in enumerate(between, 1):
                x = [p + (q - p) * k / parts for p, q in zip(at[a], at[b], strict=True)]
                model["nodes"].append({"id": n, **dict(zip("xyz", x, strict=True))})
            fresh += between
            ends = [a, *between, b]
            for k in range(parts):
                element += k > 0
                rows.append({**row, "id": element if k else row["id"], "nodes": ends[k : k + 2]})
        block["rows"] = rows
    everywhere = _held_everywhere(model, set(at))
    if everywhere:
        model["supports"].append({"nodes": fresh, "dofs": everywhere})
    kept = {k: v for k, v in tables.items() if k not in NOT_HERE}
    head = (
        "The diagnosed model (problem.toml beside this file) on a finer mesh: every rod and beam "
        "divided, all numbers kept, new ones above.",
        "For comparison with recordings (cvxupdate correlate); update the other file.",
    )
    return Written(kept, head)


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


def _held_everywhere(model: dict[str, Any], nodes: set[int]) -> list[str]:
    """Kinds of DOF that supports hold at every node by number (a plane structure in space): the
    nodes between are held alike."""
    out = []
    for dof in model["dofs"]:
        held: set[int] = set()
        for s in model.get("supports", ()):
            if dof in s["dofs"]:
                if s["nodes"] == "all":
                    held = set()
                    break
                held |= set(s["nodes"])
        if nodes <= held:
            out.append(dof)
    return out
