"""Nodes, elements and supports as arrays, turned into the rows of a problem file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cvxupdate.api.arrays import numbers
from cvxupdate.errors import InputError
from cvxupdate.spec.given import plain

AXES = ("x", "y", "z")
EVERY = ("x", "y", "z", "rx", "ry", "rz")
LISTS = frozenset({"nodes", "dofs", "orientation", "axis", "labels"})
"""Keys whose value is a list in one row."""
FAMILIES = {
    "beam2d": ("x", "y", "rz"),
    "beam3d": EVERY,
    "plate": ("z", "rx", "ry"),
    "shell": EVERY,
    "rod": ("x", "y", "z"),
    "hex8": ("x", "y", "z"),
    "hex20": ("x", "y", "z"),
    "tet10": ("x", "y", "z"),
}
"""The directions that elements move in which name none themselves."""


def node_rows(nodes: Any) -> list[dict[str, Any]]:
    """Rows of nodes from an array (nodes, 1 to 3), numbered from 1; from {number: coordinates}; or
    from rows and tables of pandas with id, x, y, z.

    Raises
    ------
    InputError
        When it is none of these.
    """
    if isinstance(nodes, Mapping):
        return [_node(number, at) for number, at in nodes.items()]
    given = plain(nodes, "nodes")
    if isinstance(given, list) and given and all(isinstance(row, Mapping) for row in given):
        return [dict(row) for row in given]
    xyz = numbers(given, "nodes", 2)
    return [_node(number, at) for number, at in enumerate(xyz, 1)]


def _node(number: Any, at: Any) -> dict[str, Any]:
    place = numbers(at, f"node {number}", 1)
    if len(place) > 3:
        raise InputError(f"node {number}: has {len(place)} coordinates. Give x, y and z at most.")
    return {
        "id": int(number) if isinstance(number, np.integer) else number,
        "x": 0.0,
        **dict(zip(AXES, place.tolist(), strict=False)),
    }


def element_blocks(blocks: Any) -> list[dict[str, Any]]:
    """Blocks of elements, each with rows as in a problem file, or with arrays: ``nodes`` (elements,
    nodes of each), and for every other key one value, or one for each element. Elements without
    ``id`` are numbered on.

    Raises
    ------
    InputError
        When arrays do not agree.
    """
    given = [blocks] if isinstance(blocks, Mapping) else blocks
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise InputError("elements: give a list of blocks, each a dictionary with a type.")
    made: list[dict[str, Any]] = []
    for i, block in enumerate(given):
        if not isinstance(block, Mapping):
            raise InputError(f"elements[{i}]: is no dictionary. Give type, nodes, material …")
        made.append(_block(plain(block, f"elements[{i}]"), f"elements[{i}]"))
    _number(made)
    return made


def _block(block: dict[str, Any], where: str) -> dict[str, Any]:
    if "rows" in block or "nodes" not in block:
        return block
    rows = block["nodes"]
    if not isinstance(rows, list) or not all(isinstance(r, list | int | float) for r in rows):
        raise InputError(f"{where}.nodes: give the nodes of each element, (elements, nodes).")
    count = len(rows)
    out: dict[str, Any] = {"type": block.get("type")}
    made = [{"nodes": [_whole(n) for n in (r if isinstance(r, list) else [r])]} for r in rows]
    for key, value in block.items():
        if key in ("type", "nodes"):
            continue
        name = "id" if key == "ids" else key
        deep = isinstance(value, list) and (
            name not in LISTS or (bool(value) and isinstance(value[0], list))
        )
        if not deep:
            out[name] = value
            continue
        if len(value) != count:
            raise InputError(
                f"{where}.{key}: {len(value)} values for {count} elements. Give one for each, or "
                "one for all."
            )
        for row, entry in zip(made, value, strict=True):
            row[name] = _whole(entry) if name == "id" else entry
    return {**out, "rows": made}


def _whole(n: Any) -> Any:
    """A number of an array of floats that is whole, as one."""
    return int(n) if isinstance(n, float) and n.is_integer() else n


def _number(blocks: Sequence[Mapping[str, Any]]) -> None:
    tables = [block.get("rows") for block in blocks]
    rows = [r for table in tables if isinstance(table, list) for r in table if isinstance(r, dict)]
    taken = {row["id"] for row in rows if isinstance(row.get("id"), int)}
    at = 0
    for row in rows:
        if "id" not in row:
            at += 1
            while at in taken:
                at += 1
            taken.add(at)
            row["id"] = at


def support_rows(supports: Any) -> list[dict[str, Any]]:
    """[[model.supports]] from rows, or from {node: directions held}, "all" for every one."""
    if supports is None:
        return []
    if isinstance(supports, Mapping) and "nodes" in supports:
        supports = [supports]
    if isinstance(supports, Mapping):
        return [
            {
                "nodes": [int(node) if isinstance(node, np.integer) else node],
                "dofs": list(EVERY)
                if isinstance(dofs, str) and dofs == "all"
                else plain(dofs, f"supports.{node}"),
            }
            for node, dofs in supports.items()
        ]
    rows = plain(supports, "supports")
    if not isinstance(rows, list):
        raise InputError(
            f'supports: a {type(supports).__name__} is none. Give {{node: "all"}}, '
            '{node: ["x", "y"]}, or rows with nodes and dofs.'
        )
    return rows


def _all(dofs: Any) -> bool:
    return isinstance(dofs, str) and dofs == "all"  # an array has no truth of its own


def dofs_needed(blocks: list[dict[str, Any]]) -> list[str]:
    """The directions that elements of these types move in.

    A spring, mass or dashpot moves as its ``dof`` says; solids and rods along three axes; plane
    beams in x, y, rz; everything else in six.
    """
    used: set[str] = set()
    for block in blocks:
        kind = block.get("type")
        raw = block.get("rows")
        rows = [r for r in raw if isinstance(r, Mapping)] if isinstance(raw, list) else []
        for part in (block, *rows):
            dof, more = part.get("dof"), part.get("dofs")
            used |= {dof} if isinstance(dof, str) else set()
            used |= {d for d in more if isinstance(d, str)} if isinstance(more, list) else set()
        if isinstance(kind, str) and kind in FAMILIES:
            used |= set(FAMILIES[kind])
    return [k for k in EVERY if k in used] or list(EVERY)
