"""``joint_flexibility`` of a class: all joints of one kind turn on springs of one k.

Tell-tale: every mode that bends the joints falls, and no single place explains it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.alike import AlikeChange, owned, with_own
from cvxupdate.physics.compliance import RIGID, write
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.directions import LowRank, opened
from cvxupdate.physics.effect import Effect, EffectType
from cvxupdate.physics.joint_flexibility import LIMITS, End, ends_of, is_beam, opened_model
from cvxupdate.physics.members import STRAIGHT
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.units import quantity

MOST = 200  # joints of a class


@dataclass(frozen=True)
class Met:
    """The end of a beam at a node: its ``group``, which way it goes from there (3,)."""

    end: End
    element: int
    node: int
    group: str
    away: Real


Kind = tuple[Sequence[Met], tuple[str, ...], str]  # ends, the groups that meet, what they are


@final
class EqualJoints(EffectType):
    """Joints of one kind that give way alike."""

    name = "joint_flexibility"
    noun = "the flexibility"
    rig = True
    writers = (("compliance", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One for every two groups that meet at several nodes, one for the ends of each group that
        meets others, one for all joints, and one for every end of a member at a joint."""
        return [self._one(context.model, *kind) for kind in _kinds(context.model)]

    def at(self, place: Place, context: SearchContext) -> list[Effect]:
        """Only ends of members that meet there are opened."""
        model = context.model
        there = [kind for kind in _kinds(model) if {m.node for m in kind[0]} == {*place.nodes}]
        return [self._one(model, *kind) for kind in there]

    def _one(self, model: Model, met: Sequence[Met], groups: tuple[str, ...], what: str) -> Effect:
        ends = [m.end for m in met]
        blocks, along, unit = _opened(model, ends)
        turning = {
            KINDS[int(model.blocks[n].direction[0, c])] for n, _, columns in ends for c in columns
        }
        place = Place(
            nodes=tuple(dict.fromkeys(m.node for m in met)),
            elements=tuple(dict.fromkeys(m.element for m in met)),
            groups=groups,
            dof=turning.pop() if len(turning) == 1 else None,
        )
        change = AlikeChange(
            partial(_grown, model, ends, unit),
            (blocks,),
            series=True,
            along=along,
            own=owned(ends),
        )
        between = "of the structure"
        if groups:
            a, b = (f"group '{g}'" if g else "what has no group" for g in groups)
            between = f"between {a} and {b}"
        spot = f"of the {len(ends)} {what} {between}"
        figures = (stiffness("k", "N·m/rad", unit / RIGID),)
        return Effect(self, place, change, figures, 1, LIMITS, spot)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The spring of each."""
        k = quantity(values["k"], "N·m/rad")
        return f"Each {effect.spot} turns on a spring of {k}, while the model joins it rigidly."


def classes(model: Model) -> list[tuple[list[Met], tuple[str, ...]]]:
    """Ends that turn, and the two groups between which they do (none: all joints)."""
    meetings = _meetings(model)
    pairs: dict[tuple[str, str], list[list[Met]]] = {}
    for met in meetings:
        for pair in itertools.combinations(sorted({m.group for m in met}), 2):
            pairs.setdefault(pair, []).append(met)
    out: list[tuple[list[Met], tuple[str, ...]]] = []
    for pair, nodes in pairs.items():
        for group in _interrupted(pair, nodes):
            out.append(([m for met in nodes for m in met if m.group == group], pair))
    whole = [m for met in meetings for m in _ending(met)]
    covered = any({m.node for m in whole} <= {m.node for m in ends} for ends, _ in out)
    return out if covered else [*out, (whole, ())]


def _kinds(model: Model) -> list[Kind]:
    """Ends of members, each set of them once, the groups between which they are and what they are
    called."""
    found: dict[frozenset[tuple[int, int]], Kind] = {}
    kinds = [(met, groups, "joints") for met, groups in classes(model)]
    ends = [(met, (), f"ends of group '{g}' at joints") for g, met in ends_of_groups(model)]
    for met, groups, what in (*kinds, *ends, (every_end(model), (), "ends of members at joints")):
        if 1 < len(met) <= MOST:
            key = frozenset((m.element, m.node) for m in met)
            found.setdefault(key, (met, groups, what))
    return list(found.values())


def every_end(model: Model) -> list[Met]:
    """All ends of members where more than two meet, or two at an angle: where each is fastened to
    the joint by a spring of its own, none goes through. None where no more than two meet anywhere:
    there the springs of both ends are one."""
    joints = [met for met in _meetings(model) if _ending(met)]
    return [m for met in joints for m in met] if any(len(met) > 2 for met in joints) else []


def ends_of_groups(model: Model) -> list[tuple[str, list[Met]]]:
    """Of every group that meets others, several of its own at a corner, the ends that end there:
    two rails may be bolted to each leg. Where one meets one, either side is the same joint."""
    out: dict[str, list[list[Met]]] = {}
    for met in _meetings(model):
        if len({m.group for m in met}) > 1:
            for group in dict.fromkeys(m.group for m in _stopping(met) if m.group):
                out.setdefault(group, []).append([m for m in _stopping(met) if m.group == group])
    return [
        (g, [m for ends in at for m in ends])
        for g, at in out.items()
        if max(len(ends) for ends in at) > 1
    ]


def _stopping(met: Sequence[Met]) -> list[Met]:
    return [m for m in met if not _passes(m, met)]


def _meetings(model: Model) -> list[list[Met]]:
    """The ends that turn together, wherever several do."""
    at: dict[int, list[Met]] = {}
    for number, block in enumerate(model.blocks):
        if not is_beam(block) or block.nodes is None:
            continue
        half = block.nodal.shape[1] // 2
        for e, columns in ends_of(block):
            row = int(block.dofs[e, columns[0]])
            near, far = block.nodes[e, ::-1] if columns[0] >= half else block.nodes[e]
            away = model.xyz[far] - model.xyz[near]
            met = Met(
                (number, e, tuple(columns)),
                int(block.ids[e]),
                int(model.node_ids[model.dof_node[row]]),
                block.groups[e],
                away / max(float(np.linalg.norm(away)), 1e-300),
            )
            at.setdefault(row, []).append(met)
    return [met for met in at.values() if len(met) > 1]


def _passes(m: Met, others: Sequence[Met]) -> bool:
    """Whether another end goes straight on."""
    return any(o is not m and float(m.away @ o.away) < -STRAIGHT for o in others)


def _ending(met: Sequence[Met]) -> list[Met]:
    """The ends that turn against the rest at a node: those that end there, where all do all but the
    last one; where lines cross, the ends that are not on the line of the first one."""
    ending = _stopping(met)
    if len(ending) == len(met):
        return ending[:-1]
    if ending or len(met) == 2:
        return ending
    first = met[0]
    return [m for m in met if abs(float(m.away @ first.away)) < STRAIGHT]


def _interrupted(pair: tuple[str, str], nodes: Sequence[Sequence[Met]]) -> list[str]:
    """Which of two groups is joined to the other: the one that ends at more of the nodes where they
    meet, or has fewer ends there; both where neither tells them apart."""

    def rank(group: str) -> tuple[int, int]:
        ends = [[m for m in met if m.group == group] for met in nodes]
        ending = sum(any(not _passes(m, mine) for m in mine) for mine in ends)
        return -ending, sum(map(len, ends))

    a, b = (rank(g) for g in pair)
    if a != b:
        return [pair[0] if a < b else pair[1]]
    alone = all(len(met) == 2 for met in nodes)  # either side of two: the same joint
    return [pair[0]] if alone else list(pair)


def _grown(model: Model, ends: Sequence[End], unit: float) -> Model:
    """On springs of one compliance, each with a factor of its own."""
    name = f"joints@{len(ends)}"
    grown = opened_model(model, ends, unit, name)
    about = [(int(model.blocks[n].direction[0, c]), (n, e, own)) for n, e, own in ends for c in own]
    whose = [end for kind in dict.fromkeys(k for k, _ in about) for k, end in about if k == kind]
    return with_own(grown, name, zip(whose, grown.parameters[-1].elements, strict=True))


def _opened(
    model: Model, ends: Sequence[End]
) -> tuple[tuple[DerivativeBlock, ...], LowRank, float]:
    """(tangent, directions, unit of compliance) of ends that turn on equal springs."""
    turning: dict[tuple[int, int], list[int]] = {}
    for number, e, columns in ends:
        turning.setdefault((number, e), []).extend(columns)
    parts = []
    matrices = {
        n: model.blocks[n].combine(model.blocks[n].scalars(model.blocks[n].properties))["K"]
        for n in {n for n, _ in turning}
    }
    for (number, e), turned in turning.items():
        k, dofs = np.asarray(matrices[number][e], dtype=float), model.blocks[number].dofs[e]
        free = np.flatnonzero(dofs >= 0)
        parts.append((dofs[free], k[free][:, turned], k[turned][:, turned]))
    unit = 1.0 / float(np.mean(np.concatenate([np.diag(own) for _, _, own in parts])))
    used = np.unique(np.concatenate([dofs for dofs, _, _ in parts]))
    width = sum(len(own) for _, _, own in parts)
    across, within, first = np.zeros((len(used), width)), np.zeros((width, width)), 0
    for dofs, side, own in parts:
        here = slice(first, first + len(own))
        across[np.searchsorted(used, dofs), here] = side
        within[here, here] = own
        first += len(own)
    tangent = tuple(
        DerivativeBlock(dofs[None], (-unit * (side @ side.T))[None], None, None, None)
        for dofs, side, _ in parts
    )
    return tangent, opened(used, across, within, unit, np.ones_like), unit
