"""The assembled stiffness stays positive semidefinite, and what moved freely still does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import NonNegative, Part

from ...system import Array
from ..context import Context, Key
from .clauses import Clause
from .equations import Equations
from .mass_positive import definite
from .matrix_inequality import MatrixInequality

ASKED_BY = "constraints.stiffness_positive"


class StiffnessPositiveTable(Part):
    """The stiffness stays positive semidefinite, and rigid-body modes stay free."""

    matrix: bool = Field(
        default=True, description="the assembled stiffness matrix stays positive semidefinite"
    )
    rigid_modes: bool = Field(default=True, description="what moved freely still does: K Phi_R = 0")
    floor: NonNegative = Field(
        default=0.0,
        description="smallest eigenvalue beside rigid-body modes, of "
        "the matrix scaled to a unit diagonal",
    )


@dataclass(frozen=True, eq=False)
class StiffnessPositive:
    """K(p) Φ_R = 0 for the motions that the model does not resist today, and K(p) ⪰ 0; None leaves
    one out."""

    rigid: Equations | None
    matrix: MatrixInequality | None
    keys: ClassVar[Mapping[str, Key]] = {
        "stiffness_positive": Key(
            StiffnessPositiveTable, "stiffness positive semidefinite, rigid-body modes kept"
        )
    }

    @classmethod
    def from_spec(cls, table: StiffnessPositiveTable, context: Context) -> StiffnessPositive:
        """Of K(p), and of the motions that it leaves free at p = 0."""
        rigid = _rigid(context) if table.rigid_modes else None
        kept = table.rigid_modes
        return cls(rigid, _inequality(context, table.floor, kept) if table.matrix else None)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """The clauses of both parts."""
        parts = [part for part in (self.rigid, self.matrix) if part is not None]
        return tuple(clause for part in parts for clause in part.clauses(columns))


def _rigid(context: Context) -> Equations | None:
    _, parts = context.matrix("K", ASKED_BY)
    R = context.free_motions()
    A = _resisting(parts, R) if R.shape[1] else np.zeros((0, len(parts)))
    label = "rigid-body modes stay free (K Phi_R = 0)"
    return Equations(A, np.zeros(len(A)), label) if len(A) else None


def _inequality(context: Context, floor: float, kept: bool) -> MatrixInequality:
    """Where every K(p) lets the rigid-body modes R free, K(p) R = 0, no K(p) is definite and a
    solver finds no interior: K ⪰ 0 then says the same as K ⪰ 0 of the structure held in a
    statically determinate way, which has one (facial reduction, Borwein and Wolkowicz 1981). With a
    floor the inequality is confined to the motions beside the rigid-body modes.
    """
    base, parts = context.matrix("K", ASKED_BY)
    label = definite("the assembled stiffness matrix", floor)
    R = context.free_motions()
    if not R.shape[1]:
        return MatrixInequality(base, parts, label, floor)
    if floor > 0.0:
        beside = np.linalg.svd(R, full_matrices=True)[0][:, R.shape[1] :]
        return MatrixInequality(base, parts, label, floor, beside)
    if kept or not _resisting(parts, R).size:
        rest = np.setdiff1d(np.arange(base.shape[0]), context.pins(R))
        base, parts = base[rest][:, rest], tuple(d[rest][:, rest] for d in parts)
    return MatrixInequality(base, parts, label, floor)


def _resisting(parts: Sequence[Any], R: Array) -> Array:
    """The rows of A p = 0 that say K(p) R = 0 ((rows, n) of length 1, each entry that is rounding a
    zero); empty where it holds for every p.

    Length 1, because rows in newtons differ 1e5 times in a frame that is soft out of its plane: the
    soft ones would drown in the rounding of the stiff ones.
    """
    A = (
        np.column_stack([np.asarray(d @ R).ravel() for d in parts])
        if parts
        else np.zeros((R.size, 0))
    )
    size = np.array([float(abs(d).max()) if d.nnz else 1.0 for d in parts])
    A = np.where(np.abs(A) > 1e-9 * size[None, :], A, 0.0)
    A = A[np.any(A != 0.0, axis=1)]
    return np.asarray(A / np.linalg.norm(A, axis=1, keepdims=True))
