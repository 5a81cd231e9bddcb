"""The matrices of a model in a space of few shapes, as its parameters move.

What no parameter moves is one matrix. Elements that always have one another's factors are one sum
for each of their terms (r × r). A model that is another one with a further effect differs from it
in a few elements and in the shapes that these bring: of the sums only the rows and columns of new
shapes are made, and elements with factors of their own stay apart, element by element. So a
hypothesis costs little beside the model that it grew from, in memory as in time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Target


@dataclass(frozen=True)
class Part:
    """Elements ``rows`` of block ``number`` that have the factors of its element ``row``: the sums
    (r, r) of their ``terms`` by number, zero ones left out, and what shapes that came later make of
    them in ``further`` columns (r + k, k)."""

    number: int
    row: int
    rows: tuple[int, ...]
    terms: Mapping[int, Real] = field(repr=False)
    further: Mapping[int, Real] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Apart:
    """Elements ``rows`` of block ``number`` with factors of their own, and the shapes at their
    DOFs, ``local`` (e, d, r); a part whose factors are those of element ``like`` has them in its
    sums (None: none has)."""

    number: int
    rows: Index
    local: Real = field(repr=False)
    like: int | None = None


@dataclass(frozen=True)
class Projected:
    """``fixed`` {"K": (r, r), …} of what no parameter moves, elements ``still`` of every block;
    ``parts`` and what is ``apart``."""

    fixed: Mapping[str, Real] = field(repr=False)
    still: tuple[Index, ...] = field(repr=False)
    parts: tuple[Part, ...]
    apart: tuple[Apart, ...] = ()

    @cached_property
    def _by_block(self) -> Mapping[int, list[Part]]:
        """Parts by the number of their block: the factors of all of them are worked out at once."""
        out: dict[int, list[Part]] = {}
        for part in self.parts:
            out.setdefault(part.number, []).append(part)
        return out

    def matrices(self, model: Model, p: Real) -> dict[str, Real]:
        """K, M, C and D at ``p``, (r, r) each."""
        out = {k: v.copy() for k, v in self.fixed.items()}
        values = model.properties(p) if self.parts or self.apart else []
        for number, parts in self._by_block.items():
            rows = [part.row for part in parts]
            own = {k: v[rows] for k, v in values[number].items()}
            for matrix, i, factors in model.blocks[number].scalars(own):
                for part, amount in zip(parts, np.real(factors).tolist(), strict=True):
                    if amount != 0.0 and i in part.terms:
                        _add(out[matrix], amount, part.terms[i], part.further.get(i))
        for apart in self.apart:
            for matrix, change in _own(model.blocks[apart.number], values, apart).items():
                out[matrix] += summed(change, apart.local)
        return out

    def rate(
        self, model: Model, values: Sequence[Mapping[str, Real]], target: Target
    ) -> dict[str, Real]:
        """∂K, ∂M, ∂C and ∂D (r, r) by what one parameter moves (``target``), zero ones left out,
        where the properties are ``values``."""
        block, own = model.blocks[target.block], values[target.block]
        at = {row: k for k, row in enumerate(target.rows.tolist())}
        out: dict[str, Real] = {}

        def rates(rows: Sequence[int]) -> list[tuple[str, int, Real]]:
            k = [at[row] for row in rows]
            return block.rates(own, target.rows[k], target.properties, target.scales[:, k])

        def matrix(name: str) -> Real:
            return out.setdefault(name, np.zeros_like(self.fixed[name]))

        parts = [part for part in self._by_block.get(target.block, ()) if part.row in at]
        for name, i, factors in rates([part.row for part in parts]) if parts else ():
            for part, amount in zip(parts, factors.tolist(), strict=True):
                if amount != 0.0 and i in part.terms:
                    _add(matrix(name), amount, part.terms[i], part.further.get(i))
        for apart in self.apart:
            if apart.number != target.block:
                continue
            moved = np.array([k for k, row in enumerate(apart.rows.tolist()) if row in at], int)
            rows = apart.rows[moved]
            for name, change in block.combine(rates(rows.tolist()), rows).items():
                matrix(name)[...] += summed(change, apart.local[moved])
            if apart.like is not None and apart.like in at:  # a part has that of it already
                theirs = [(n, i, np.resize(f, len(apart.rows))) for n, i, f in rates([apart.like])]
                for name, change in block.combine(theirs, apart.rows).items():
                    matrix(name)[...] -= summed(change, apart.local)
        return out


def projected(model: Model, V: Real) -> Projected:
    """Of a model in the shapes ``V`` (N, r)."""
    r = V.shape[1]
    fixed = {k: np.zeros((r, r)) for k in "KMCD"}
    parts: list[Part] = []
    still = []
    padded = _padded(V)
    today = model.properties(model.zero())
    for number, (block, own) in enumerate(zip(model.blocks, _moved(model), strict=True)):
        rest = np.array([e for e in range(len(block.ids)) if e not in own], dtype=np.int64)
        still.append(rest)
        for matrix, values in _combined(block, today[number], rest).items():
            fixed[matrix] += summed(values, padded[block.dofs[rest]])
        for rows in _alike(block, own, list(own)):
            local = padded[block.dofs[rows]]
            terms = {
                i: summed(values, local)
                for i, t in enumerate(block.terms)
                if np.any(values := t.values[block.geometry[rows]])
            }
            parts.append(Part(number, rows[0], tuple(rows), terms))
    return Projected(fixed, tuple(still), tuple(parts))


def grown(base: Projected, old: Model, model: Model, V: Real) -> Projected | None:
    """Of a ``model`` that is ``old`` with further parameters and elements; the first shapes of
    ``V`` are those in which ``base`` is the old one's. None where its elements are others."""
    if len(base.still) != len(old.blocks) or not alike(old, model):
        return None
    r = V.shape[1]
    k = r - base.fixed["K"].shape[0]
    padded, moved = _padded(V), _moved(model)
    today = model.properties(model.zero())
    parts, apart = [], []
    for part in base.parts:
        own, *others = _groups(part, model.blocks[part.number], moved[part.number])
        parts.append(_further(part, own[0], model.blocks[part.number], padded, k))
        apart += [_apart(part.number, model, rows, padded, own[0]) for rows in others]
    fixed = {name: np.pad(v, (0, k)) for name, v in base.fixed.items()}
    for number, block in enumerate(model.blocks):
        known = base.still[number] if number < len(base.still) else _NONE
        rest = known if number < len(base.still) else np.arange(len(block.ids))
        for matrix, values in _combined(block, today[number], known).items():
            if k:
                _border(fixed[matrix], summed(values, padded[block.dofs[known]], k))
        loose = [e for e in rest.tolist() if e in moved[number]]
        new = np.setdiff1d(rest, [*known.tolist(), *loose]).astype(np.int64)
        for matrix, values in _combined(block, today[number], new).items():
            fixed[matrix] += summed(values, padded[block.dofs[new]])
        gone = np.intersect1d(known, loose).astype(np.int64)
        for matrix, values in _combined(block, today[number], gone).items():
            fixed[matrix] -= summed(values, padded[block.dofs[gone]])
        if loose:
            apart.append(_apart(number, model, loose, padded, None))
    return Projected(fixed, (), tuple(parts), tuple(apart))


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


def _padded(V: Real) -> Real:
    """With a row of zeros for DOFs that are held."""
    return np.vstack([V, np.zeros((1, V.shape[1]))])


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


def _further(part: Part, row: int, block: Block, padded: Real, k: int) -> Part:
    """A part with the factors of another of its elements, and columns for the last k shapes."""
    further = {}
    if k:
        rows = list(part.rows)
        local = padded[block.dofs[rows]]
        further = {
            i: summed(block.terms[i].values[block.geometry[rows]], local, k) for i in part.terms
        }
    return Part(part.number, row, part.rows, part.terms, further)


def _apart(number: int, model: Model, rows: Sequence[int], padded: Real, like: int | None) -> Apart:
    own = np.array(rows, dtype=np.int64)
    return Apart(number, own, padded[model.blocks[number].dofs[own]], like)


def _own(block: Block, values: Sequence[Mapping[str, Real]], apart: Apart) -> dict[str, Real]:
    """Element matrices (e, d, d) less what a part has of them."""
    whole = values[apart.number]
    out = _combined(block, whole, apart.rows)
    if apart.like is not None:
        at = np.full(len(apart.rows), apart.like)
        theirs = block.scalars({k: v[at] for k, v in whole.items()})
        for matrix, less in block.combine(theirs, apart.rows).items():
            out[matrix] = out[matrix] - less if matrix in out else -less
    return out


def _combined(block: Block, properties: Mapping[str, Real], rows: Index) -> dict[str, Real]:
    """Element matrices of some rows."""
    if not len(rows):
        return {}
    scalars = block.scalars({k: v[rows] for k, v in properties.items()})
    return block.combine(scalars, rows)


def _add(out: Real, amount: float, term: Real, further: Real | None) -> None:
    """``amount`` times a bordered sum, in place."""
    n = len(term)
    out[:n, :n] += amount * term
    if further is not None:
        _border(out, amount * further)


def _border(out: Real, columns: Real) -> None:
    """The last columns (r, k) of a symmetric matrix, and its last rows, added in place."""
    r, k = columns.shape
    out[:, r - k :] += columns
    out[r - k :, : r - k] += columns[: r - k].T


def summed(values: Real, local: Real, last: int = 0) -> Real:
    """Σ Vᵀ T V over elements: values (e, d, d), local (e, d, r); of the ``last`` columns only where
    that is not 0."""
    e, d, r = local.shape
    right = local[:, :, r - last :] if last else local
    if not np.any(values):
        return np.zeros((r, right.shape[2]))
    moved = np.matmul(values, right).reshape(e * d, -1)
    return np.asarray(local.reshape(e * d, r).T @ moved)
