"""The parts of a model in a space of few shapes, and its matrices there as parameters move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cvxupdate.fe.block import STEP, Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Target
from cvxupdate.fe.synthesis.sums import Sums, summed


@dataclass(frozen=True)
class Part:
    """Elements ``rows`` of block ``number`` that have the factors of its element ``row``; where
    the sum of each of their ``terms``, by number, stands among all sums, zero ones left out."""

    number: int
    row: int
    rows: tuple[int, ...]
    terms: Mapping[int, int]


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
    ``parts``, their ``sums`` and what is ``apart``."""

    fixed: Mapping[str, Real] = field(repr=False)
    still: tuple[Index, ...] = field(repr=False)
    parts: tuple[Part, ...]
    sums: Sums
    apart: tuple[Apart, ...] = ()

    @cached_property
    def _by_block(self) -> Mapping[int, list[Part]]:
        """Parts by the number of their block: the factors of all of them are worked out at once."""
        out: dict[int, list[Part]] = {}
        for part in self.parts:
            out.setdefault(part.number, []).append(part)
        return out

    @cached_property
    def _places(self) -> Mapping[int, Mapping[int, Index]]:
        """Of every block with parts and each term that any of them has: where its sums stand,
        (parts,), −1 where they are zero."""
        return {
            n: {
                i: np.array([x.terms.get(i, -1) for x in own], dtype=np.int64)
                for i in {i for x in own for i in x.terms}
            }
            for n, own in self._by_block.items()
        }

    def matrices(self, model: Model, p: Real) -> dict[str, Real]:
        """K, M, C and D at ``p``, (r, r) each."""
        out = {k: v.copy() for k, v in self.fixed.items()}
        values = model.properties(p) if self.parts or self.apart else []
        weights = {k: np.zeros(len(self.sums.terms)) for k in self.fixed}
        for number, parts in self._by_block.items():
            rows = [part.row for part in parts]
            own = {k: v[rows] for k, v in values[number].items()}
            for matrix, i, factors in model.blocks[number].scalars(own):
                if i in self._places[number]:
                    places = self._places[number][i]
                    live = places >= 0
                    weights[matrix][places[live]] += np.broadcast_to(factors, len(parts))[live]
        for matrix, own_weights in weights.items():
            self.sums.add(out[matrix], own_weights)
        for apart in self.apart:
            for matrix, change in _own(model.blocks[apart.number], values, apart).items():
                out[matrix] += summed(change, apart.local)
        return out

    def rates(
        self, model: Model, values: Sequence[Mapping[str, Real]], targets: Sequence[Target]
    ) -> list[dict[str, Real]]:
        """∂K, ∂M, ∂C and ∂D (r, r) by what each of ``targets`` moves, zero ones left out, where the
        properties are ``values``."""
        weights = {k: np.zeros((len(targets), len(self.sums.terms))) for k in self.fixed}
        for number in {t.block for t in targets} & self._by_block.keys():
            self._weigh(number, model.blocks[number], values[number], targets, weights)
        out = []
        for k, target in enumerate(targets):
            own: dict[str, Real] = {}
            for name, every in weights.items():
                if np.any(every[k]):
                    own[name] = np.zeros_like(self.fixed[name])
                    self.sums.add(own[name], every[k])
            for apart in self.apart:
                if apart.number == target.block:
                    self._beside(own, model.blocks[apart.number], values, target, apart)
            out.append(own)
        return out

    def _weigh(
        self,
        number: int,
        block: Block,
        values: Mapping[str, Real],
        targets: Sequence[Target],
        weights: Mapping[str, Real],
    ) -> None:
        """How much of each sum every target's rate has, of one block: all at once, by a complex
        step."""
        parts = self._by_block[number]
        which, whose, places = [], [], []
        for k, t in enumerate(targets):
            at = {row: i for i, row in enumerate(t.rows.tolist())} if t.block == number else {}
            mine = [i for i, part in enumerate(parts) if part.row in at]
            which += mine
            whose += [k] * len(mine)
            places += [at[parts[i].row] for i in mine]
        if not which:
            return
        local = {k: v[[parts[i].row for i in which]].astype(complex) for k, v in values.items()}
        moved = np.array(whose)
        for k in set(whose):
            own = moved == k
            scales = targets[k].scales[:, np.array(places)[own]]
            for name, scale in zip(targets[k].properties, scales, strict=True):
                local[name][own] += 1j * STEP * scale
        known = self._places[number]
        for name, i, factors in (x for x in block.scalars(local) if x[1] in known):
            change = np.broadcast_to(np.imag(factors) / STEP, len(which))
            at_sums = known[i][which]
            live = (at_sums >= 0) & (change != 0.0)
            np.add.at(weights[name], (moved[live], at_sums[live]), change[live])

    def _beside(
        self,
        out: dict[str, Real],
        block: Block,
        values: Sequence[Mapping[str, Real]],
        target: Target,
        apart: Apart,
    ) -> None:
        """What a target moves of elements with factors of their own, added to ``out``."""
        at = {row: k for k, row in enumerate(target.rows.tolist())}

        def rates(rows: Sequence[int]) -> list[tuple[str, int, Real]]:
            k, own = [at[row] for row in rows], values[target.block]
            return block.rates(own, target.rows[k], target.properties, target.scales[:, k])

        moved = np.array([k for k, row in enumerate(apart.rows.tolist()) if row in at], int)
        rows = apart.rows[moved]
        for name, change in block.combine(rates(rows.tolist()), rows).items():
            there = out.setdefault(name, np.zeros_like(self.fixed[name]))
            there += summed(change, apart.local[moved])
        if apart.like is not None and apart.like in at:  # a part has that of it already
            theirs = [(n, i, np.resize(f, len(apart.rows))) for n, i, f in rates([apart.like])]
            for name, change in block.combine(theirs, apart.rows).items():
                there = out.setdefault(name, np.zeros_like(self.fixed[name]))
                there -= summed(change, apart.local)


def _own(block: Block, values: Sequence[Mapping[str, Real]], apart: Apart) -> dict[str, Real]:
    """Element matrices (e, d, d) less what a part has of them."""
    whole = values[apart.number]
    out = combined(block, whole, apart.rows)
    if apart.like is not None:
        at = np.full(len(apart.rows), apart.like)
        theirs = block.scalars({k: v[at] for k, v in whole.items()})
        for matrix, less in block.combine(theirs, apart.rows).items():
            out[matrix] = out[matrix] - less if matrix in out else -less
    return out


def combined(block: Block, properties: Mapping[str, Real], rows: Index) -> dict[str, Real]:
    """Element matrices of some rows."""
    if not len(rows):
        return {}
    scalars = block.scalars({k: v[rows] for k, v in properties.items()})
    return block.combine(scalars, rows)
