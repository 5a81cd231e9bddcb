"""Meshes of other programs (Gmsh, Abaqus and CalculiX, Nastran … by meshio) as nodes and blocks of
elements, with their named sets as groups and supports."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cvxupdate.api.arrays import Numbers, numbers, optional
from cvxupdate.api.blocks import EVERY
from cvxupdate.errors import InputError

TYPES = {
    "line": "beam3d",
    "triangle": "shell",
    "quad": "shell",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "tetra10": "tet10",
}
"""The element that a cell becomes, unless its block names another of as many nodes."""
FLAT = {
    "tetra": "linear tetrahedra are far too stiff. Mesh with quadratic ones (tetra10)",
    "triangle6": "shells have corners only. Mesh with linear triangles or quadrilaterals",
    "quad8": "shells have corners only. Mesh with linear quadrilaterals",
    "quad9": "shells have corners only. Mesh with linear quadrilaterals",
    "line3": "beams have two nodes. Mesh with linear elements",
    "wedge": "there is no wedge. Mesh with bricks or quadratic tetrahedra",
    "pyramid": "there is no pyramid. Mesh with bricks or quadratic tetrahedra",
    "hexahedron27": "bricks have 8 or 20 nodes. Mesh with serendipity elements",
}
DIMENSION = {"vertex": 0, "line": 1, "line3": 1, "triangle": 2, "quad": 2, "triangle6": 2}
DIMENSION |= {"quad8": 2, "quad9": 2}
REST = "all"
"""What a block for every set that has none of its own is called."""


@dataclass(frozen=True)
class _Cells:
    """The cells of one kind and set: ``nodes`` (cells, nodes of each), counted from 0."""

    kind: str
    name: str | None
    nodes: Numbers


def opened(mesh: Any) -> Any:
    """A mesh of meshio: itself, or read from a file.

    Raises
    ------
    InputError
        When it cannot be read.
    """
    if not isinstance(mesh, str | os.PathLike):
        if getattr(mesh, "cells_dict", None) is None or getattr(mesh, "points", None) is None:
            raise InputError(f"a {type(mesh).__name__} is no mesh. Give a file, or one of meshio.")
        return mesh
    meshio = optional("meshio", "reading a mesh")
    path = os.fspath(mesh)
    if not os.path.isfile(path):
        raise InputError(f"{path}: there is no such file.")
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # whatever a reader stumbles over; some of them exit
        told = " ".join(f"{said.getvalue()} {error}".split())[:200]
        raise InputError(f"{path}: meshio cannot read it as a mesh ({told}).") from None


def mesh_tables(
    mesh: Any,
    elements: Mapping[str, Any],
    supports: Mapping[str, Any] | None = None,
    scale: float = 1.0,
) -> dict[str, Any]:
    """``nodes``, ``elements`` and ``supports`` of a [model] table.

    ``elements`` gives the keys of the block of each named set, "all" for the rest; ``supports`` the
    directions that a named set, or a node, is held in; ``scale`` metres to a unit of the mesh.
    Nodes are numbered from 1 in the order of the mesh.

    Raises
    ------
    InputError
        For a set that the mesh does not have, cells that there is no element for, or cells that
        nothing was said of.
    """
    found = opened(mesh)
    factor = float(numbers(scale, "scale", 0))
    if factor <= 0.0:
        raise InputError(f"scale: {factor:g} is none. Give metres to a unit of the mesh.")
    points = numbers(found.points, "the points of the mesh", 2) * factor
    cells = _cells(found)
    names = {c.name for c in cells if c.name is not None} | set(found.point_sets)
    for name in elements:
        if name != REST and name not in names:
            raise InputError(f"elements: the mesh has no set {name!r}. It has {_listed(names)}.")
    blocks = _blocks(cells, elements)
    used = np.unique([n for block in blocks for row in block["nodes"] for n in row])
    held = _supports(found, cells, supports or {}, set(used.tolist()), names)
    rows = [{"id": int(n), **dict(zip("xyz", points[n - 1].tolist(), strict=False))} for n in used]
    return {"nodes": rows, "elements": blocks, "supports": held}


def _cells(mesh: Any) -> list[_Cells]:
    """Cells by kind and set: cell sets, else Gmsh's physical groups."""
    physical = {tuple(map(int, v)): k for k, v in mesh.field_data.items() if np.size(v) == 2}
    out: list[_Cells] = []
    for k, block in enumerate(mesh.cells):
        nodes, kind = np.asarray(block.data, dtype=np.int64), block.type
        if not len(nodes):
            continue
        own: list[str | None] = [None] * len(nodes)
        if "gmsh:physical" in mesh.cell_data:
            tags = np.asarray(mesh.cell_data["gmsh:physical"][k]).tolist()
            dim = DIMENSION.get(kind, 3)
            own = [physical.get((int(t), dim), f"physical {t}" if t else None) for t in tags]
        for name, members in mesh.cell_sets.items():
            if name.startswith("gmsh:") or members is None or members[k] is None:
                continue
            for i in np.asarray(members[k], dtype=np.int64).tolist():
                own[i] = own[i] or str(name)
        for name in dict.fromkeys(own):
            rows = [i for i, n in enumerate(own) if n == name]
            out.append(_Cells(kind, name, nodes[rows]))
    return out


def _blocks(cells: Sequence[_Cells], elements: Mapping[str, Any]) -> list[dict[str, Any]]:
    top = max((DIMENSION.get(c.kind, 3) for c in cells), default=0)
    blocks: list[dict[str, Any]] = []
    for c in cells:
        keys = elements.get(c.name or "")
        if keys is None:
            if DIMENSION.get(c.kind, 3) < top:
                continue  # the edge of a sheet, the face of a solid
            keys = elements.get(REST)
        if keys is None:
            where = f"in set {c.name!r}" if c.name else "in no set"
            raise InputError(
                f"elements: nothing is said of {len(c.nodes)} cells ({c.kind}) {where}. Name the "
                'set, or give "all".'
            )
        if not isinstance(keys, Mapping):
            raise InputError(f"elements.{c.name or REST}: give a dictionary, e.g. material.")
        if c.kind not in TYPES and "type" not in keys:
            why = FLAT.get(c.kind, "there is no element for them")
            raise InputError(f"the mesh has {len(c.nodes)} cells of kind {c.kind}: {why}.")
        group = {"group": c.name} if c.name else {}
        kind = TYPES.get(c.kind, "")
        blocks.append({"type": kind, **group, **keys, "nodes": (c.nodes + 1).tolist()})
    if not blocks:
        raise InputError("the mesh has no cells.")
    return blocks


def _supports(
    mesh: Any,
    cells: Sequence[_Cells],
    supports: Mapping[str, Any],
    used: set[int],
    names: set[str],
) -> list[dict[str, Any]]:
    sets: dict[str, set[int]] = {}
    for c in cells:
        if c.name is not None:
            sets.setdefault(c.name, set()).update((np.unique(c.nodes) + 1).tolist())
    for name, members in mesh.point_sets.items():
        sets.setdefault(str(name), set()).update((np.asarray(members, dtype=int) + 1).tolist())
    out = []
    for name, dofs in supports.items():
        nodes = {name} if isinstance(name, int) else sets.get(name)
        if nodes is None:
            raise InputError(f"supports: the mesh has no set {name!r}. It has {_listed(names)}.")
        here = sorted(nodes & used)
        if not here:
            raise InputError(f"supports: {name!r} has no node that an element stands on.")
        out.append({"nodes": here, "dofs": list(EVERY) if dofs == "all" else dofs})
    return out


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(names)[:12]) or "none"
