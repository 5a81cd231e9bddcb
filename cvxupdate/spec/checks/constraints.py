"""Clauses of [constraints] and groups of [regularisation]."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.base import Loc
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.checks.parameters import unphysical
from cvxupdate.spec.elements import LineRow, MassRow, MatrixRow, PlateRow
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.words import nearest


@dataclass(frozen=True)
class BoundsCrossed:
    """The common bounds are not crossed and keep the structure physical."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Crossed bounds, and a lower one that some parameter cannot have (said once)."""
        bounds = case.spec.constraints.bounds
        if bounds is None:
            return
        at: Loc = ("constraints", "bounds", "lower")
        if bounds.lower is not None and bounds.upper is not None and bounds.lower > bounds.upper:
            yield Complaint(
                at,
                f"the bounds are crossed: lower {bounds.lower:g} is above upper {bounds.upper:g}.",
                "Swap or widen them.",
            )
        if bounds.lower is None or case.spec.update is None:
            return
        for row in case.spec.update.parameters:
            found = list(unphysical(at, bounds.lower, row)) if row.lower is None else []
            if found:
                yield found[0]
                return


@dataclass(frozen=True)
class ConstraintNames:
    """Clauses name parameters that exist."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "update", "materials", "sections")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every unknown or repeated name in ties and linear clauses."""
        names = case.names
        for i, tied in enumerate(case.spec.constraints.tied):
            at = ("constraints", "tied", i, "parameters")
            yield from _unknown(at, tied.parameters, names)
            if len(set(tied.parameters)) < len(tied.parameters):
                yield Complaint(at, "ties a parameter to itself.", "Name each parameter once.")
        for i, linear in enumerate(case.spec.constraints.linear):
            yield from _unknown(
                ("constraints", "linear", i, "coefficients"), linear.coefficients, names
            )


@dataclass(frozen=True)
class LinearSides:
    """A linear clause has a right-hand side that can be met."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Clauses without a side, with too many, crossed, or without a coefficient."""
        for i, row in enumerate(case.spec.constraints.linear):
            at = ("constraints", "linear", i)
            sides = [s for s in (row.equals, row.at_most, row.at_least) if s is not None]
            if not sides:
                yield Complaint(at, "has no right-hand side.", "Add equals, at_most or at_least.")
            elif row.equals is not None and len(sides) > 1:
                yield Complaint(
                    (*at, "equals"),
                    "is given together with at_most or at_least.",
                    "Give an equation or limits, not both.",
                )
            elif (
                row.at_most is not None and row.at_least is not None and row.at_least > row.at_most
            ):
                yield Complaint(
                    (*at, "at_least"),
                    f"the limits are crossed: {row.at_least:g} is above {row.at_most:g}.",
                    "Swap or widen them.",
                )
            if not any(row.coefficients.values()):
                yield Complaint(
                    (*at, "coefficients"), "are all zero.", "Give at least one that is not."
                )


@dataclass(frozen=True)
class OneMass:
    """Total mass is conserved or set, in a model that has some."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "materials")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """A clause that says neither or both, and one on a model without mass."""
        clause = case.spec.constraints.total_mass
        at = ("constraints", "total_mass")
        if clause is None:
            return
        if bool(clause.conserve) == (clause.value is not None):
            yield Complaint(
                at,
                "gives both `conserve` and `value`."
                if clause.conserve
                else "gives neither `conserve` nor `value`.",
                "Give { conserve = true }, or { value = kg }.",
            )
        if not any(_has_mass(case, row) for _, _, row in case.rows()):
            yield Complaint(
                at, "the model has no mass.", "Give the materials a `rho`, or add masses."
            )


def _has_mass(case: Case, row: object) -> bool:
    if isinstance(row, MassRow):
        return row.m > 0.0
    if isinstance(row, MatrixRow):
        return row.mass is not None
    if isinstance(row, LineRow | PlateRow):
        material = case.spec.model.materials.get(row.material)
        return material is None or material.rho > 0.0
    return False


@dataclass(frozen=True)
class RegulariserGroups:
    """Groups of a group penalty name parameters that exist, and only a group penalty has them."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "update", "materials", "sections")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Unknown names, and groups where they mean nothing."""
        names = case.names
        for i, row in enumerate(case.spec.regularisation):
            if row.groups is None:
                continue
            at = ("regularisation", i, "groups")
            if row.kind != "group-l1":
                yield Complaint(
                    at,
                    f"do not apply to kind '{row.kind}'.",
                    'Leave them out, or take kind = "group-l1".',
                )
            for group in row.groups:
                yield from _unknown(at, group, names)


def _unknown(at: Loc, used: Iterable[str], names: tuple[str, ...] | None) -> Iterator[Complaint]:
    for name in used:
        if names is not None and name not in names:
            yield Complaint(
                at, f"there is no parameter '{name}'.", nearest(name, names, "parameter")
            )
