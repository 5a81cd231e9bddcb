"""Parameters of [update]: each acts on something, from a nominal value that can change, within
bounds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import text_of
from cvxupdate.spec.parameters import DAMPING_WORDS, carriers_of, has_property
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.update_parameters import ParameterRow
from cvxupdate.spec.words import nearest

PLACES = ("elements", "group", "groups", "material")
POSITIVE = (
    "mass",
    "m",
    "rho",
    "E",
    "G",
    "A",
    "I",
    "Iy",
    "Iz",
    "J",
    "thickness",
    "height",
    "width",
    "Dx",
    "Dy",
    "Dxy",
)
"""Properties that must stay above zero; the others may reach it."""
P_VALUES = {"stiffness": "k", "mass": "m", "damping": "c"}
"""The words that multiply whole element matrices, and the physical word beside each."""


def _rows(case: Case) -> Iterator[tuple[int, ParameterRow]]:
    if case.spec.update is not None:
        yield from enumerate(case.spec.update.parameters)


@dataclass(frozen=True)
class SomethingFree:
    """Something is to be found: parameters, or whole matrices that stay symmetric and have no
    crossed bounds."""

    needs: ClassVar[tuple[str, ...]] = ("update",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """An [update] without parameters, and what is wrong with `whole`."""
        update = case.spec.update
        if update is None or update.method == "direct":  # which knows no parameters
            return
        if not update.parameters and update.whole is None:
            yield Complaint(
                ("update", "parameters"),
                "is empty.",
                "Name at least one parameter, or give [update.whole].",
            )
        if update.whole is None:
            return
        at = ("update", "whole")
        if update.method != "ceam":
            yield Complaint(
                at, f"does not apply to method '{update.method}'.", 'Take method = "ceam".'
            )
        if not update.whole.symmetric and case.spec.constraints.symmetry is None:
            yield Complaint(
                (*at, "symmetric"),
                "is false and nothing keeps the matrices symmetric.",
                "Add symmetry = {} to [constraints].",
            )
        low, high = update.whole.lower, update.whole.upper
        if low is not None and high is not None and low > high:
            yield Complaint(
                (*at, "lower"),
                f"the bounds are crossed: lower {low:g} is above upper {high:g}.",
                "Swap or widen them.",
            )


@dataclass(frozen=True)
class ParameterSelection:
    """A parameter says in exactly one way where it acts."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every parameter that says it twice or not at all, and ``each`` that splits nothing."""
        for i, row in _rows(case):
            given = [p for p in PLACES if getattr(row, p) is not None]
            at = ("update", "parameters", i)
            if len(given) > 1:
                yield Complaint(
                    at,
                    f"names {' and '.join(given)}.",
                    "Name exactly one of elements, group, groups, material.",
                )
            elif not given and row.of not in DAMPING_WORDS:
                yield Complaint(
                    at,
                    f"does not state where '{row.of}' changes.",
                    "Add elements, group, groups or material.",
                )
            elif not given and row.each is not None:
                yield Complaint(
                    (*at, "each"),
                    "splits nothing: no elements or groups are named.",
                    "Leave `each` out.",
                )


@dataclass(frozen=True)
class ParameterElements:
    """A parameter acts on elements and groups that exist and have the property."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "materials", "sections", "damping")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every name that is not known, and every parameter without an element."""
        model = case.spec.model
        for i, row in _rows(case):
            at = ("update", "parameters", i)
            known = True
            for key, group in [("group", row.group)] + [("groups", g) for g in row.groups or ()]:
                if group is not None and group not in case.groups:
                    known = False
                    yield Complaint(
                        (*at, key),
                        f"there is no group '{group}'.",
                        nearest(group, case.groups, "group"),
                    )
            if row.material is not None and row.material not in model.materials:
                known = False
                yield Complaint(
                    (*at, "material"),
                    f"there is no material '{row.material}'.",
                    nearest(row.material, model.materials, "material"),
                )
            for number in row.elements if isinstance(row.elements, tuple) else ():
                if number not in case.elements:
                    known = False
                    yield Complaint(
                        (*at, "elements"), f"there is no element {number}.", "Correct the number."
                    )
                elif not has_property(model, *case.elements[number], row.of):
                    known = False
                    kind = case.elements[number][0].type
                    yield Complaint(
                        (*at, "of"),
                        f"element {number} is a {kind} and has no '{row.of}'.",
                        _shear_remedy(case, number, row.of)
                        or "Choose a property that it has, or leave the element out.",
                    )
            if known and i not in case.targets_by_row:
                if row.each == "group" and not case.groups:
                    remedy = 'Give them groups, or each = "element".'
                    yield Complaint((*at, "each"), "the elements have no groups.", remedy)
                else:
                    beams = (_shear_remedy(case, e, row.of) for e in case.elements)
                    yield Complaint(
                        (*at, "of"),
                        f"no element of this parameter has '{row.of}'.",
                        next((remedy for remedy in beams if remedy), "")
                        or "Choose a property that they have, or other elements.",
                    )


def _shear_remedy(case: Case, number: int, of: str) -> str:
    """How a beam gets the one of G and nu that its material does not have; empty for the rest."""
    block, row = case.elements[number]
    material = case.spec.model.materials.get(row.get("material", ""))
    if of not in ("G", "nu") or material is None or of not in text_of(block).changes:
        return ""
    if text_of(block).outline != "line":
        return ""
    name = row.get("material")
    if of == "G":
        G = material.E / (2.0 * (1.0 + material.nu))
        return (
            f"Material '{name}' has nu, so its G follows E. Give it a G of its own (that of E and "
            f"nu is {G:.6g})."
        )
    return f"Material '{name}' has a G of its own, beside which nu does nothing: take of = \"G\"."


@dataclass(frozen=True)
class NominalZero:
    """A relative change needs something to be relative to."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "materials", "damping")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every parameter whose nominal value is 0 and that gives no ``scale``, or is a p-value of
        it."""
        for i, row in _rows(case):
            if row.scale is not None and row.of not in P_VALUES:
                continue
            for target in case.targets_by_row.get(i, ()):
                carriers = target.elements or carriers_of(case.spec.model, row.of)
                if all(_nominal(case, e, row.of) == 0.0 for e in carriers):
                    remedy = "Add scale = …, the size of one unit of p."
                    if row.of in P_VALUES:
                        remedy = (
                            f'Write of = "{P_VALUES[row.of]}" with scale = …, the size of one '
                            "unit of p."
                        )
                    problem = (
                        f"'{target.name}' is 0 in the model, so a relative change does nothing."
                    )
                    yield Complaint(("update", "parameters", i), problem, remedy)


def _nominal(case: Case, number: int, of: str) -> float | None:
    """Nominal value of a property where the text has it as one number; None where it is not 0 for
    sure."""
    _, row = case.elements[number]
    if of in ("eta", "alpha", "beta"):
        own = row.get("eta") if of == "eta" else None
        if own is None and of == "eta":
            own = getattr(case.spec.model.materials.get(row.get("material", "")), "eta", None)
        return float(own if own is not None else getattr(case.spec.model.damping, of, 0.0))
    if of in P_VALUES:
        of = P_VALUES[of]
        if of == "m" and any(row.get(inertia, 0.0) > 0.0 for inertia in ("Ixx", "Iyy", "Izz")):
            return None
    if of in ("k", "m", "c", "Ixx", "Iyy", "Izz", "Ip", "omega", "N"):
        return None if row.get(of) is None else float(row.get(of))
    material = case.spec.model.materials.get(row.get("material", ""))
    return float(getattr(material, of)) if material is not None and of in ("rho", "nu") else None


@dataclass(frozen=True)
class ParameterBounds:
    """Bounds are not crossed, and keep stiffness and mass physical."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every pair that crosses (its own, or with [constraints] bounds), and every lower bound
        that is not physical."""
        common = case.spec.constraints.bounds
        for i, row in _rows(case):
            at = ("update", "parameters", i)
            lower = row.lower if row.lower is not None else common.lower if common else None
            upper = row.upper if row.upper is not None else common.upper if common else None
            own = row.lower is not None or row.upper is not None
            if own and lower is not None and upper is not None and lower > upper:
                yield Complaint(
                    (*at, "lower" if row.lower is not None else "upper"),
                    f"the bounds are crossed: lower {lower:g} is above upper {upper:g}.",
                    "Swap or widen them.",
                )
            if row.lower is not None:
                yield from unphysical((*at, "lower"), row.lower, row)


def unphysical(at: tuple[str | int, ...], lower: float, row: ParameterRow) -> Iterator[Complaint]:
    """A lower bound on p that lets 1 + p reach what no structure has; nothing is said where
    ``scale`` makes p absolute."""
    if row.scale is not None or row.of == "nu":
        return
    strict = row.of in POSITIVE
    if lower < -1.0 or (strict and lower == -1.0):
        yield Complaint(
            at,
            f"p = {lower:g} makes '{row.of}' {'zero or ' if strict else ''}negative (the "
            "factor is 1 + p).",
            f"Keep lower {'above' if strict else 'at or above'} -1.",
        )


@dataclass(frozen=True)
class NamesUnique:
    """Every parameter has its own name."""

    needs: ClassVar[tuple[str, ...]] = ("elements",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every name that two parameters would have."""
        first: dict[str, int] = {}
        for target in case.targets:
            if first.get(target.name) == target.row:
                continue
            if target.name in first:
                yield Complaint(
                    ("update", "parameters", target.row),
                    f"'{target.name}' is already a parameter (parameters[{first[target.name]}]).",
                    "Remove one, or give it a `name`.",
                )
            first.setdefault(target.name, target.row)
