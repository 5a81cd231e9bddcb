"""Total mass, centre of gravity and moments of inertia of the whole structure (Caesar 1986)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Part, Positive, Vector

from ...system import Array
from ..context import Context, Key
from .clauses import Clause
from .equations import Equations


class InertiaTable(Part):
    """Mass properties of the whole structure as a rigid body; what is not given is kept, or left
    free with `conserve = false`."""

    conserve: bool = Field(default=True, description="keep what is not given below")
    mass: Positive | None = Field(default=None, description="weighed mass [kg]")
    centre: Vector | None = Field(default=None, description="centre of gravity [m]")
    moments: Vector | None = Field(
        default=None,
        description="moments of inertia Ixx, Iyy, Izz about the centre of gravity [kg m^2]",
    )


@dataclass(frozen=True, eq=False)
class Inertia:
    """Rigid-body mass properties kept or set: ``parts`` are the equations of mass, centre and
    moments."""

    parts: tuple[Equations, ...]
    keys: ClassVar[Mapping[str, Key]] = {"inertia": Key(InertiaTable, "rigid-body mass properties")}

    @classmethod
    def from_spec(cls, table: InertiaTable, context: Context) -> Inertia:
        """Supports are let go for the purpose: they carry mass too."""
        body = context.body()
        J, _ = body.inertia(np.zeros(3))
        axis = int(np.argmax(np.diag(J)[:3] > 0))
        mass = float(J[axis, axis])
        now = first_moments(J) / mass
        centre = (
            np.where(np.isnan(now), 0.0, now) if table.centre is None else np.array(table.centre)
        )
        J, dJ = body.inertia(centre)
        parts = []
        if table.mass is not None or table.conserve:
            # Elements have one mass in every direction; entries of a whole matrix have to be told.
            ways = [(a, b) for a in range(3) for b in range(a, 3)]
            parts.append(_mass(J, dJ, table.mass, mass, ways if body.directed else [(axis, axis)]))
        if table.centre is not None or table.conserve:
            parts.append(_centre(J, dJ, centre, table.centre is None))
        if table.moments is not None or table.conserve:
            parts.append(_moments(J, dJ, table.moments))
        return cls(tuple(parts))

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause for each of mass, centre of gravity and moments that is asked for."""
        return tuple(clause for part in self.parts for clause in part.clauses(columns))


def first_moments(J: Array) -> Array:
    """m (x, y, z) from the coupling of translations and rotations about the origin; NaN where the
    DOF kinds do not show it."""
    out = np.full(3, np.nan)
    # translation a against rotation b: e_a . (e_b x r)
    for a, b, k, sign in (
        (0, 1, 2, 1),
        (1, 0, 2, -1),
        (0, 2, 1, -1),
        (2, 0, 1, 1),
        (1, 2, 0, 1),
        (2, 1, 0, -1),
    ):
        if J[a, a] > 0.0 and np.isnan(out[k]):
            out[k] = sign * J[a, 3 + b]
    return out


def _rows(dJ: Array, places: list[tuple[int, int]]) -> Array:
    return np.array([dJ[:, i, j] for i, j in places])


def _mass(
    J: Array, dJ: Array, asked: float | None, today: float, ways: list[tuple[int, int]]
) -> Equations:
    target = today if asked is None else asked
    left = np.array([(target if a == b and J[a, a] > 0 else 0.0) - J[a, b] for a, b in ways])
    word = "kept at" if asked is None else "set to"
    return Equations(_rows(dJ, ways), left, f"total mass {word} {target:.6g} kg", unit="kg")


def _centre(J: Array, dJ: Array, centre: Array, kept: bool) -> Equations:
    rows = [(a, 3 + b) for a in range(3) for b in range(3)]
    where = ", ".join(f"{v:.4g}" for v in centre)
    return Equations(
        _rows(dJ, rows),
        -np.array([J[i, j] for i, j in rows]),
        f"centre of gravity {'kept at' if kept else 'set to'} ({where}) m",
        unit="kg m",
    )


def _moments(J: Array, dJ: Array, asked: tuple[float, float, float] | None) -> Equations:
    wanted = np.diag(J)[3:] if asked is None else np.array(asked)
    A, b = _rows(dJ, [(3 + a, 3 + a) for a in range(3)]), wanted - np.diag(J)[3:]
    if asked is None:
        products = [(3 + a, 3 + c) for a in range(3) for c in range(a + 1, 3)]
        A, b = np.vstack([A, _rows(dJ, products)]), np.append(b, np.zeros(3))
    words = ", ".join(f"{v:.4g}" for v in wanted)
    return Equations(
        A,
        b,
        f"moments of inertia {'kept at' if asked is None else 'set to'} ({words}) kg m^2",
        unit="kg m^2",
    )
