"""The matrices of a model in a space of few shapes, as its parameters move.

What no parameter moves is one matrix. Elements that always have one another's factors are one sum
for each of their terms (r × r). A model that is another one with a further effect differs from it
in a few elements and in the shapes that these bring: of the sums only the rows and columns of new
shapes are made, and elements with factors of their own stay apart, element by element. So a
hypothesis costs little beside the model that it grew from, in memory as in time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis.parts import Apart, Part, Projected, combined
from cvxupdate.fe.synthesis.products import grounded
from cvxupdate.fe.synthesis.sums import Sums, border, summed


def projected(model: Model, V: Real) -> Projected:
    """Of a model in the shapes ``V`` (N, r)."""
    r = V.shape[1]
    fixed = {k: np.zeros((r, r)) for k in "KMCD"}
    groups: list[tuple[int, list[int]]] = []
    still = []
    padded = grounded(V)
    today = model.properties(model.zero())
    for number, (block, own) in enumerate(zip(model.blocks, _moved(model), strict=True)):
        rest = np.array([e for e in range(len(block.ids)) if e not in own], dtype=np.int64)
        still.append(rest)
        for matrix, values in combined(block, today[number], rest).items():
            fixed[matrix] += summed(values, padded[block.dofs[rest]])
        groups += [(number, rows) for rows in _alike(block, own, list(own))]
    return Projected(fixed, tuple(still), *_summed_up(model, groups, padded, r))


def _summed_up(
    model: Model, groups: Sequence[tuple[int, list[int]]], padded: Real, r: int
) -> tuple[tuple[Part, ...], Sums]:
    """Rows of blocks that have one another's factors as parts. Their sums stand in the order of
    what is read together: by matrix, those that are idle today last."""
    today = model.properties(model.zero())
    entries: list[tuple[str, bool, int, int]] = []
    for k, (number, rows) in enumerate(groups):
        block = model.blocks[number]
        one = {name: v[rows[:1]] for name, v in today[number].items()}
        busy = {i for _, i, factor in block.scalars(one) if np.any(factor)}
        for i, t in enumerate(block.terms):
            if np.any(t.values[block.geometry[rows]]):
                entries.append((t.matrix, i not in busy, k, i))
    entries.sort()
    terms = np.empty((len(entries), r, r))
    places: list[dict[int, int]] = [{} for _ in groups]
    for at, (_, _, k, i) in enumerate(entries):
        number, rows = groups[k]
        block = model.blocks[number]
        own = block.terms[i].values[block.geometry[rows]]
        terms[at] = summed(own, padded[block.dofs[rows]])
        places[k][i] = at
    parts = tuple(
        Part(number, rows[0], tuple(rows), at)
        for (number, rows), at in zip(groups, places, strict=True)
    )
    return parts, Sums(terms)


def grown(base: Projected, old: Model, model: Model, V: Real) -> Projected | None:
    """Of a ``model`` that is ``old`` with further parameters and elements; the first shapes of
    ``V`` are those in which ``base`` is the old one's. None where its elements are others."""
    if len(base.still) != len(old.blocks) or not alike(old, model):
        return None
    r = V.shape[1]
    k = r - base.fixed["K"].shape[0]
    padded, moved = grounded(V), _moved(model)
    today = model.properties(model.zero())
    parts, apart = [], []
    for part in base.parts:
        own, *others = _groups(part, model.blocks[part.number], moved[part.number])
        parts.append(replace(part, row=own[0]))
        apart += [_apart(part.number, model, rows, padded, own[0]) for rows in others]
    fixed = {name: np.pad(v, (0, k)) for name, v in base.fixed.items()}
    for number, block in enumerate(model.blocks):
        known = base.still[number] if number < len(base.still) else _NONE
        rest = known if number < len(base.still) else np.arange(len(block.ids))
        for matrix, values in combined(block, today[number], known).items():
            if k:
                border(fixed[matrix], summed(values, padded[block.dofs[known]], k))
        loose = [e for e in rest.tolist() if e in moved[number]]
        new = np.setdiff1d(rest, [*known.tolist(), *loose]).astype(np.int64)
        for matrix, values in combined(block, today[number], new).items():
            fixed[matrix] += summed(values, padded[block.dofs[new]])
        gone = np.intersect1d(known, loose).astype(np.int64)
        for matrix, values in combined(block, today[number], gone).items():
            fixed[matrix] -= summed(values, padded[block.dofs[gone]])
        if loose:
            apart.append(_apart(number, model, loose, padded, None))
    sums = replace(base.sums, further=_further(model, parts, padded, k) if k else None)
    return Projected(fixed, (), tuple(parts), sums, tuple(apart))


_NONE: Index = np.zeros(0, dtype=np.int64)


def alike(old: Model, model: Model) -> bool:
    """Whether the elements of the old one are there as they were, and today have the same
    properties; where they were held they may be free."""
    pairs = zip(old.blocks, model.blocks, strict=False)
    return len(old.blocks) <= len(model.blocks) and all(
        a is b
        or (
            _on(a.dofs, b.dofs, old.size)
            and np.array_equal(a.geometry, b.geometry)
            and len(a.terms) == len(b.terms)
            and all(
                s.matrix == t.matrix
                and (s.values is t.values or np.array_equal(s.values, t.values))
                for s, t in zip(a.terms, b.terms, strict=True)
            )
            and a.properties.keys() == b.properties.keys()
            and all(np.array_equal(v, b.properties[k]) for k, v in a.properties.items())
        )
        for a, b in pairs
    )


def _on(old: Index, dofs: Index, size: int) -> bool:
    """Whether DOFs are the old ones, or new ones where these were held."""
    return old.shape == dofs.shape and bool(np.all((old == dofs) | ((old < 0) & (dofs >= size))))


Moved = Mapping[int, list[tuple[float, ...]]]


def _moved(model: Model) -> list[Moved]:
    """Of each block the elements that parameters move: by which, and how far each."""
    moved: list[dict[int, list[tuple[float, ...]]]] = [{} for _ in model.blocks]
    for j, parameter in enumerate(model.parameters):
        for t in parameter.targets:
            for row, scales in zip(t.rows.tolist(), t.scales.T.tolist(), strict=True):
                moved[t.block].setdefault(row, []).append((j, *scales))
    return list(moved)


def _alike(block: Block, moved: Moved, rows: Sequence[int]) -> list[list[int]]:
    """Rows that the same parameters move alike and that have the same properties."""
    groups: dict[tuple[object, ...], list[int]] = {}
    own = list(zip(*(v.tolist() for v in block.properties.values()), strict=True))
    for row in rows:
        groups.setdefault((*moved[row], *own[row]), []).append(row)
    return list(groups.values())


def _groups(part: Part, block: Block, moved: Moved) -> list[list[int]]:
    """The rows of a part by what moves them now, the largest first."""
    return sorted(_alike(block, moved, part.rows), key=len, reverse=True)


def _further(model: Model, parts: Sequence[Part], padded: Real, k: int) -> Real:
    """Columns (n, r, k) of all sums for the last k shapes."""
    out = np.empty((sum(len(part.terms) for part in parts), padded.shape[1], k))
    for part in parts:
        block, rows = model.blocks[part.number], list(part.rows)
        local = padded[block.dofs[rows]]
        for i, at in part.terms.items():
            out[at] = summed(block.terms[i].values[block.geometry[rows]], local, k)
    return out


def _apart(number: int, model: Model, rows: Sequence[int], padded: Real, like: int | None) -> Apart:
    own = np.array(rows, dtype=np.int64)
    return Apart(number, own, padded[model.blocks[number].dofs[own]], like)
