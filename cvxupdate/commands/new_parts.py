"""What the problems that `new` writes are put together from."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEAD = """# Made by `cvxupdate new {kind}`. The recordings were computed from this model with one
# thing changed: {changed}.
# Put your own nodes, elements and recordings in their place: `cvxupdate inspect FILE` writes the
# [[recordings]] block of a file.
#
#   cvxupdate view problem.toml        the structure, supports, sensors, first modes
#   cvxupdate correlate problem.toml   model and recordings beside one another
#   cvxupdate diagnose problem.toml    what the model lacks, where and how much
#   cvxupdate run problem.toml         fits the parameters of [update], whatever the model lacks

title = "{title}"
source = "computed by cvxupdate new {kind}"
"""
MODES = """
[[recordings]]
kind = "modes"
file = "modes.csv"                # one column for each sensor: 9:+Y is node 9 along +y
frequency_std_relative = 0.0005

[update]
method = "sensitivity"
parameters = [
  { groups = GROUPS, of = "stiffness", each = "group", lower = -0.3, upper = 0.3 },
]
"""


def recorded(*groups: str, example: str = "9:+Y is node 9 along +y") -> str:
    """The tables behind [model], with a parameter for each group."""
    listed = ", ".join(f'"{g}"' for g in groups)
    return MODES.replace("GROUPS", f"[{listed}]").replace("9:+Y is node 9 along +y", example)


class Table:
    """A table of text to be: its ``heads``, rows by `add`."""

    def __init__(self, heads: tuple[str, ...]) -> None:
        self._lines = [",".join(heads)]

    def add(self, *cells: object) -> None:
        """One row."""
        self._lines.append(",".join(str(c) for c in cells))

    def text(self) -> str:
        """As CSV."""
        return "\n".join(self._lines) + "\n"


@dataclass(frozen=True)
class Made:
    """Texts of ``files`` by name; the [model] table of what was "measured" (``truth``) with its
    ``sensors`` (labels) and number of ``modes``; ``matrices`` by file name where the problem is
    made of them: then the recordings are frequency responses."""

    files: Mapping[str, str]
    truth: dict[str, Any]
    sensors: tuple[str, ...]
    modes: int
    matrices: Mapping[str, NDArray[np.float64]] | None = None


@dataclass
class Mesh:
    """Nodes (id, x, y) and elements (id, nodes, group)."""

    nodes: list[tuple[int, float, float]] = field(default_factory=list)
    elements: list[tuple[int, tuple[int, ...], str]] = field(default_factory=list)

    def line(self, path: list[tuple[float, float]], group: str) -> None:
        """A chain of elements along a path; it begins at a node that is there already."""
        ids = [self._node(*at) for at in path]
        for pair in pairwise(ids):
            self.elements.append((len(self.elements) + 1, pair, group))

    def _node(self, x: float, y: float) -> int:
        for number, a, b in self.nodes:
            if abs(a - x) + abs(b - y) < 1e-9:
                return number
        self.nodes.append((len(self.nodes) + 1, x, y))
        return len(self.nodes)

    def files(self) -> dict[str, str]:
        """The tables that the problem file names."""
        nodes, elements = Table(("id", "x", "y")), Table(("id", "nodes", "group"))
        for number, x, y in self.nodes:
            nodes.add(number, f"{x:g}", f"{y:g}")
        for number, corners, group in self.elements:
            elements.add(number, " ".join(map(str, corners)), group)
        return {"nodes.csv": nodes.text(), "elements.csv": elements.text()}

    def tables(self, block: Mapping[str, Any], **model: Any) -> dict[str, Any]:
        """The [model] table with everything written out."""
        rows = [{"id": e, "nodes": list(n), "group": g} for e, n, g in self.elements]
        nodes = [{"id": n, "x": x, "y": y} for n, x, y in self.nodes]
        return {**copy.deepcopy(model), "nodes": nodes, "elements": [{**block, "rows": rows}]}


STEEL = {"steel": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}}
DAMPED = {"kind": "modal", "zeta": 0.01}
MODEL = """
[model]
dofs = {dofs}
nodes = {{ file = "nodes.csv" }}
supports = [{{ nodes = {held}, dofs = {dofs} }}]
damping = {{ kind = "modal", zeta = 0.01 }}

[model.materials.steel]
E = 2.1e11                        # Pa
nu = 0.3
rho = 7850.0                      # kg/m³

[model.sections.{section}]
{shape}

[[model.elements]]
type = "{element}"
material = "steel"
section = "{section}"
rows = {{ file = "elements.csv" }}   # id, nodes, group
"""
