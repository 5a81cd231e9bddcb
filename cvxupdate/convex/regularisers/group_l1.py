"""Group L1 regularisation: few groups of parameters move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from cvxupdate.keys import Names

from ...errors import InputError
from ...system import Array
from ..constraints.clauses import positions
from ..context import Context
from .common import check_weight, free_count, reference_and_scale


def groups_by_carrier(columns: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """Groups of parameters that share what stands before the last dot: ``e12.stiffness`` with
    ``e12.mass``."""
    found: dict[str, list[str]] = {}
    for name in columns:
        found.setdefault(name.rpartition(".")[0] or name, []).append(name)
    return tuple(tuple(group) for group in found.values())


@dataclass(frozen=True, eq=False)
class GroupL1:
    """weight · Σ_g √|g| ‖((p − reference)/scale)_g‖₂ (Yuan & Lin 2006).

    ``groups`` are tuples of parameter names that do not overlap; a parameter in no group is free of
    charge; None groups by what stands before the last dot of the names. ``reference``, ``scale``: a
    number or (n,); ``weight`` a number or a rule.
    """

    weight: float | str
    groups: tuple[tuple[str, ...], ...] | None = None
    reference: Array | float = 0.0
    scale: Array | float = 1.0
    name: ClassVar[str] = "group-l1"
    keys: ClassVar[Mapping[str, Any]] = {
        "groups": (
            Annotated[tuple[Names, ...], Field(min_length=1)] | None,
            Field(
                default=None,
                description="group-l1: lists of parameter names; absent: by element group",
            ),
        )
    }

    @classmethod
    def from_spec(cls, table: Any, context: Context) -> GroupL1:
        """With the groups of the table."""
        return cls(table.weight, table.groups)

    def __post_init__(self) -> None:
        check_weight(self.name, self.weight)

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty in cvxpy, without the weight."""
        import cvxpy as cp

        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        norms = [
            np.sqrt(len(g))
            * cp.norm(cp.multiply(1 / scale[list(g)], p[list(g)] - reference[list(g)]), 2)
            for g in self.places(columns)
        ]
        return cp.sum(cp.hstack(norms))

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p, without the weight."""
        return float(
            sum(
                np.sqrt(len(g)) * size
                for g, size in zip(self.places(columns), self._sizes(p, columns), strict=True)
            )
        )

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """Up to the weight at which no group moves (least squares), from 1e-6 of it."""
        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        gradient = 2 * scale * (WA.T @ (Wb - WA @ reference))
        largest = max(
            float(np.linalg.norm(gradient[list(g)]) / np.sqrt(len(g))) for g in self.places(columns)
        )
        largest = max(largest, np.finfo(float).tiny * 1e8)
        return 1e-6 * largest, largest

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Number of parameters in the groups that moved (an upper estimate), less the active
        constraints among them."""
        sizes = self._sizes(p, columns)
        places = self.places(columns)
        moved = np.ones(len(columns), dtype=bool)
        for g, size in zip(places, sizes, strict=True):
            moved[list(g)] = size > 1e-6 * max(float(sizes.max()), 1e-12)
        return free_count(moved, active)

    def _sizes(self, p: Array, columns: tuple[str, ...]) -> Array:
        reference, scale = reference_and_scale(self.name, self.reference, self.scale, len(columns))
        departure = (p - reference) / scale
        return np.array([np.linalg.norm(departure[list(g)]) for g in self.places(columns)])

    def places(self, columns: tuple[str, ...]) -> tuple[tuple[int, ...], ...]:
        """Of each group the places of its parameters among ``columns``."""
        places = tuple(
            positions(g, columns, "group-l1") for g in (self.groups or groups_by_carrier(columns))
        )
        members = [i for g in places for i in g]
        if len(set(members)) != len(members):
            raise InputError("group-l1: a parameter stands in two groups; groups must not overlap.")
        return places
