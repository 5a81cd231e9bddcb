"""``joint_flexibility``: the end of a beam turns on a spring where the model joins it rigidly
(Friswell and Mottershead 1995, 3.4)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import final

import numpy as np

from cvxupdate.fe.block import Block
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.compliance import RIGID, SOFTEST, Compliance, write
from cvxupdate.physics.context import Real, SearchContext
from cvxupdate.physics.effect import Effect, EffectType, ModelChange
from cvxupdate.physics.growth import append_parameters, limited, small_block
from cvxupdate.physics.place import Place, at, capital, where
from cvxupdate.physics.quantity import stiffness
from cvxupdate.physics.units import quantity

LIMITS = (0.0, SOFTEST)
OPENED = "@"  # in the label of a rotation of an end that turns by itself
CLASS, SPRUNG = "its class does", "the model has it"  # than which one gives way more
End = tuple[int, int, tuple[int, ...]]  # number of a block, row in it, columns that turn


@final
class JointFlexibility(EffectType):
    """A joint that turns on a spring."""

    name = "joint_flexibility"
    noun = "a joint that gives way"
    writers = (("compliance", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """One at every beam end that meets another element: the rotations of that end get DOFs of
        their own, joined to the node by one compliance about every active axis. The tangent is −k_i
        k_iᵀ of the element, exact for a rigid joint. At a node of two beams in line, one end stands
        for both. One that gives way as all of its class do may give way more than these, and so
        may one that a spring of the model joins (as in a model that was brought to its reference).
        """
        beams = [(n, b) for n, b in enumerate(context.model.blocks) if is_beam(b)]
        meeting = Counter(int(b.dofs[e, turning[0]]) for _, b in beams for e, turning in ends_of(b))
        sprung = _sprung(context.model)
        out, done = list[Effect](), set[int]()
        for number, block in beams:
            matrices = block.combine(block.scalars(block.properties)).get("K")
            if matrices is None:
                continue
            for e, columns in ends_of(block):
                first = int(block.dofs[e, columns[0]])
                beyond, opened = sprung.get(first, {}), OPENED in context.model.labels[first]
                joined = meeting[first] + len(beyond)
                if (joined < 2 and not opened) or (joined == 2 and first in done):
                    continue
                done.update((first, *(beyond if joined == 2 else ())))
                alone, k = meeting[first] < 2, sum(beyond.values())
                within = 1.0 / k if alone and k > 0.0 else 0.0
                k_end = np.asarray(matrices[e])
                one = self.at_end(context.model, number, e, columns, k_end, within)
                more = f"{at(one.place)} more than {SPRUNG if within else CLASS}"
                out.append(replace(one, spot=more) if alone else one)
        return out

    def at_end(
        self, model: Model, number: int, e: int, columns: list[int], k: Real, within: float = 0.0
    ) -> Effect:
        """At the end of row ``e`` of a block that has these columns, of stiffness ``k`` (d, d);
        ``within``: compliance of the model's own spring in the joint, of which the figure is
        told together with what more gives way."""
        block = model.blocks[number]
        node = int(model.node_ids[model.dof_node[block.dofs[e, columns[0]]]])
        unit = 1.0 / float(np.mean(k[columns, columns]))
        free = np.flatnonzero(block.dofs[e] >= 0)
        bend = np.sum([np.outer(k[free, c], k[c, free]) for c in columns], axis=0)
        dofs = block.dofs[e][free][None]
        tangent = DerivativeBlock(dofs, (-bend * unit)[None], None, None, None)
        name = f"joint@e{int(block.ids[e])}n{node}"
        grow = partial(opened_model, model, [(number, e, tuple(columns))], unit, name)
        dof = KINDS[int(block.direction[0, columns[0]])]
        place = Place(nodes=(node,), elements=(int(block.ids[e]),), dof=dof)
        figures = (stiffness("k", "N·m/rad", unit / RIGID + within),)
        change = ModelChange(grow, ((tangent,),), series=True)
        return Effect(self, place, change, figures, 1, LIMITS)

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """The spring that it turns on."""
        k = quantity(values["k"], "N·m/rad")
        joint, rigid = capital(where(effect.place)), "while the model joins it rigidly"
        if effect.spot.endswith(SPRUNG):
            return f"{joint} gives way more than {SPRUNG}: it turns on a spring of {k} in all."
        if effect.spot:
            return f"{joint} gives way more than {CLASS}: by a further spring of {k} in series."
        return f"{joint} gives way: it turns on a spring of {k}, {rigid}."


def _sprung(model: Model) -> dict[int, dict[int, float]]:
    """The rotations (rows) that springs join to others at the same point: to which, and by what
    stiffness (N·m/rad)."""
    out: dict[int, dict[int, float]] = {}
    for block in model.blocks:
        if block.kind.name != "spring" or block.dofs.shape[1] != 2:
            continue
        k = np.asarray(block.combine(block.scalars(block.properties))["K"])[:, 0, 0]
        for pair, own in zip(block.dofs, k.tolist(), strict=True):
            if pair.min() < 0 or model.dof_kind[pair[0]] < 3:
                continue
            here, there = model.xyz[model.dof_node[pair]]
            if np.array_equal(here, there):
                for one, other in (pair.tolist(), pair[::-1].tolist()):
                    beyond = out.setdefault(one, {})
                    beyond[other] = beyond.get(other, 0.0) + own
    return out


def is_beam(block: Block) -> bool:
    """Whether its elements are beams."""
    return block.kind.name in ("beam2d", "beam3d")


def ends_of(block: Block) -> Iterator[tuple[int, list[int]]]:
    """(row, columns of its free rotations) of every end that has any."""
    half = block.nodal.shape[1] // 2
    for e in range(len(block.ids)):
        for first in (0, half):
            columns = [
                first + i
                for i in range(half)
                if block.direction[0, i] >= 3 and block.dofs[e, first + i] >= 0
            ]
            if columns:
                yield e, columns


def opened_model(model: Model, ends: Sequence[End], unit: float, name: str) -> Model:
    """The model with free rotations of ends (block, row, columns) on DOFs of their own, each joined
    to its node by a spring of one compliance, the parameter."""
    dofs = [b.dofs.copy() for b in model.blocks]
    labels = list(model.labels)
    rows: list[int] = []
    kinds: list[int] = []
    for number, e, columns in ends:
        block = model.blocks[number]
        for c in columns:
            row, kind = int(block.dofs[e, c]), int(block.direction[0, c])
            node, element = int(model.node_ids[model.dof_node[row]]), int(block.ids[e])
            dofs[number][e, c] = len(labels)
            times = 1 + labels[row].count(OPENED)
            labels.append(f"n{node}{OPENED * times}e{element}.{KINDS[kind]}")
            rows.append(row)
            kinds.append(kind)
    grown: Model = replace(
        model,
        labels=tuple(labels),
        dof_node=np.append(model.dof_node, model.dof_node[rows]),
        dof_kind=np.append(model.dof_kind, kinds),
        blocks=tuple(replace(b, dofs=d) for b, d in zip(model.blocks, dofs, strict=True)),
    )
    ids: list[int] = []
    for kind in dict.fromkeys(kinds):
        which = [i for i, k in enumerate(kinds) if k == kind]
        springs = small_block(
            grown,
            Compliance(2, KINDS[kind]),
            np.array([[rows[i], model.size + i] for i in which]),
            [kind] * 2,
            "K",
            np.array([[1.0, -1.0], [-1.0, 1.0]]),
            {"a": 0.0, "a0": unit / RIGID},
        )
        ids += springs.ids.tolist()
        grown = replace(grown, blocks=(*grown.blocks, springs))
    return append_parameters(grown, [limited(name, "a", ids, LIMITS, unit)])
