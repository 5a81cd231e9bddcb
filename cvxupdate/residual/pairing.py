"""Which mode of the model each measured mode is, at the start and along the iteration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate import pair_frequencies, pair_modes
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.book import AGAIN, Book
from cvxupdate.residual.shape_rows import (
    Index,
    Who,
    alike,
    channel_rows,
    real_shapes,
    shape_entries,
    visible,
)

FAR = 0.5  # of MAC for each unit of the logarithm of a frequency ratio
# logarithm of a frequency ratio that no gross effect makes beside the modes that are paired
GROSS = 0.4
MARGIN = 6  # model modes beyond the highest paired one, for modes that cross


@dataclass(frozen=True)
class Start:
    """A pairing: ``modes`` of a model and, for each table, the place of every measured mode among
    all of them (−1: none).

    ``loose`` says, table by table, which modes were paired by frequency alone, so that another
    pairing may be tried.
    """

    modes: Modes
    places: tuple[Index, ...]
    loose: tuple[NDArray[np.bool_], ...] = ()


def needed_modes(tables: Sequence[ModeTable]) -> int:
    """How many flexible modes of the model the pairing may need."""
    fixed = max((int(t.pairs.max(initial=0)) for t in tables), default=0)
    count = sum(len(t.frequency) for t in tables)
    return max(fixed, count) + MARGIN


def pairing_modes(model: Model, tables: Sequence[ModeTable], rule: str) -> Modes:
    """Modes of the initial model, enough to pair: a table may begin far above the model's lowest
    mode.

    Raises
    ------
    ModelError
        When the model is no structure.
    """
    count = needed_modes(tables)
    searched = [t.frequency[(t.pairs <= 0) | (rule in ("mac", "frequency"))] for t in tables]
    top = 1.2 * max((float(f.max(initial=0.0)) for f in searched), default=0.0)
    while True:
        modes = model_modes(model, count, model.zero())
        found = len(modes.eigenvalues) - modes.rigid
        if found < count or not found or modes.frequencies[-1] >= top:
            return modes
        count *= 2


def start_pairing(
    model: Model,
    modes: Modes,
    tables: Sequence[ModeTable],
    rule: str = "auto",
    first: int | None = None,
    given: Sequence[Index] | None = None,
) -> Start:
    """Pair all measured modes at once, so that no model mode serves twice in a table, nor two modes
    of different tables unless they are one.

    A mode that the problem file pairs keeps its partner. The others go by MAC where they have
    shapes, else by frequency (the assignment of least squared relative distance, whatever the
    order). ``rule`` "fixed", "mac" or "frequency" forbids the other ways. The ``first`` tables
    (those to fit; None: all) choose before the others, so that what is only scored never changes
    what is fitted; ``given`` are places of theirs already found.

    Tables may be parts of one list of modes or measurements of the same modes again: partners that
    the file names count in each table on its own, and an open mode whose frequency another table
    has within `AGAIN` (and whose shape is not unlike that one's) is taken to be the same mode.

    Raises
    ------
    InputError
        When the rule cannot pair every mode: a fixed partner that is not there or is used twice in
        a table, no shapes for "mac".
    """
    book = Book(
        tables,
        modes.flexible(),
        [np.full(len(t.frequency), -1, dtype=np.int64) for t in tables],
        [np.zeros(len(t.frequency), dtype=bool) for t in tables],
        {},
    )
    count = len(tables) if first is None else first
    if given is None:
        _pair(model, book, range(count), rule, True)
    else:
        for k, places in enumerate(given):
            for i, place in enumerate(places.tolist()):
                if place >= modes.rigid:
                    book.pair(k, i, place - modes.rigid)
    _pair(model, book, range(count, len(tables)), rule, given is None)
    return Start(
        modes, tuple(np.where(p >= 0, p + modes.rigid, -1) for p in book.places), tuple(book.loose)
    )


def _pair(model: Model, book: Book, numbers: Sequence[int], rule: str, strict: bool) -> None:
    """Pair the tables ``numbers``; a partner that is taken is an error, or where not ``strict``
    leaves the mode without one."""
    open_: list[tuple[int, int]] = []
    for k in numbers:
        table = book.tables[k]
        for i, pair in enumerate(table.pairs.tolist()):
            if rule in ("mac", "frequency") or (pair <= 0 and rule != "fixed"):
                open_.append((k, i))
            elif pair <= 0:
                raise InputError(
                    f"{table.origin.source}: pairing is fixed, but the mode at "
                    f"{table.frequency[i]:.4g} Hz names no `mode`. Give one."
                )
            elif pair > len(book.flexible.eigenvalues):
                raise InputError(
                    f"{table.origin.source}: the mode at {table.frequency[i]:.4g} Hz has mode "
                    f"= {pair}, but the model has only {len(book.flexible.eigenvalues)} "
                    "flexible modes. Correct `mode`, or refine the model."
                )
            elif pair - 1 not in book.taken or book.shared(k, i, pair - 1):
                book.pair(k, i, pair - 1)
            elif strict:
                other, j = book.taken[pair - 1]
                raise InputError(
                    f"{table.origin.source}: the measured modes "
                    f"{book.tables[other].frequency[j]:.4g} Hz and {table.frequency[i]:.4g} "
                    f"Hz are both paired with mode {pair} of the model. Give each its own "
                    "`mode`."
                )
    repeats = _again(model, book, open_, numbers)
    new = [who for who in open_ if who not in repeats]
    left = new if rule == "frequency" else _by_shape(model, book, new)
    if left and rule == "mac":
        k, i = left[0]
        why = (
            "has no shape at two DOFs of the model"
            if len(shape_entries(model, book.tables[k], i)[0]) < 2
            else "resembles none of the model's that is left"
        )
        raise InputError(
            f"{book.tables[k].origin.source}: pairing is by MAC, but the mode at "
            f"{book.tables[k].frequency[i]:.4g} Hz {why}. "
            'Use pairing = "auto", or give its `mode`.'
        )
    free = book.free()
    if left and len(free):
        found = pair_frequencies(
            book.flexible.frequencies[free],
            np.array([book.tables[k].frequency[i] for k, i in left]) * book.off,
        )
        for a, x in zip(found.model, found.measured, strict=True):
            book.pair(*left[int(x)], int(free[a]), loose=True)
    for (k, i), (other, j) in repeats.items():
        mode = int(book.places[other][j])
        if mode >= 0 and mode not in book.places[k]:
            book.pair(k, i, mode, loose=bool(book.loose[other][j]))


def _again(
    model: Model, book: Book, open_: Sequence[Who], numbers: Sequence[int]
) -> dict[Who, Who]:
    """Open modes that another table measured too, each with that one; of two that are open, the one
    with the fuller shape stays to be paired."""
    out: dict[Who, Who] = {}
    known: list[Who] = [
        (k, i)
        for k in range(len(book.tables))
        if k not in numbers
        for i in np.flatnonzero(book.places[k] >= 0).tolist()
    ]
    full = {
        k: 0 if (shapes := book.tables[k].shapes) is None else int(np.isfinite(shapes).sum())
        for k in numbers
    }
    for k in sorted(numbers, key=lambda k: -full[k]):
        mine = [i for kk, i in open_ if kk == k]
        if mine and known:
            near = pair_frequencies(
                np.array([book.tables[a].frequency[b] for a, b in known]),
                book.tables[k].frequency[mine],
                limit=AGAIN,
            )
            twins = [
                ((k, mine[int(x)]), known[int(a)])
                for a, x in zip(near.model, near.measured, strict=True)
            ]
            out |= {who: twin for who, twin in twins if alike(model, book.tables, who, twin)}
        known += [(k, i) for i in range(len(book.tables[k].frequency)) if (k, i) not in out]
    return out


def _by_shape(model: Model, book: Book, open_: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Pair by MAC the open modes that have shapes; returns those still open."""
    left = []
    for k in sorted({k for k, _ in open_}):
        table = book.tables[k]
        mine = [i for kk, i in open_ if kk == k]
        chosen = [i for i in mine if len(shape_entries(model, table, i)[0]) >= 2]
        free = book.free()
        if table.shapes is None or not chosen or not len(free):
            left += [(k, i) for i in mine]
            continue
        rows = channel_rows(table, model)
        seen = rows >= 0
        free = free[visible(book.flexible.shapes[:, free], rows[seen])]
        found = pair_modes(
            book.flexible.shapes[rows[seen]][:, free],
            real_shapes(table.shapes)[chosen][:, seen].T,
            book.flexible.frequencies[free],
            table.frequency[chosen] * book.off,
            threshold=0.3,
        )
        apart = np.log(book.flexible.frequencies[free[found.model]])
        apart -= np.log(table.frequency[np.array(chosen)[found.measured]])
        # what is further off than all are together is another mode that a few sensors see alike
        together = np.median([*book.apart, *apart]) if len(apart) else 0.0
        off = np.abs(apart - together)
        near = found.mac > FAR * off
        if book.telling:
            near &= off <= GROSS
        for a, x in zip(found.model[near], found.measured[near], strict=True):
            book.pair(k, chosen[int(x)], int(free[a]))
        paired = {chosen[int(x)] for x in found.measured[near]}
        left += [(k, i) for i in mine if i not in paired]
    return left


def used_places(places: Sequence[Index]) -> Index:
    """Every mode of the model that some measured mode is paired with."""
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *places]))
    return every[every >= 0]


def highest_of(places: Sequence[Index]) -> int:
    """The highest mode of the model that is paired; 0 where none is."""
    return int(used_places(places).max(initial=0))
