"""Straight members as chains: their elements one after the other, with the nodes between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.physics.draft import node_of
from cvxupdate.physics.members import straight


@dataclass(frozen=True)
class Chain:
    """``elements`` (n,) in their order along a straight member, ``nodes`` (n + 1,) at their ends
    (0: wholly held, so that no DOF has its number), ``lengths`` (n,) in m."""

    elements: tuple[int, ...]
    nodes: tuple[int, ...]
    lengths: tuple[float, ...]

    def at(self, element: int) -> tuple[float, float]:
        """Where an element begins and ends, m from the first node."""
        k = self.elements.index(element)
        begins = float(sum(self.lengths[:k]))
        return begins, begins + self.lengths[k]

    def stretch(self, elements: frozenset[int]) -> tuple[int, ...]:
        """The elements from the first to the last of some, all between them too."""
        found = [k for k, e in enumerate(self.elements) if e in elements]
        return self.elements[found[0] : found[-1] + 1] if found else ()


def chains(model: Model, of: str = "stiffness") -> list[Chain]:
    """Of every straight member of two elements and more (`straight`)."""
    ends = _ends(model)
    return [_chain(member, ends) for member in straight(model, of)]


def _ends(model: Model) -> dict[int, tuple[tuple[int, int], float]]:
    """Numbers of the two nodes (0: held) and length of every line element."""
    out: dict[int, tuple[tuple[int, int], float]] = {}
    for block in model.blocks:
        if block.kind.nodes != 2 or "length" not in block.properties:
            continue
        half = block.nodal.shape[1] // 2
        lengths = block.properties["length"]
        for i, row, length in zip(block.ids.tolist(), block.nodal, lengths, strict=True):
            a, b = (_number(model, part) for part in (row[:half], row[half:]))
            out[i] = (a, b), float(length)
    return out


def _number(model: Model, dofs: np.ndarray) -> int:
    there = dofs[dofs >= 0]
    return node_of(model, int(there[0])) if len(there) else 0


def _chain(member: tuple[int, ...], ends: dict[int, tuple[tuple[int, int], float]]) -> Chain:
    """Walked from an end: the one that has the smaller element number."""
    at: dict[int, list[int]] = {}
    for i in member:
        for node in ends[i][0]:
            at.setdefault(node, []).append(i)
    tips = [i for i in member if any(n == 0 or len(at[n]) == 1 for n in ends[i][0])]
    element = min(tips or member)
    a, b = ends[element][0]
    node = a if a == 0 or len(at[a]) == 1 else b
    elements, nodes = [element], [node]
    while True:
        a, b = ends[elements[-1]][0]
        node = b if node == a else a
        nodes.append(node)
        onward = [i for i in at.get(node, ()) if node and i not in elements]
        if not onward:
            break
        elements.append(onward[0])
    return Chain(tuple(elements), tuple(nodes), tuple(ends[i][1] for i in elements))


def beside(chain: Chain, elements: tuple[int, ...]) -> tuple[int | None, int | None]:
    """The elements before and after a stretch; None where the chain ends."""
    first, last = (chain.elements.index(e) for e in (elements[0], elements[-1]))
    before = chain.elements[first - 1] if first > 0 else None
    after = chain.elements[last + 1] if last + 1 < len(chain.elements) else None
    return before, after


def inner_joint(chain: Chain, node: int, element: int) -> bool:
    """Whether a node lies between two elements of a chain, of which one is given."""
    return any(
        inner == node and element in pair
        for inner, pair in zip(chain.nodes[1:-1], pairwise(chain.elements), strict=True)
    )
