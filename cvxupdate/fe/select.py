"""Parameters asked for by a problem file → `Parameter` objects on the elements of a model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import P_VALUES, Parameter, Target, unit_of
from cvxupdate.fe.sections import FACTORS, section_constants

_NEEDS = {
    "stiffness": "K",
    "whole": "K",
    "mass": "M",
    "eta": "K",
    "alpha": "M",
    "beta": "K",
}  # the matrix that makes the word mean anything
_AWAKE = {
    "shear": 1.0,
    "N": 1.0,
}  # physics through which nu and kappa act, though the model may not have it yet
_POISSON_MAX = 0.495  # the isotropic rigidities lose their meaning at 1/2


class Wanted(Protocol):
    """What is asked for (`cvxupdate.spec.Target`): a name, a property, element numbers (none: all),
    own bounds, the size of one unit."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def of(self) -> str: ...  # noqa: D102
    @property
    def elements(self) -> tuple[int, ...]: ...  # noqa: D102
    @property
    def group(self) -> str | None: ...  # noqa: D102
    @property
    def lower(self) -> float | None: ...  # noqa: D102
    @property
    def upper(self) -> float | None: ...  # noqa: D102
    @property
    def scale(self) -> float | None: ...  # noqa: D102


def select_parameters(
    wanted: Sequence[Wanted], model: Model, lower: float = -np.inf, upper: float = np.inf
) -> tuple[Parameter, ...]:
    """Parameters in the order of ``wanted``; ``lower`` and ``upper`` bound p where an entry has no
    bound of its own.

    Without any lower bound a factor stays above 0.01 of its value: one that vanishes or changes
    sign is no structure any more.

    Raises
    ------
    ModelError
        When an entry finds no element with the property, asks for a relative change of zero, or
        repeats a name.
    """
    places: dict[int, list[tuple[int, int]]] = {}
    for number, block in enumerate(model.blocks):
        for row, element in enumerate(block.ids.tolist()):
            places.setdefault(element, []).append((number, row))
    able = {of: [has_property(b, of) for b in model.blocks] for of in {w.of for w in wanted}}
    out = [_parameter(w, model, _rows(w, model, places, able[w.of]), lower, upper) for w in wanted]
    seen: set[str] = set()
    for p in out:
        if p.name in seen:
            raise ModelError(
                f"update.parameters: the name {p.name!r} stands for two parameters. Give one "
                "of them a `name`."
            )
        seen.add(p.name)
    return tuple(out)


def property_names(of: str) -> tuple[str, ...]:
    """The stored properties that a word of the problem file moves: I stands for Iy and Iz together;
    what no file says, ``whole`` for the p-values of stiffness and mass, ``inertia`` for that of a
    lump about all axes."""
    words = {"I": ("Iy", "Iz"), "whole": ("stiffness", "mass"), "inertia": ("Ixx", "Iyy", "Izz")}
    return words.get(of, (of,))


def has_property(block: Block, of: str) -> bool:
    """Whether the elements of ``block`` have the property ``of`` and it can move one of their
    matrices (J of a plane beam cannot); a base has none."""
    if block.is_base:
        return False
    matrices = {t.matrix for t in block.terms}
    if of in _NEEDS:
        return _NEEDS[of] in matrices
    if of == "damping":
        lossy = any(np.any(block.properties[k] != 0.0) for k in ("eta", "alpha", "beta"))
        return bool(matrices & {"C", "D"}) or (lossy and bool(matrices & {"K", "M"}))
    if of == "G" and not np.any(block.properties.get("G", 0.0)):
        return False  # it follows E and nu
    names = property_names(of)
    return all(n in block.kind.properties for n in names) and block.moves(names, _AWAKE)


def _rows(
    wanted: Wanted, model: Model, places: dict[int, list[tuple[int, int]]], able: Sequence[bool]
) -> list[Index]:
    ids = wanted.elements or tuple(places)
    rows: list[list[int]] = [[] for _ in model.blocks]
    for element in ids:
        for number, row in places.get(element, []):
            if able[number]:
                rows[number].append(row)
    if not any(rows):
        raise ModelError(
            f"update.parameters: {wanted.name}: no element there has the property "
            f"{wanted.of!r}. Choose other elements or another `of`."
        )
    return [np.array(r, dtype=np.int64) for r in rows]


def _parameter(
    wanted: Wanted, model: Model, rows: Sequence[Index], lower: float, upper: float
) -> Parameter:
    names = property_names(wanted.of)
    targets, today = [], []
    for number, (block, chosen) in enumerate(zip(model.blocks, rows, strict=True)):
        if not len(chosen):
            continue
        base = np.array([block.properties[n][chosen] for n in names])
        scale = np.where(base != 0.0, base, wanted.scale or 0.0)
        targets.append(Target(number, chosen, names, scale))
        today.append(_today(block, names[0], chosen))
    if all(np.all(t.scales == 0.0) for t in targets):
        raise ModelError(
            f"update.parameters: {wanted.name} is zero today, so a relative change means "
            "nothing. Give `scale`, the size of one unit of p."
        )
    values = np.concatenate(today)
    same = np.ptp(values) <= 1e-12 * np.abs(values).max()
    unit = unit_of(wanted.of)
    if wanted.of in P_VALUES:
        nominal, size, unit = 0.0, 1.0, "1"
    elif (
        not same
    ):  # elements of several values share one p: its physical reading is their common factor
        nominal, size, unit = 1.0, 1.0, "1"
    else:
        nominal = float(values[0])
        size = nominal if nominal != 0.0 else float(wanted.scale or 1.0)
    if unit in ("N/m", "N*s/m") and all(
        np.all(model.blocks[t.block].direction >= 3) for t in targets
    ):
        unit = {"N/m": "N*m/rad", "N*s/m": "N*m*s/rad"}[unit]
    low = wanted.lower if wanted.lower is not None else lower
    high = wanted.upper if wanted.upper is not None else upper
    if not np.isfinite(low) and np.all(values != 0.0):
        low = -0.99
    if wanted.of == "nu" and values.max() > 0.0:
        high = min(high, _POISSON_MAX / float(values.max()) - 1.0)
    return Parameter(
        wanted.name,
        wanted.of,
        tuple(targets),
        float(low),
        float(high),
        nominal,
        size,
        unit,
        wanted.elements,
        wanted.group,
    )


def _today(block: Block, name: str, rows: Index) -> Real:
    section = getattr(block.kind, "section", None)
    values: NDArray[Any] = (
        section_constants(section, block.properties)[name]
        if section is not None and name in FACTORS
        else block.properties[name]
    )
    return np.asarray(values[rows], dtype=float)
