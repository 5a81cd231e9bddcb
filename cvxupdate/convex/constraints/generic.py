"""Element matrices stay those of a structure: X ⪰ 0, S ≻ 0, one small block for each class of each
family."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp
from pydantic import Field

from cvxupdate.keys import NonNegative, Part, Positive

from ...errors import InputError
from ...system import Array
from ..context import Context, FamilyBlocks, Key
from .clauses import Clause, ConicClause, LinearClause, Semidefinite, positions
from .equations import Equations


class GenericTable(Part):
    """What members of every family of element matrices (`of = "generic"`) have in common. Positive
    definite they always are."""

    floor: NonNegative = Field(
        default=1e-3,
        description="least stiffness and mass of every motion, relative to the nominal element; 0: "
        "semidefinite",
    )
    ceiling: Positive | None = Field(
        default=None, description="largest, relative to the nominal element; absent: any"
    )
    mass: bool = Field(default=False, description="every element keeps its mass")
    inertia: bool = Field(
        default=False,
        description="every element keeps its mass, centre of gravity and moments of inertia",
    )


@dataclass(frozen=True, eq=False)
class Generic:
    """floor · I ⪯ N + P ⪯ ceiling · I for each class of ``families``, and their inertia kept."""

    families: tuple[FamilyBlocks, ...]
    floor: float = 1e-3
    ceiling: float | None = None
    mass: bool = False
    inertia: bool = False
    keys: ClassVar[Mapping[str, Key]] = {
        "generic": Key(GenericTable, "members of families of element matrices", always=True)
    }

    @classmethod
    def from_spec(cls, table: GenericTable | None, context: Context) -> Generic | None:
        """None where there are no families; InputError where a table is given for none."""
        families = context.families()
        if not families:
            if table is not None:
                raise InputError(
                    'constraints.generic: no parameter is of = "generic". Add one, or leave the '
                    "table out."
                )
            return None
        t = GenericTable() if table is None else table
        if t.ceiling is not None and t.ceiling < max(t.floor, 1.0):
            raise InputError(
                f"constraints.generic: the ceiling {t.ceiling:g} excludes the nominal element. "
                "Choose one above 1 and above the floor."
            )
        return cls(families, t.floor, t.ceiling, t.mass, t.inertia)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """A clause for each class and side, and one for the inertia of each family."""
        return tuple(c for family in self.families for c in self._of(family, columns))

    def _of(self, family: FamilyBlocks, columns: tuple[str, ...]) -> Iterator[Clause]:
        on = positions(family.columns, columns, "constraints.generic")
        for members in family.classes:
            some = [k for k, (i, _) in enumerate(family.entries) if i in members]
            block = _Block.of(family, members, some, tuple(on[k] for k in some))
            yield block.clause(self.floor, 1.0, f"at least {self.floor:g}")
            if self.ceiling is not None:
                yield block.clause(-self.ceiling, -1.0, f"at most {self.ceiling:g}")
        if self.mass or self.inertia:
            yield from _kept(family, on, self.inertia)


@dataclass(frozen=True, eq=False)
class _Block:
    """N + P of one class: vec = F p[on] + f, column by column, (k, k)."""

    name: str
    on: tuple[int, ...]
    F: Any
    f: Array
    size: int

    @classmethod
    def of(
        cls, family: FamilyBlocks, members: Sequence[int], some: list[int], on: tuple[int, ...]
    ) -> _Block:
        at, k = {m: n for n, m in enumerate(members)}, len(members)
        rows, cols, values = [], [], []
        for column, entry in enumerate(some):
            i, j = (at[m] for m in family.entries[entry])
            for place in {i + k * j, j + k * i}:
                rows.append(place)
                cols.append(column)
                values.append(1.0 if i == j else 1.0 / np.sqrt(2.0))
        F = sp.csr_array((values, (rows, cols)), shape=(k * k, len(some)))
        f = np.diag([float(family.nominal[m]) for m in members]).ravel(order="F")
        modes = ", ".join(str(m + 1) for m in members)
        word = "mode" if k == 1 else "modes"
        return cls(f"{family.name}, {word} {modes}", on, F, f, k)

    def clause(self, floor: float, sign: float, word: str) -> Clause:
        """sign · (N + P) ⪰ floor · I."""
        label = f"{self.name}: {word} of the nominal element"
        if self.size == 1:
            low, high = floor - sign * self.f, np.array([np.inf])
            return LinearClause(label, self.on, np.array([[sign]]), low, high)
        on, F, f, k = list(self.on), self.F, self.f, self.size
        eye = np.eye(k).ravel()

        def constraints(p: Any, slack: Any) -> Sequence[Any]:
            import cvxpy as cp

            value = sign * (F @ p[on] + f) - floor * eye + eye * slack
            return [cp.reshape(value, (k, k), order="F") >> 0]

        def margin(p: Array) -> float:
            block = (sign * (F @ p[on] + f)).reshape(k, k)
            return float(np.linalg.eigvalsh(block)[0] - floor)

        columns, rows = np.tril_indices(k)  # of the upper triangle, column by column
        size = np.where(rows == columns, 1.0, np.sqrt(2.0))
        upper = sp.diags_array(size) @ sp.csr_array(sign * F)[rows + k * columns]
        value = size * (sign * f - floor * eye)[rows + k * columns]
        matrix = Semidefinite(self.on, sp.csr_array(upper), value, k)
        return ConicClause(label, constraints, margin, matrix=matrix)


def _kept(family: FamilyBlocks, on: tuple[int, ...], inertia: bool) -> Iterator[Clause]:
    """Rigid-body mass properties of the elements, each relative to its own."""
    places = [(a, b) for a in range(6 if inertia else 3) for b in range(a, 6 if inertia else 3)]
    rows = []
    for today, change in family.bodies:
        size = max(float(np.abs(today).max()), 1e-300)
        rows += [change[:, a, b] / size for a, b in places]
    if not rows:
        return
    word = "mass, centre and moments of inertia" if inertia else "mass"
    for clause in Equations(
        np.array(rows), np.zeros(len(rows)), f"{family.name}: {word} kept"
    ).clauses(family.columns):
        if isinstance(clause, LinearClause):
            yield replace(clause, on=tuple(on[k] for k in clause.on))
