"""Members of families that a model already has: found on one structure, used on it or on another.

P of X = D (N + P) D is a number relative to the element's own nominal matrix, so it goes from one
element to another of the same form: a mesh error depends on the form of an element and on how much
of a wave it spans, not on its size or its material.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, Protocol

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.generic.change import Place, blocks_of, carrying, shared
from cvxupdate.fe.generic.family import Family
from cvxupdate.fe.generic.pieces import Given, pieces_of
from cvxupdate.fe.generic.use import FamilyUse
from cvxupdate.fe.model import Model

NO_STRUCTURE = 1e-9
"""Least eigenvalue of N + P, below zero, that rounding of a written file may bring."""


class Row(Protocol):
    """A row of [[model.families]] (`cvxupdate.spec.generic.Member`)."""

    @property
    def modes(self) -> Literal["symmetry", "own"]: ...  # noqa: D102
    def changes(self) -> Mapping[str, Sequence[tuple[int, int, float]]]: ...  # noqa: D102


def with_members(
    model: Model, rows: Sequence[tuple[Row, Sequence[int]]], given: Sequence[Given]
) -> Model:
    """``model`` with the changes of every row on its elements, one row after the other; ``given``
    are the matrices of other programs that the file has.

    Raises
    ------
    ModelError
        For elements without that matrix, or unlike one another; a mode that is not there; a change
        after which an element is no structure.
    """
    for number, (row, elements) in enumerate(rows):
        where = f"model.families[{number}]"
        pieces, blocks = pieces_of(model, frozenset(elements), given), list(model.blocks)
        for matrix, change in row.changes().items():
            own = carrying(matrix, elements, pieces)
            if not own:
                raise ModelError(
                    f"{where}: no element there has a matrix {matrix}. Choose others, or the "
                    "other matrix."
                )
            try:
                families = shared(matrix, row.modes, None, own, {})
            except ModelError as error:
                said = str(error).removeprefix("update.parameters: ")
                raise ModelError(f"{where}: {said}") from error
            entries, values = _entries(change, families[0], where)
            places = [
                Place(0, e, q, f, entries, values) for (e, q), f in zip(own, families, strict=True)
            ]
            blocks += [b for b, _ in blocks_of(places)]
        model = replace(model, blocks=tuple(blocks))
    return model


def _entries(
    change: Sequence[tuple[int, int, float]], family: Family, where: str
) -> tuple[tuple[tuple[int, int], ...], tuple[float, ...]]:
    """Entries (i ≤ j) from 0, and the parameters that P is made of."""
    size = len(family.values)
    P: Real = np.zeros((size, size))
    seen: set[tuple[int, int]] = set()
    for i, j, value in change:
        if not i <= j <= size or (i, j) in seen:
            why = "stands twice" if (i, j) in seen else f"is none of 1 ≤ i ≤ j ≤ {size}"
            raise ModelError(
                f"{where}: the entry [{i}, {j}] of {family.matrix} {why}. Name each entry of the "
                f"{size} modes once, the lower mode first."
            )
        seen.add((i, j))
        P[i - 1, j - 1] = P[j - 1, i - 1] = value
    if np.linalg.eigvalsh(family.nominal + P)[0] < -NO_STRUCTURE:
        raise ModelError(
            f"{where}: with this change of {family.matrix} the elements are no structure (a motion "
            "has negative energy). Correct the numbers."
        )
    entries = tuple((i - 1, j - 1) for i, j, _ in change)
    return entries, tuple(float(P[e]) * (1.0 if e[0] == e[1] else 2.0**0.5) for e in entries)


def member_rows(uses: Sequence[FamilyUse], p: Mapping[str, float]) -> list[dict[str, Any]]:
    """Rows of [[model.families]] for families at the values ``p`` of their parameters by name;
    those that did not move, or are not among ``p``, give none.

    Raises
    ------
    ModelError
        Where a family of K and one of M share some elements only: one row would change the modes
        that the other is said in.
    """
    out: dict[tuple[int, ...], dict[str, Any]] = {}
    for use in uses:
        if not all(c in p for c in use.columns):
            continue
        first = use.families[0]
        P = first.relative(np.array([p[c] for c in use.columns])) - first.nominal
        change = [[i + 1, j + 1, float(P[i, j])] for i, j in first.entries if P[i, j] != 0.0]
        if not change:
            continue
        if any(set(use.elements) & set(others) for others in out if others != use.elements):
            raise ModelError(f"{use.name} shares some of its elements with another family.")
        row = out.setdefault(use.elements, {"elements": list(use.elements)})
        out[use.elements] = row | ({"modes": "own"} if use.modes == "own" else {})
        out[use.elements][use.matrix] = change
    return list(out.values())
