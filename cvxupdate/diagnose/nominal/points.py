"""Sheets that are held at points: what Kirchhoff's theory has no room for there.

A point of a thin sheet can be held rigidly. One that deforms in shear gives way around any force at
a point, in theory without end: over an angle θ of sheet the force F goes through θ r h at distance
r, so that the point lags by ln(R/r₀) F / (θ κ G h), from the radius r₀ of what holds it to that R
where bending takes over (Mindlin 1951). What r₀ is nobody knows, so a compliance common to all such
points is a nuisance parameter, in units of 1 / (θ κ G h).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.settings import SHEET_TYPES
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.plate import KAPPA
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.compliance import RIGID, Compliance
from cvxupdate.physics.given import POINTS, is_given
from cvxupdate.physics.growth import small_block

Held = tuple[int, str]  # node, kind
ACROSS = "z"  # the DOF across a sheet


def points_of(model: Model) -> tuple[Held, ...]:
    """Nodes of sheets, and of nothing else, that are held across them, and no neighbour along an
    edge with them: (node, kind)."""
    other = {int(n) for b in model.blocks if not _sheet(b) for n in _places(b).ravel()}
    held, beside = set[int](), dict[int, set[int]]()
    for b in filter(_sheet, model.blocks):
        for dofs, nodes in zip(b.nodal[:, _across(b)], _places(b), strict=True):
            at = nodes.tolist()
            held |= {n for n, d in zip(at, dofs, strict=True) if d < 0}
            for k, n in enumerate(at):
                beside.setdefault(n, set()).update((at[k - 1], at[(k + 1) % len(at)]))
    alone = sorted(n for n in held - other if not beside[n] & held)
    return tuple((int(model.node_ids[n]), ACROSS) for n in alone)


def on_points(model: Model, points: tuple[Held, ...]) -> Model:
    """The model with these held DOFs set free on springs to ground, rigid but for a ten
    thousandth of what shear gives."""
    if not points:
        return model
    place = {n: i for i, n in enumerate(model.node_ids.tolist())}
    at = [place[n] for n, _ in points]
    row = {n: model.size + i for i, n in enumerate(at)}
    kind = KINDS.index(ACROSS)
    blocks = tuple(_freed(b, row) if _sheet(b) else b for b in model.blocks)
    free: Model = replace(
        model,
        labels=(*model.labels, *(f"n{n}.{k}" for n, k in points)),
        dof_node=np.append(model.dof_node, np.array(at, dtype=np.int64)),
        dof_kind=np.append(model.dof_kind, np.full(len(at), kind)),
        blocks=blocks,
    )
    springs = small_block(
        free,
        Compliance(1, ACROSS),
        np.array(list(row.values()))[:, None],
        [kind],
        "K",
        np.ones((1, 1)),
        {"a": 0.0, "a0": compliance(model, at) / RIGID},
        POINTS,
    )
    return replace(free, blocks=(*blocks, springs))


def giving(model: Model, size: float) -> Model:
    """The model with points that give way by ``size`` of the unit."""
    return replace(
        model,
        blocks=tuple(
            replace(b, properties={**b.properties, "a": size * RIGID * b.properties["a0"]})
            if is_given(b)
            else b
            for b in model.blocks
        ),
    )


def compliance(model: Model, at: list[int]) -> float:
    """1 / (θ κ G h), m/N, of nodes at places ``at``, on the average."""
    stiff = dict.fromkeys(at, 0.0)
    for b in filter(_sheet, model.blocks):
        p = {k: np.real(b.properties[k]) for k in ("E", "nu", "thickness")}
        shear = KAPPA * p["E"] / (2.0 * (1.0 + p["nu"])) * p["thickness"]
        for k, nodes in zip(shear.tolist(), _places(b), strict=True):
            xyz = model.xyz[nodes]
            for i in (i for i, n in enumerate(nodes.tolist()) if n in stiff):
                stiff[int(nodes[i])] += k * _angle(xyz[i - 1] - xyz[i], xyz[(i + 1) % 4] - xyz[i])
    return float(np.mean([1.0 / k for k in stiff.values()]))


def _angle(a: Index, b: Index) -> float:
    return float(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0)))


def _sheet(block: Block) -> bool:
    return block.kind.name in SHEET_TYPES and block.nodes is not None


def _places(block: Block) -> Index:
    """Of the nodes of its elements, (e, nodes)."""
    return np.zeros((0, 0), dtype=np.int64) if block.nodes is None else block.nodes


def _across(block: Block) -> Index:
    """Columns of the elements' translations across the sheet, node by node."""
    own = block.direction[0, : block.own]
    return np.flatnonzero(own == KINDS.index(ACROSS))


def _freed(block: Block, row: dict[int, int]) -> Block:
    dofs = block.dofs.copy()
    for column, nodes in zip(_across(block), _places(block).T, strict=True):
        new = np.array([row.get(int(n), -1) for n in nodes], dtype=np.int64)
        dofs[:, column] = np.where(dofs[:, column] < 0, new, dofs[:, column])
    return replace(block, dofs=dofs)
