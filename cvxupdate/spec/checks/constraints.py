"""Clauses of [constraints] and groups of [regularisation]."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.keys import Loc
from cvxupdate.registry import REGULARISERS
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.checks.parameters import unphysical
from cvxupdate.spec.elements import Block, Row, text_of
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.update import Regulariser
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
        if not any(_has_mass(case, block, row) for _, block, row in case.rows()):
            yield Complaint(
                at, "the model has no mass.", "Give the materials a `rho`, or add masses."
            )


def _has_mass(case: Case, block: Block, row: Row) -> bool:
    if "mass" not in text_of(block).changes:
        return False
    if row.get("material") is not None:
        material = case.spec.model.materials.get(row.get("material"))
        return material is None or material.rho > 0.0
    keys = ("m", "mass")  # a lump, a given matrix; an element that says it otherwise has some
    said = [row.get(key) for key in keys if key in type(row).model_fields]
    return any(said) if said else True


@dataclass(frozen=True)
class RegulariserKeys:
    """A key of one kind of penalty stands on that kind only, and groups name parameters that
    exist."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "update", "materials", "sections")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Keys where they mean nothing, and unknown names."""
        for i, row in enumerate(case.spec.regularisation):
            for kind in REGULARISERS.members():
                for key in kind.keys:
                    if getattr(row, key) is not None and key in row.model_fields_set:
                        yield from self._key(case, ("regularisation", i, key), row, key)

    def _key(self, case: Case, at: Loc, row: Regulariser, key: str) -> Iterator[Complaint]:
        kinds = [k.name for k in REGULARISERS.members() if key in k.keys]
        if row.kind not in kinds:
            yield Complaint(
                at,
                f"do not apply to kind '{row.kind}'.",
                f'Leave them out, or take kind = "{kinds[0]}".',
            )
        for group in getattr(row, key) if key == "groups" else ():
            yield from _unknown(at, group, case.names)


def _unknown(at: Loc, used: Iterable[str], names: tuple[str, ...] | None) -> Iterator[Complaint]:
    for name in used:
        if names is not None and name not in names:
            yield Complaint(
                at, f"there is no parameter '{name}'.", nearest(name, names, "parameter")
            )
