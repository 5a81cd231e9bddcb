"""A stiffness between two nodes as that of a line: six strains, each with one number (Argyris's
natural modes), and what goes together where the line is eccentric."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.generic.shape import ElementShape

NOTHING = 1e-9  # of a vector's or a matrix's own size: what is less is rounding
SAID = 1e-3  # relative change below which a number is said to be as it was
ECCENTRIC = (
    ("axis y", "EA", "EIz"),
    ("axis z", "EA", "EIy"),
    ("centre y", "shear z", "GJ"),
    ("centre z", "shear y", "GJ"),
)
"""Strains that go together where the axis of a line, or its shear centre, lies beside its nodes
along y or z."""
PRODUCTS = (("product", "EIz", "EIy"), ("shear product", "shear y", "shear z"))
"""Strains that go together where the principal axes of a section are turned."""
RIGID = 12.0  # stiffness across, in EI/L, of a line that does not shear


@dataclass(frozen=True)
class Quantity:
    """A physical number of an element ``before`` and ``after`` in ``unit``; None where it is
    without bound (the shear stiffness of a beam that does not shear) or has no value."""

    name: str
    before: float | None
    after: float | None
    unit: str


def line_parts(shape: ElementShape, before: Real) -> Iterator[tuple[Real, str]]:
    """Matrices (d, d) that the stiffness of a line is the sum of, and their names: of strains that
    the nominal one ``before`` resists, and of those that go together."""
    seen = {
        name: b
        for name, b in _strains(shape, before)
        if b @ before @ b > NOTHING * float(np.abs(before).max()) * (b @ b)
    }
    yield from ((np.outer(b, b), name) for name, b in seen.items())
    for name, one, other in (*ECCENTRIC, *PRODUCTS):
        if one in seen and other in seen:
            both = np.outer(seen[one], seen[other])
            yield both + both.T, name


def least_squares(columns: Real, of: Real) -> Real:
    """Factors of the parts in the sense of least squares; parts that are one another's sums share
    theirs."""
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    return np.asarray(np.linalg.lstsq(columns / size, of, rcond=NOTHING)[0] / size)


def nearest(names: list[str], columns: Real, of: Real) -> Real:
    """`least_squares`, where a line is never stiffer across than one that does not shear."""
    planes = [
        (names.index(f"shear {axis}"), names.index(bend))
        for axis, bend in (("y", "EIz"), ("z", "EIy"))
        if f"shear {axis}" in names and bend in names
    ]
    held: list[tuple[int, int]] = []
    while True:
        tied = columns.copy()
        for s, c in held:
            tied[:, c] += RIGID * columns[:, s]
            tied[:, s] = 0.0
        values = least_squares(tied, of)
        for s, c in held:
            values[s] = RIGID * values[c]
        more = [
            (s, c)
            for s, c in planes
            if (s, c) not in held and values[s] > RIGID * values[c] * (1.0 + SAID)
        ]
        if not more:
            return values
        held += more


def _strains(shape: ElementShape, K: Real) -> Iterator[tuple[str, Real]]:
    """Names and strains (d,) of a line, each of the DOFs that it has all of: no rigid motion
    strains it."""
    turn, L = shape.turned(next(shape.frames(K))), shape.length
    x = shape.xyz[1] - shape.xyz[0]
    sign = 1.0 if next(shape.frames(K))[0] @ x > 0.0 else -1.0
    for name, first, second in (
        ("EA", (0, -1.0), (6, 1.0)),
        ("GJ", (3, -1.0), (9, 1.0)),
        ("EIz", (5, -1.0), (11, 1.0)),
        ("EIy", (4, -1.0), (10, 1.0)),
    ):
        local = np.zeros(12)
        for at, value in (first, second):
            local[at] = value
        yield from _kept(name, turn @ local, shape)
    for name, across, rotation, side in (("shear y", 1, 5, 1.0), ("shear z", 2, 4, -1.0)):
        local = np.zeros(12)
        local[[across, across + 6]] = -sign / L, sign / L
        local[[rotation, rotation + 6]] = -0.5 * side
        yield from _kept(name, turn @ local, shape)


def _kept(name: str, b: Real, shape: ElementShape) -> Iterator[tuple[str, Real]]:
    size = float(np.linalg.norm(b))
    if size > NOTHING and np.abs(b @ shape.rigid).max() < 1e-8 * size:
        yield name, b


def line_quantities(old: dict[str, float], new: dict[str, float], L: float) -> Iterator[Quantity]:
    """What the factors of `line_parts` mean for a line of length ``L``; nothing for others."""
    one = ("EIy" in old) != ("EIz" in old)  # a beam in a plane has one EI
    offsets, product = zip(*(_centred(v, L) for v in (old, new)), strict=True)
    for name, unit in (("EA", "N"), ("GJ", "N m²"), ("EIz", "N m²"), ("EIy", "N m²")):
        if name in old:
            yield Quantity(_shown(name, one), old[name] * L, new[name] * L, unit)
    for axis, bend in (("y", "EIz"), ("z", "EIy")):
        if f"shear {axis}" in old and bend in old:
            was, now = (_shear(v[f"shear {axis}"], v[bend], L) for v in (old, new))
            yield Quantity(_shown(f"κGA {axis}", one), was, now, "N")
    for name in offsets[0]:
        if max(offsets[0][name], offsets[1][name]) > NOTHING * L:
            yield Quantity(_shown(name, one), offsets[0][name], offsets[1][name], "m")
    if "product" in old and max(map(abs, product)) > NOTHING * (abs(new["EIy"]) + abs(new["EIz"])):
        yield Quantity("EI, product of the planes", product[0] * L, product[1] * L, "N m²")


def _centred(values: dict[str, float], L: float) -> tuple[dict[str, float], float]:
    """How far the axis and the shear centre lie beside the line of the nodes [m], and the product
    of bending in both planes; ``values`` of EI and GJ become those about axis and centre (Steiner's
    part taken off)."""
    arms = {}
    for name, first, second in ECCENTRIC:
        if name in values:
            size = values[first]
            arms[name] = values[name] / size if size > 0.0 else 0.0
            values[second] -= size * arms[name] ** 2
    product = values.get("product", 0.0)
    if "axis y" in arms and "axis z" in arms:
        product -= values["EA"] * arms["axis y"] * arms["axis z"]
    # the strain across is one per length
    out = {n: abs(v) * (L if n.startswith("centre") else 1.0) for n, v in arms.items()}
    return out, product


def _shown(name: str, one: bool) -> str:
    """Of the planes of a line (`ElementShape.frames`) the first across is the softer one: y."""
    plane = {"z": "stiffer", "y": "softer"}.get(name[-1])
    plane = {"EIz": "softer", "EIy": "stiffer"}.get(name, plane)
    if plane is None:
        return name
    said = {"EI": "EI", "ax": "offset of its axis", "ce": "offset of its shear centre"}
    stem = said.get(name[:2], "κGA")
    return stem if one else f"{stem}, {plane} plane"


def _shear(S: float, curvature: float, L: float) -> float | None:
    """κGA of a line whose stiffness across is ``S`` and against curvature EI/L; None where it is
    stiffer than one that does not shear (or as stiff)."""
    if S <= 0.0 or curvature <= 0.0:
        return None
    left = 1.0 / S - 1.0 / (RIGID * curvature)
    return 1.0 / (L * left) if left > SAID / S else None
