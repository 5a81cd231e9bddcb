"""Whole symmetric matrices as parameters: one for every entry (pair of mirror entries) of K, M, C
or D on a sparsity pattern.

Entry (i, j) of A moves by p √(A_ii A_jj): p is a pure number, the same in every unit, and 1 is as
much as a positive definite matrix can hold there (Kabe 1985 counts changes so too). To the rest of
the package these are parameters like any other: small blocks of derivatives with labels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements.base import Real, Term, Values
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter, Target

UNITS = {
    "K": ("N/m", "N/rad", "N*m/rad"),
    "D": ("N/m", "N/rad", "N*m/rad"),
    "M": ("kg", "kg*m", "kg*m^2"),
    "C": ("N*s/m", "N*s/rad", "N*m*s/rad"),
}
"""Of an entry between translations, of a translation and a rotation, between rotations."""
NONZERO = 1e-12  # of √(A_ii A_jj): an entry below is rounding of an assembly and counts as 0
ALL_PAIRS = 400  # DOFs up to which every pair may be a parameter


@dataclass(frozen=True)
class Entry:
    """Entries of a whole matrix: a change that is zero today. ``size`` is 1 on the diagonal, 2
    beside it."""

    matrix: str
    size: int
    name: str = "entry"
    nodes: int = 0
    dofs: tuple[str, ...] = ()
    properties: tuple[str, ...] = ("change",)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the terms come from the matrix itself."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """The change."""
        return {"change": properties["change"]}


def entry_label(matrix: str, row: str, column: str) -> str:
    """ "K[n1.x, n2.x]"."""
    return f"{matrix}[{row}, {column}]"


def with_entries(
    model: Model, matrices: Sequence[str], pattern: str, symmetric: bool, lower: float, upper: float
) -> Model:
    """``model`` with the entries of ``matrices`` ("K", "M", "C", "D") as further parameters.

    ``pattern``: "model", the entries that are not 0 today; "nodes", every pair of DOFs of which
    some element holds both nodes; "all", every pair. ``symmetric``: one parameter for (i, j) and
    (j, i), else one for each.

    Raises
    ------
    ModelError
        When a matrix is zero, or has no diagonal to measure an entry by; or "all" for a large
        model.
    """
    for matrix in dict.fromkeys(matrices):
        model = _with(model, matrix, pattern, symmetric, lower, upper)
    return model


def _with(
    model: Model, matrix: str, pattern: str, symmetric: bool, lower: float, upper: float
) -> Model:
    A = sp.csc_array(getattr(model.matrices(), matrix))
    size = np.sqrt(np.abs(A.diagonal()))
    if not np.any(size):
        remedy = (
            "give the model damping, or leave the matrix out" if matrix in "CD" else "leave it out"
        )
        raise ModelError(
            f"update.whole: {matrix} is zero in the model, so its entries have no size; {remedy}."
        )
    i, j = _pairs(model, A, size, pattern)
    values = np.asarray(A[i, j]).ravel()
    blocks, parameters = list(model.blocks), list(model.parameters)
    for rows, columns, mirrored in _parts(i, j, symmetric):
        if not len(rows):
            continue
        at = np.stack([rows, columns], axis=1) if rows[0] != columns[0] else rows[:, None]
        scale = size[rows] * size[columns]
        terms = np.zeros((len(rows), at.shape[1], at.shape[1]))
        terms[:, 0, -1] = scale
        if mirrored:
            terms[:, -1, 0] = scale
        properties = {k: np.full(len(rows), v) for k, v in {**COMMON, "change": 0.0}.items()}
        number = len(blocks)
        blocks.append(
            Block(
                Entry(matrix, at.shape[1]),
                np.zeros(len(rows), dtype=np.int64),
                ("",) * len(rows),
                at,
                model.dof_kind[at],
                (Term(matrix, "change", terms),),
                np.arange(len(rows)),
                properties,
            )
        )
        today = dict(zip(zip(i.tolist(), j.tolist(), strict=True), values.tolist(), strict=True))
        for k, (a, b) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
            unit = UNITS[matrix][int(model.dof_kind[a] >= 3) + int(model.dof_kind[b] >= 3)]
            target = Target(number, np.array([k], dtype=np.int64), ("change",), np.ones((1, 1)))
            nominal = today[(a, b) if a <= b else (b, a)]
            parameters.append(
                Parameter(
                    entry_label(matrix, model.labels[a], model.labels[b]),
                    matrix,
                    (target,),
                    lower,
                    upper,
                    nominal,
                    float(scale[k]),
                    unit,
                )
            )
    return replace(model, blocks=tuple(blocks), parameters=tuple(parameters))


def _pairs(model: Model, A: sp.csc_array, size: Real, pattern: str) -> tuple[Index, Index]:
    """Rows and columns (i ≤ j) of the entries, column by column; DOFs without a diagonal have
    none."""
    if pattern == "all":
        if model.size > ALL_PAIRS:
            raise ModelError(
                f'update.whole: pattern = "all" makes {model.size * (model.size + 1) // 2} '
                f'parameters of {model.size} DOFs. Take "nodes" or "model".'
            )
        i, j = np.triu_indices(model.size)
    else:
        upper = sp.triu(
            A
        ).tocoo()  # the pattern of the model holds every pair of DOFs of every element
        i, j = upper.coords
        if pattern == "model":
            keep = np.abs(upper.data) > NONZERO * size[i] * size[j]
            i, j = i[keep], j[keep]
    order = np.lexsort((i, j))
    i, j = np.asarray(i, dtype=np.int64)[order], np.asarray(j, dtype=np.int64)[order]
    live = (size[i] > 0.0) & (size[j] > 0.0)
    return i[live], j[live]


def _parts(i: Index, j: Index, symmetric: bool) -> list[tuple[Index, Index, bool]]:
    """(rows, columns, mirrored) of the diagonal and of what lies beside it."""
    on = i == j
    beside = (
        [(i[~on], j[~on], True)]
        if symmetric
        else [(i[~on], j[~on], False), (j[~on], i[~on], False)]
    )
    return [(i[on], j[on], False), *beside]
