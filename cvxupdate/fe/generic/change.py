"""Families of element matrices as parameters of a model: entries of X and S, zero today.

Like the entries of whole matrices (`fe.whole`) these are blocks beside those of the elements, whose
terms are derivatives of element matrices. So they arrive in every method as any parameter does. The
loss factor and Rayleigh's coefficients of an element go along with its K and M.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements.base import Term
from cvxupdate.fe.generic.entries import GenericChange, entry_name
from cvxupdate.fe.generic.family import Classes, Family, family_of
from cvxupdate.fe.generic.pieces import Given, Piece, pieces_of
from cvxupdate.fe.generic.use import FamilyUse
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter, Target

UNITS = {"K": "N/m", "M": "kg"}  # of X, rotations being lengths
DAMPING = ("damping", "eta", "alpha", "beta")


class Choice(Protocol):
    """The family that a row of parameters asks for (`cvxupdate.spec.generic.FamilyTable`)."""

    @property
    def matrices(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def classes(self) -> Classes: ...  # noqa: D102
    @property
    def lowest_stiffness(self) -> int | None: ...  # noqa: D102
    @property
    def highest_mass(self) -> int | None: ...  # noqa: D102


class Wanted(Protocol):
    """One family: a name, element numbers (none: all), own bounds, and which family."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def elements(self) -> tuple[int, ...]: ...  # noqa: D102
    @property
    def group(self) -> str | None: ...  # noqa: D102
    @property
    def lower(self) -> float | None: ...  # noqa: D102
    @property
    def upper(self) -> float | None: ...  # noqa: D102
    @property
    def family(self) -> Choice | None: ...  # noqa: D102


@dataclass(frozen=True)
class Place:
    """Element ``number`` in the family ``use`` of all that are asked for, with the ``entries`` of X
    that move, ``values`` of them (none: zero)."""

    use: int
    number: int
    piece: Piece
    family: Family
    entries: tuple[tuple[int, int], ...]
    values: tuple[float, ...] = ()


def with_families(
    model: Model,
    wanted: Sequence[Wanted],
    given: Sequence[Given],
    lower: float = -np.inf,
    upper: float = np.inf,
) -> Model:
    """``model`` with every family of ``wanted`` as further parameters, one for each free entry;
    ``given`` are the matrices of other programs that the file has.

    Raises
    ------
    ModelError
        For an element without matrices of its own, in two families of one matrix, or unlike the
        others of its family.
    """
    if not wanted:
        return model
    pieces = pieces_of(model, frozenset(e for w in wanted for e in w.elements), given)
    found: dict[bytes, Family] = {}
    uses: list[FamilyUse] = []
    members: list[Place] = []
    for w in wanted:
        choice = w.family
        for matrix in choice.matrices if choice is not None else ():
            own = carrying(matrix, w.elements, pieces)
            if own and choice is not None:
                free = choice.lowest_stiffness if matrix == "K" else choice.highest_mass
                families = shared(matrix, choice.classes, free, own, found)
                members += [
                    Place(len(uses), e, q, f, f.entries)
                    for (e, q), f in zip(own, families, strict=True)
                ]
                uses.append(_use(w, matrix, own, families))
    _once(uses)
    blocks, parameters = list(model.blocks), list(model.parameters)
    for block, some in blocks_of(members):
        for number in dict.fromkeys(m.use for m in some):
            rows = np.array([i for i, m in enumerate(some) if m.use == number], dtype=np.int64)
            parameters += _parameters(uses[number], len(blocks), rows, lower, upper)
        blocks.append(block)
    return replace(
        model,
        blocks=tuple(blocks),
        parameters=tuple(parameters),
        families=(*model.families, *uses),
    )


def carrying(
    matrix: str, elements: Sequence[int], pieces: Mapping[int, Piece]
) -> list[tuple[int, Piece]]:
    """Those of ``elements`` that have the ``matrix`` "K" or "M"."""
    own = [(e, pieces[e]) for e in elements if e in pieces]
    return [(e, q) for e, q in own if np.any(q.K if matrix == "K" else q.M)]


def shared(
    matrix: str,
    classes: Classes,
    free: int | None,
    own: Sequence[tuple[int, Piece]],
    found: dict[bytes, Family],
) -> list[Family]:
    """The family of each element, their modes in one order with one set of signs; ``found`` keeps
    those of equal elements.

    Raises
    ------
    ModelError
        For a matrix that is none of a structure, or elements without modes in common.
    """
    out: list[Family] = []
    known: dict[bytes, Family] = {}
    for number, piece in own:
        key = piece.key + repr((matrix, classes, free)).encode()
        if key not in found:
            try:
                found[key] = family_of(matrix, piece.K, piece.M, piece.shape, classes, free)
            except ModelError as error:
                raise ModelError(f"update.parameters: element {number}: {error}") from error
        if key not in known:
            first = own[0][1]
            known[key] = (
                found[key]
                if piece is first
                else found[key].aligned(piece.local, out[0], first.local)
            )
        out.append(known[key])
    return out


def _use(
    w: Wanted, matrix: str, own: Sequence[tuple[int, Piece]], families: Sequence[Family]
) -> FamilyUse:
    stem = w.name.removesuffix(".generic")
    distinct = {id(f): (f, q) for (_, q), f in zip(own, families, strict=True)}
    bounds = (w.lower, w.upper)
    return FamilyUse(
        f"{stem}.{matrix}",
        matrix,
        tuple(f"{stem}.{entry_name(matrix, i, j)}" for i, j in families[0].entries),
        tuple(e for e, _ in own),
        w.group,
        tuple(f for f, _ in distinct.values()),
        tuple(q.shape for _, q in distinct.values()),
        bounds,
        "own" if w.family is not None and w.family.classes == "own" else "symmetry",
    )


def _once(uses: Sequence[FamilyUse]) -> None:
    seen: dict[tuple[str, int], str] = {}
    for use in uses:
        for e in use.elements:
            if (use.matrix, e) in seen:
                raise ModelError(
                    f"update.parameters: element {e} is in two families, {seen[use.matrix, e]} "
                    f"and {use.name}. Name it in one of them."
                )
            seen[use.matrix, e] = use.name


def blocks_of(members: Sequence[Place]) -> Iterator[tuple[Block, list[Place]]]:
    """Elements of one size and one set of entries go together. Their numbers stand in the kind, not
    as those of the block: no factor on an element acts on them."""
    together: dict[tuple[str, int, tuple[tuple[int, int], ...]], list[Place]] = {}
    for m in members:
        key = (m.family.matrix, len(m.piece.dofs), m.entries)
        together.setdefault(key, []).append(m)
    for (matrix, _, entries), some in together.items():
        kind = GenericChange(matrix, entries, tuple(m.number for m in some))
        distinct = {id(m.family): m.family for m in some}
        number = {key: i for i, key in enumerate(distinct)}
        terms = tuple(
            Term(matrix, name, np.array([f.unit(i, j) for f in distinct.values()]))
            for name, (i, j) in zip(kind.properties, kind.entries, strict=True)
        )
        n = len(some)
        properties = {k: np.full(n, v) for k, v in COMMON.items()}
        properties |= {k: np.array([m.piece.properties[k] for m in some]) for k in DAMPING}
        values = np.array([m.values or (0.0,) * len(entries) for m in some])
        properties |= dict(zip(kind.properties, values.T.copy(), strict=True))
        yield (
            Block(
                kind,
                np.zeros(n, dtype=np.int64),
                ("",) * n,
                np.array([m.piece.dofs for m in some]),
                np.array([m.piece.kind for m in some]),
                terms,
                np.array([number[id(m.family)] for m in some], dtype=np.int64),
                properties,
            ),
            some,
        )


def _parameters(
    use: FamilyUse, block: int, rows: Index, lower: float, upper: float
) -> Iterator[Parameter]:
    """X in N/m or S in kg where all elements have one family, else relative to each one's own."""
    family = use.families[0]
    low, high = (
        own if own is not None else common
        for own, common in zip(use.bounds, (lower, upper), strict=True)
    )
    alone = len(use.families) == 1
    for name, (i, j) in zip(use.columns, family.entries, strict=True):
        size = family.sizes[i] * family.sizes[j] if alone else 1.0
        yield Parameter(
            name,
            "generic",
            (Target(block, rows, (entry_name(use.matrix, i, j),), np.ones((1, len(rows)))),),
            low,
            high,
            float(size * family.nominal[i, j]),
            float(size / (1.0 if i == j else np.sqrt(2.0))),
            UNITS[use.matrix] if alone else "1",
            use.elements,
            use.group,
        )
