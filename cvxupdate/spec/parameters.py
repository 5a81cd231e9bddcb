"""Rows of [update] ``parameters`` written out: one target for each parameter, with its name and
elements."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from cvxupdate.spec.elements import MATRICES, Block, Row, text_of
from cvxupdate.spec.generic import GENERIC, FamilyTable, Member
from cvxupdate.spec.model import Model
from cvxupdate.spec.update_parameters import ParameterRow

DAMPING_WORDS = ("alpha", "beta", "eta")
"""What may be changed without naming elements: the constants of [model.damping]."""
SECTION_SHAPES = {
    "height": "rectangle",
    "width": "rectangle",
    "diameter": "circle",
    "wall": "circle",
}
"""The shape of section that has the property, where not all have."""


@dataclass(frozen=True)
class Target:
    """One parameter in text: its ``name``, the property ``of``, the ``elements`` it acts on (none:
    every one that has it).

    ``group`` is the group where the elements are one group; ``lower``, ``upper`` and ``scale`` as
    in the file; ``row`` is the index of the row of ``parameters`` it comes from; ``family`` is that
    of ``of = "generic"``, None for any other.
    """

    name: str
    of: str
    elements: tuple[int, ...]
    group: str | None
    lower: float | None
    upper: float | None
    scale: float | None
    row: int
    family: FamilyTable | None = None


def expand_parameters(model: Model, rows: Iterable[ParameterRow]) -> tuple[Target, ...]:
    """The parameters in the order of the file; a row that finds no element gives none.

    Names: ``e12.stiffness`` for one element, ``e1+e2.E`` or ``e3..e9(6).E`` for several tied
    together, ``column.E`` for a group, ``a+b.E`` for tied groups, ``all.rho``, ``steel.E`` for a
    material, ``damping.alpha`` where the row names no elements. A ``name`` in the file is the whole
    name of a single parameter; where ``each`` gives several they are called ``name.e12`` or
    ``name.column``.
    """
    rows = tuple(rows)
    carriers = {of: carriers_of(model, of) for of in {row.of for row in rows}}
    groups, made_of = groups_of(model), _by_material(model)
    return tuple(
        t for i, row in enumerate(rows) for t in _expand(i, row, carriers[row.of], groups, made_of)
    )


def carriers_of(model: Model, of: str) -> dict[int, None]:
    """Numbers of the elements that have the property, in the order of the file (a dict for its fast
    look-up)."""
    return {row.id: None for block, row in rows_of(model) if has_property(model, block, row, of)}


def rows_of(model: Model) -> Iterator[tuple[Block, Row]]:
    """Every element with its block."""
    for block in model.elements:
        rows: tuple[Row, ...] = block.rows
        for row in rows:
            yield block, row


def groups_of(model: Model) -> dict[str, list[int]]:
    """Group name → element numbers, both in the order of the file."""
    out: dict[str, list[int]] = {}
    for _, row in rows_of(model):
        if row.group is not None:
            out.setdefault(row.group, []).append(row.id)
    return out


def has_property(model: Model, block: Block, row: Row, of: str) -> bool:
    """Whether an element has what a parameter ``of`` changes."""
    if of == GENERIC:  # what is drawn between nodes, or came as matrices
        whole = set(text_of(block).changes) & {"stiffness", "mass"}
        given = set(MATRICES) <= set(type(row).model_fields)
        named = given and bool(row.get("stiffness") or row.get("mass"))
        return named or bool(whole and text_of(block).outline)
    if of not in text_of(block).changes:
        return False
    if set(MATRICES) <= set(type(row).model_fields):  # given matrices: what each of them is for
        source = {"eta": "stiffness", "alpha": "mass", "beta": "stiffness"}.get(of, of)
        own = (row.get("damping"), row.get("structural")) if of == "damping" else (row.get(source),)
        return any(own) or (of == "damping" and lossy(model, row) is not None)
    if of == "damping" and row.get("c") is None:
        return lossy(model, row) is not None
    if of in ("G", "nu") and text_of(block).outline == "line":
        material = model.materials.get(row.get("material", ""))
        return material is None or (material.G is not None) == (of == "G")
    if of in SECTION_SHAPES:
        section = model.sections.get(row.get("section", ""))
        return section is None or section.shape == SECTION_SHAPES[of]
    return True


def lossy(model: Model, row: Row) -> str | None:
    """Where an element without a damper of its own has its damping from; None when it has none."""
    own = row.get("eta")
    if own is not None:
        return "row" if own > 0.0 else None
    material = model.materials.get(row.get("material", ""))
    if material is not None and material.eta is not None:
        return "material" if material.eta > 0.0 else None
    damping = model.damping
    return "damping" if any(getattr(damping, word, 0.0) > 0.0 for word in DAMPING_WORDS) else None


def members_of(model: Model, row: Member) -> tuple[int, ...]:
    """The elements of a row of [[model.families]] that have whole matrices."""
    carriers = carriers_of(model, GENERIC)
    if row.group is not None:
        named: Iterable[int] = groups_of(model).get(row.group, [])
    else:
        named = carriers if row.elements == "all" else row.elements or ()
    return tuple(e for e in dict.fromkeys(named) if e in carriers)


def _by_material(model: Model) -> dict[str, list[int]]:
    out: dict[str, list[int]] = {}
    for _, row in rows_of(model):
        material = row.get("material")
        if material is not None:
            out.setdefault(material, []).append(row.id)
    return out


def _expand(
    index: int,
    row: ParameterRow,
    carriers: dict[int, None],
    groups: dict[str, list[int]],
    made_of: dict[str, list[int]],
) -> Iterator[Target]:
    def target(stem: str, elements: Iterable[int], group: str | None = None) -> Target:
        name = row.name if row.each is None else f"{row.name}.{stem}"
        name = name if row.name is not None and name is not None else f"{stem}.{row.of}"
        family = (row.family or FamilyTable()) if row.of == GENERIC else None
        limits = (row.lower, row.upper, row.scale)
        return Target(name, row.of, tuple(elements), group, *limits, index, family)

    stem, members = _selection(row, carriers, groups, made_of)
    mine = [e for e in dict.fromkeys(members) if e in carriers]
    if row.each == "element":
        yield from (target(f"e{e}", (e,)) for e in mine)
    elif row.each == "group":
        chosen = set(mine)
        for group, inside in groups.items():
            some = [e for e in inside if e in chosen]
            if some:
                yield target(group, some, group)
    elif stem == "damping" and carriers:
        yield target(stem, ())
    elif mine:
        yield target(stem or _numbers(mine), mine, row.group)


def _selection(
    row: ParameterRow,
    carriers: dict[int, None],
    groups: dict[str, list[int]],
    made_of: dict[str, list[int]],
) -> tuple[str, Iterable[int]]:
    """What stands before the dot of the name, and the elements that the row names."""
    if row.group is not None:
        return row.group, groups.get(row.group, [])
    if row.groups is not None:
        return "+".join(row.groups), [e for g in row.groups for e in groups.get(g, [])]
    if row.material is not None:
        return row.material, made_of.get(row.material, [])
    if row.elements is not None:
        return ("all", carriers) if row.elements == "all" else ("", row.elements)
    return "damping", carriers


def _numbers(elements: list[int]) -> str:
    """``e1``, ``e1+e2+e5``, or ``e1..e40(12)`` for more than four."""
    if len(elements) <= 4:
        return "+".join(f"e{e}" for e in elements)
    return f"e{elements[0]}..e{elements[-1]}({len(elements)})"
