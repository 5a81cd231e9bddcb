"""Growing a model by parameters and elements that have no effect yet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements.base import Element, Term
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import has_property, property_names, select_parameters
from cvxupdate.physics.context import Real


@dataclass(frozen=True)
class Wanted:
    """A parameter to select on a model (see `cvxupdate.fe.select.Wanted`)."""

    name: str
    of: str
    elements: tuple[int, ...]
    group: str | None = None
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None


def new_ids(model: Model, count: int) -> NDArray[np.int64]:
    """Element numbers that are not used yet."""
    top = max((int(b.ids.max(initial=0)) for b in model.blocks), default=0)
    return np.arange(top + 1, top + 1 + count, dtype=np.int64)


def small_block(
    model: Model,
    kind: Element,
    dofs: NDArray[np.int64],
    directions: Sequence[int],
    term: str,
    pattern: Real,
    properties: Mapping[str, float],
    group: str = "",
) -> Block:
    """A block of a few new elements: ``dofs`` (e, d), one geometric term each."""
    n = len(dofs)
    values = {
        **{k: np.full(n, v) for k, v in COMMON.items()},
        **{k: np.full(n, v) for k, v in properties.items()},
    }
    terms = tuple(Term(term, name, pattern[None]) for name in kind.coefficients(values))
    return Block(
        kind,
        new_ids(model, n),
        (group,) * n,
        dofs,
        np.array([directions]),
        terms,
        np.zeros(n, dtype=np.int64),
        values,
    )


def with_block(
    model: Model, block: Block, name: str, of: str, limits: tuple[float, float], unit: float
) -> Model:
    """The model with a block added, and one parameter on a property of all its elements."""
    grown = replace(model, blocks=(*model.blocks, block))
    return append_parameters(grown, [limited(name, of, block.ids.tolist(), limits, unit)])


def limited(
    name: str,
    of: str,
    elements: Sequence[int],
    limits: tuple[float, float],
    scale: float | None = None,
) -> Wanted:
    """A parameter within ``limits`` on the property ``of`` of elements."""
    return Wanted(name, of, tuple(elements), None, *limits, scale)


def append_parameters(model: Model, wanted: Sequence[Wanted]) -> Model:
    """The model with parameters appended; a name that is taken gets a number."""
    taken = {q.name for q in model.parameters}
    fresh = [
        replace(w, name=w.name if w.name not in taken else f"{w.name} ({len(taken)})")
        for w in wanted
    ]
    added: tuple[Parameter, ...] = select_parameters(fresh, model)
    return model.with_parameters((*model.parameters, *added))


def tangents(model: Model, extra: int) -> tuple[tuple[DerivativeBlock, ...], ...]:
    """Derivative blocks of the last ``extra`` parameters at p = 0."""
    return tuple(model.derivative(len(model.parameters) - extra + k) for k in range(extra))


@dataclass(frozen=True)
class Rates:
    """What a property does to the matrices of every element at p = 0, formed once: sets of elements
    share it.

    ``blocks``: number, (dofs (n, d), {"K": (n, d, d), …}, which elements it moves {"K": (n,), …})
    of each block that has the property; ``places`` the (block, row) of each element number.
    """

    blocks: Mapping[int, tuple[Index, Mapping[str, Real], Mapping[str, NDArray[np.bool_]]]]
    places: Mapping[int, Sequence[tuple[int, int]]]

    @classmethod
    def of(cls, model: Model, of: str, scale: float | None = None) -> Rates:
        """Of the property ``of``, in shares of its value, or by ``scale`` where it is zero (see
        `select_parameters`)."""
        names = property_names(of)
        blocks: dict[int, tuple[Index, Mapping[str, Real], Mapping[str, NDArray[np.bool_]]]] = {}
        places: dict[int, list[tuple[int, int]]] = {}  # a given matrix has a block for each entry
        for number, block in enumerate(model.blocks):
            if has_property(block, of):
                base = np.array([block.properties[n] for n in names])
                rates = block.derivative(
                    block.properties,
                    np.arange(len(block.ids)),
                    names,
                    np.where(base != 0.0, base, scale or 0.0),
                )
                blocks[number] = (
                    block.dofs,
                    rates,
                    {m: np.any(v != 0.0, axis=(1, 2)) for m, v in rates.items()},
                )
                for row, element in enumerate(block.ids.tolist()):
                    places.setdefault(element, []).append((number, row))
        return cls(blocks, places)

    def tangent(self, ids: Sequence[int]) -> tuple[DerivativeBlock, ...]:
        """Derivative blocks of one parameter on the elements ``ids``, those without effect left
        out."""
        chosen: dict[int, list[int]] = {}
        for element in ids:
            for number, row in self.places.get(element, ()):
                chosen.setdefault(number, []).append(row)
        out = []
        for number in sorted(chosen):
            dofs, rates, moving = self.blocks[number]
            rows = np.array(chosen[number])
            parts = {m: v[rows] for m, v in rates.items() if np.any(moving[m][rows])}
            if parts:
                out.append(
                    DerivativeBlock(
                        dofs[rows], parts.get("K"), parts.get("M"), parts.get("C"), parts.get("D")
                    )
                )
        return tuple(out)


def at_once(
    dofs: Sequence[int], matrix: str, values: Real
) -> tuple[tuple[DerivativeBlock, ...], ...]:
    """`ModelChange.tangent` of one element that adds ``values`` (d, d) to one matrix per unit of
    p."""
    parts = {m: values[None] if m == matrix else None for m in "KMCD"}
    return (
        (
            DerivativeBlock(
                np.array([dofs], dtype=np.int64), parts["K"], parts["M"], parts["C"], parts["D"]
            ),
        ),
    )


def dof_rows(model: Model, kinds: Sequence[str]) -> list[tuple[int, int, str]]:
    """(row, node id, kind) of the free DOFs of the given kinds."""
    return [
        (i, int(model.node_ids[n]), KINDS[k])
        for i, (n, k) in enumerate(
            zip(model.dof_node.tolist(), model.dof_kind.tolist(), strict=True)
        )
        if k < len(KINDS) and KINDS[k] in kinds and "@" not in model.labels[i]
    ]
