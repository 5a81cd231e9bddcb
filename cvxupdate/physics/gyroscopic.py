"""``gyroscopic``: what spins resists being turned with a moment square to the turning (Friswell,
Penny, Garvey and Lees 2010, 5.3).

Tell-tale: a force in one plane moves the other, and exchanging force and sensor changes the sign of
that response; pairs of equal modes split. Only what is round about its axis keeps constant matrices
while it spins: shafts of round section, discs with two equal moments of inertia.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, final

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Gyroscopic, Term
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.fe.sections import section_constants
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.draft import Draft
from cvxupdate.physics.effect import RESPONSES, Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited, new_ids, tangents
from cvxupdate.physics.place import Place, at, capital
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import number

ROUND = 1e-6  # relative difference of two moments of inertia of what is round
SPEED = 0.1  # of the band's top: the unit of spin
LIMITS = (-1e3, 1e3)

Piece = tuple[tuple[int, ...], tuple[int, ...], float]


@dataclass(frozen=True)
class Rotor:
    """What spins together: node places, the axis, pieces of shaft (node places, DOFs (12,), kg·m)
    and discs (node place, DOFs (3,), kg·m²)."""

    group: str
    elements: tuple[int, ...]
    nodes: tuple[int, ...]
    axis: Real
    shaft: tuple[Piece, ...]
    discs: tuple[Piece, ...]


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A gyroscopic element of a problem file; a disc says its axis."""
    if block.nodes is None:
        raise ModelError(f"gyroscopic element {int(block.ids[e])} does not say its nodes.")
    nodes, own = [int(n) for n in model.node_ids[block.nodes[e]]], int(block.ids[e])
    row: dict[str, Any] = {"id": own, "nodes": nodes, "Ip": now["Ip"], "omega": now["omega"]}
    if len(nodes) == 1:
        unit = block.terms[0].values[block.geometry[e]]
        row["axis"] = [float(unit[1, 2]), float(unit[2, 0]), float(unit[0, 1])]
    draft.put("gyroscopic", {**row, "group": "spin"})
    draft.known[own, "omega"] = (own, "omega")


@final
class Spin(EffectType):
    """What spins."""

    name = "gyroscopic"
    noun = "spin"
    told_by = frozenset({RESPONSES})  # pairs of complex modes: real shapes do not show it
    writers = (("gyroscopic", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """Every group of round beams along one line with the discs on it, and every disc on other
        supports; one spin each, either way round."""
        model = context.model
        unit = 2.0 * np.pi * SPEED * context.top
        out = []
        for rotor in (*_shafts(model), *_single_discs(model)):
            blocks = _blocks(model, rotor)
            if not any(_acts(b) for b in blocks):
                continue
            ids = tuple(int(i) for b in blocks for i in b.ids)
            name = f"gyroscopic@{rotor.group or rotor.nodes}"
            spinning = replace(model, blocks=(*model.blocks, *blocks))
            wanted = limited(name, "omega", ids, LIMITS, unit)
            grow = partial(append_parameters, spinning, [wanted])
            place = Place(elements=rotor.elements, groups=(rotor.group,) if rotor.group else ())
            if not rotor.elements:
                place = Place(nodes=tuple(int(model.node_ids[n]) for n in rotor.nodes))
            change = ModelChange(grow, tangents(grow(), 1), rotor.elements)
            out.append(Effect(self, place, change, (physical("omega", "rad/s"),), limits=LIMITS))
        return out

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Its speed."""
        omega = abs(values["omega"])
        return (
            f"{capital(at(effect.place))} something spins at {number(omega)} rad/s "
            f"({number(omega * 30.0 / math.pi)} turns a minute), while it stands still in the "
            "model."
        )


def _acts(block: Block) -> bool:
    """Whether it couples two free DOFs."""
    free = block.dofs >= 0
    return any(
        bool(np.any(t.values[block.geometry] * free[:, :, None] * free[:, None, :] != 0.0))
        for t in block.terms
    )


def _shafts(model: Model) -> Iterator[Rotor]:
    """Groups of parallel round beams whose nodes turn about both cross axes."""
    for block in model.blocks:
        if (
            block.kind.name != "beam3d"
            or block.nodes is None
            or not {3, 4, 5} & set(block.direction[0].tolist())
        ):
            continue
        section = getattr(block.kind, "section", None)
        if section is None:
            continue
        c = section_constants(section, block.properties)
        Iy, Iz, rho = np.real(c["Iy"]), np.real(c["Iz"]), block.properties["rho"]
        around = np.abs(Iy - Iz) <= ROUND * np.maximum(Iy, Iz)
        for group in dict.fromkeys(block.groups):
            rows = [e for e, g in enumerate(block.groups) if g == group]
            ends = model.xyz[block.nodes[rows]]
            axes = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[
                :, None
            ]
            along = axes @ axes[0]
            if not np.all(around[rows]) or np.any(np.abs(np.abs(along) - 1.0) > 1e-9):
                continue
            shaft = []
            for e, same in zip(rows, along > 0.0, strict=True):
                order = [0, 1] if same else [1, 0]
                dofs = {
                    (n, int(k)): int(d)
                    for n, half in enumerate(np.split(block.nodal[e], 2))
                    for k, d in zip(block.direction[0, : len(half)], half, strict=True)
                }
                shaft.append(
                    (
                        tuple(block.nodes[e][order].tolist()),
                        tuple(dofs.get((n, k), -1) for n in order for k in range(6)),
                        float(rho[e] * (Iy[e] + Iz[e])),
                    )
                )
            nodes = tuple(dict.fromkeys(block.nodes[rows].reshape(-1).tolist()))
            yield Rotor(
                group,
                tuple(int(block.ids[e]) for e in rows),
                nodes,
                axes[0],
                tuple(shaft),
                tuple(_discs(model, nodes, axes[0])),
            )


def _discs(model: Model, nodes: tuple[int, ...], axis: Real) -> Iterator[Piece]:
    """Lumped inertias at the nodes of a shaft: their polar moments about its axis."""
    for node, inertia in _inertias(model):
        polar = float(axis**2 @ inertia)
        if node in nodes and polar > 0.0:
            yield (node,), _rotations(model, node), polar


def _single_discs(model: Model) -> Iterator[Rotor]:
    """Lumped inertias, not on a round shaft, of which two moments are equal: the axis is that of
    the third."""
    taken = {n for r in _shafts(model) for n in r.nodes}
    for node, inertia in _inertias(model):
        for i in range(3):
            polar, j, k = inertia[i], inertia[(i + 1) % 3], inertia[(i + 2) % 3]
            if (
                node not in taken
                and polar > 0.0
                and j > 0.0
                and abs(j - k) <= ROUND * j < abs(polar - j)
            ):
                yield Rotor(
                    "",
                    (),
                    (node,),
                    np.eye(3)[i],
                    (),
                    (((node,), _rotations(model, node), float(polar)),),
                )


def _inertias(model: Model) -> Iterator[tuple[int, Real]]:
    """(node place, (Ixx, Iyy, Izz)) of every lumped mass that has any."""
    for block in model.blocks:
        if block.kind.name == "mass" and block.nodes is not None:
            moments = np.stack([block.properties[k] for k in ("Ixx", "Iyy", "Izz")], axis=1)
            yield from (
                (int(n), row)
                for (n,), row in zip(block.nodes, moments, strict=True)
                if np.any(row > 0.0)
            )


def _rotations(model: Model, node: int) -> tuple[int, ...]:
    name = f"n{int(model.node_ids[node])}"
    return tuple(model.place.get(f"{name}.{KINDS[k]}", -1) for k in (3, 4, 5))


def _blocks(model: Model, rotor: Rotor) -> list[Block]:
    """Gyroscopic elements at no spin."""
    first = int(new_ids(model, 1)[0])
    out = []
    for nodes, pieces in ((2, rotor.shaft), (1, rotor.discs)):
        if not pieces:
            continue
        kind, n = Gyroscopic(nodes), len(pieces)
        at = np.array([x for x, _, _ in pieces], dtype=np.int64)
        terms: tuple[Term, ...] = kind.terms(model.xyz[at], np.tile(rotor.axis, (n, 1)))
        properties = {
            **{k: np.full(n, v) for k, v in COMMON.items()},
            "Ip": np.array([i for _, _, i in pieces]),
            "omega": np.zeros(n),
        }
        direction = np.array([[3, 4, 5] if nodes == 1 else [0, 1, 2, 3, 4, 5] * 2])
        ids = np.arange(first, first + n, dtype=np.int64)
        first += n
        out.append(
            Block(
                kind,
                ids,
                ("",) * n,
                np.array([d for _, d, _ in pieces], dtype=np.int64),
                direction,
                terms,
                np.arange(n),
                properties,
                at,
            )
        )
    return out
