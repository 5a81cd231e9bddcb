"""The total mass of the structure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Part, Positive

from ...errors import InputError
from ...system import Array
from ..context import Context, Key
from .clauses import Clause, LinearClause


class TotalMassTable(Part):
    """The mass of the whole structure, conserved or set."""

    conserve: bool | None = Field(default=None, description="keep the initial mass")
    value: Positive | None = Field(default=None, description="weighed mass [kg]")


@dataclass(frozen=True, eq=False)
class TotalMass:
    """base + Σ (dm/dp) p = value, in kg.

    Parameters
    ----------
    derivative : (n,) dm/dp, kg per unit of each parameter, from the model.
    base : kg, the total mass at p = 0.
    value : kg, the mass to be met; None keeps ``base`` (the mass is conserved).
    tolerance : kg, allowed on either side; 0 for an equality.
    """

    derivative: Array
    base: float
    value: float | None = None
    tolerance: float = 0.0
    keys: ClassVar[Mapping[str, Key]] = {"total_mass": Key(TotalMassTable, "total mass")}

    @classmethod
    def from_spec(cls, table: TotalMassTable, context: Context) -> TotalMass:
        """Kept, or set to the weighed mass.

        Raises
        ------
        InputError
            When no parameter changes the mass, it is not linear in them, or a whole mass matrix is
            free.
        """
        if "M" in context.whole():
            raise InputError(
                "constraints.total_mass: a whole mass matrix has a mass in every direction. Take "
                "inertia = { }, which keeps all of them."
            )
        law = context.mass()
        if not np.any(law.derivative != 0.0):
            raise InputError(
                "constraints.total_mass: no parameter changes the mass. Free a mass parameter "
                "(rho, mass, m, thickness, A), or drop the clause."
            )
        if not law.linear:
            raise InputError(
                "constraints.total_mass: the mass is not linear in the parameters (a section's "
                "rho and a dimension are free together). Free one of them, so that the clause "
                "stays convex."
            )
        return cls(law.derivative, law.base, table.value)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause over the parameters that carry mass; none when no parameter does and the mass
        is conserved."""
        derivative = np.asarray(self.derivative, dtype=float)
        if derivative.shape != (len(columns),):
            raise InputError(
                f"total mass: dm/dp has shape {derivative.shape}, but there are "
                f"{len(columns)} parameters."
            )
        target = self.base if self.value is None else self.value
        on = tuple(map(int, np.flatnonzero(derivative)))
        if not on and abs(target - self.base) <= self.tolerance:
            return ()
        if not on:
            raise InputError(
                f"total mass: no parameter carries mass, so it stays at {self.base:g} kg and "
                f"cannot become {target:g} kg; add a mass parameter or take the constraint "
                "out."
            )
        words = "kept at" if self.value is None else "set to"
        within = f" within {self.tolerance:g} kg" if self.tolerance else ""
        change = np.array([target - self.base])
        return (
            LinearClause(
                f"total mass {words} {target:g} kg{within}",
                on,
                derivative[list(on)][None, :],
                change - self.tolerance,
                change + self.tolerance,
                "kg",
            ),
        )
