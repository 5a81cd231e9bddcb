"""What a member of a family of element matrices means: its nearest physical element, and how far it
is from any.

A stiffness between two nodes resists six strains, each with one number (Argyris's natural modes):
stretch EA/L, twist GJ/L, curvature EI/L about two axes, and, across them, the difference of the
chord from the mean end rotation, whose flexibility is L/(12 EI) + 1/(κGA L). Where stretch goes
with curvature, its axis lies beside the line of its nodes, where twist goes with shear, its shear
centre; EI and GJ are about them. Any other stiffness is read as a factor on its nominal matrix. A
mass is read as a factor on its nominal matrix with equal lumps and rotary inertias on its nodes,
none of them negative; its rigid-body mass and centre are exact, not read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.generic.family import Family
from cvxupdate.fe.generic.line import (
    NOTHING,
    SAID,
    Quantity,
    least_squares,
    line_parts,
    line_quantities,
    nearest,
)
from cvxupdate.fe.generic.shape import ElementShape
from cvxupdate.fe.generic.use import FamilyUse
from cvxupdate.fe.labels import KINDS

READ = 0.05  # of the change: what is less is not worth a number


@dataclass(frozen=True, eq=False)
class Reading:
    """One family at its end.

    ``X`` (r, r) in N/m or kg, of ``element`` (the first that it serves; where ``alone`` is true
    all of them have it); ``relative`` (r, r) is N + P; ``least`` and ``most`` are the eigenvalues
    of its classes, 1 where nothing changed; ``change`` is ‖P‖ / ‖N‖; ``quantities`` the nearest
    physical element, ``distance`` what of ‖N + P‖ that element has not, ``unread`` what of the
    change ‖P‖; ``spread`` (d, d) is the change of the element matrix relative to its diagonal,
    ``dofs`` are those of its rows, by the element's own node numbers from 1.
    """

    name: str
    matrix: str
    element: int
    elements: tuple[int, ...]
    alone: bool
    X: Real
    relative: Real
    least: float
    most: float
    change: float
    quantities: tuple[Quantity, ...]
    distance: float
    unread: float
    spread: Real
    dofs: tuple[str, ...]

    @property
    def says(self) -> str:
        """One sentence."""
        if self.change < NOTHING:
            return f"{self.name}: as it was."
        moved = [_words(q) for q in self.quantities if _moved(q)]
        physical = ", ".join(moved) if moved else "the nominal element"
        changed = f"{self.name}: changed by {self.change:.2g} of itself"
        if self.unread < READ:
            return f"{changed}, all of it as a physical element: {physical}."
        part = 1.0 - self.unread
        brings = "hardly any" if part < READ else f"{100.0 * part:.0f} %"
        return (
            f"{changed}. Nearest physical element: {physical}, {brings} of that change; "
            f"{100.0 * self.distance:.2g} % of the matrix is of no physical kind."
        )


def reading(use: FamilyUse, p: Real) -> Reading:
    """``use`` at the values ``p`` (entries,) of its parameters."""
    family, shape = use.families[0], use.shapes[0]
    relative, scale = family.relative(p), np.outer(family.sizes, family.sizes)
    before = family.member(family.nominal * scale)
    after = family.member(relative * scale)
    parts = list(_parts(family, shape, before))
    columns = np.array([_measured(family, part) for part, _ in parts]).T
    names = [name for _, name in parts]
    solve = _of_masses if family.matrix == "M" else nearest
    was, now = (solve(names, columns, _vector(R)) for R in (family.nominal, relative))
    left = relative - (columns @ now).reshape(relative.shape)
    heard = np.linalg.norm(columns, axis=0)
    was, now = (np.where(np.abs(v) * heard > NOTHING, v, 0.0) for v in (was, now))
    change = float(np.linalg.norm(relative - family.nominal))
    values = [np.linalg.eigvalsh(relative[np.ix_(c, c)]) for c in family.classes]
    size = np.sqrt(np.maximum(np.diag(before), NOTHING * np.diag(before).max()))
    return Reading(
        use.name,
        use.matrix,
        use.elements[0],
        use.elements,
        len(use.families) == 1,
        relative * scale,
        relative,
        min((float(v[0]) for v in values), default=1.0),
        max((float(v[-1]) for v in values), default=1.0),
        change / float(np.linalg.norm(family.nominal)),
        (
            *_rigid(family, shape, before, after),
            *_quantities(names, was, now, shape),
        ),
        float(np.linalg.norm(left) / np.linalg.norm(relative)),
        min(1.0, float(np.linalg.norm(left)) / change) if change > NOTHING else 0.0,
        (after - before) / np.outer(size, size),
        _labels(shape, len(before)),
    )


def _labels(shape: ElementShape | None, count: int) -> tuple[str, ...]:
    if shape is None:
        return tuple(str(i + 1) for i in range(count))
    both = zip(shape.node.tolist(), shape.kind.tolist(), strict=True)
    return tuple(f"{n + 1} {KINDS[k]}" for n, k in both)


def _vector(A: Real) -> Real:
    return np.asarray(A.reshape(-1))


def _measured(family: Family, part: Real) -> Real:
    """An element matrix in the measure of P, (r²,)."""
    return _vector(family.coordinates(part) / np.outer(family.sizes, family.sizes))


def _parts(family: Family, shape: ElementShape | None, before: Real) -> Iterator[tuple[Real, str]]:
    """Matrices (d, d) that a physical element is the sum of, and their names."""
    if family.matrix == "K" and shape is not None and len(shape.xyz) == 2:
        yield from line_parts(shape, before)
        return
    lumps = []
    if family.matrix == "M" and shape is not None:
        for name, some in (("lump", shape.kind < 3), ("rotary lump", shape.kind >= 3)):
            if np.any(some):
                lumps.append((np.diag(some.astype(float)), name))
    columns = np.array([_measured(family, lump) for lump, _ in lumps]).T
    nominal = _vector(family.nominal)
    if not lumps or np.linalg.norm(columns @ least_squares(columns, nominal) - nominal) > SAID:
        yield before, "factor"  # else the nominal element is itself those lumps
    yield from lumps


def _of_masses(names: list[str], columns: Real, of: Real) -> Real:
    """Least squares of parts that no mass has less than nothing of."""
    from scipy.optimize import nnls

    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    return np.asarray(nnls(columns / size, of)[0] / size)


def _quantities(
    names: list[str], before: Real, after: Real, shape: ElementShape | None
) -> Iterator[Quantity]:
    old, new = (dict(zip(names, v.tolist(), strict=True)) for v in (before, after))
    if shape is not None:
        yield from line_quantities(old, new, shape.length)
    if "factor" in old:
        yield Quantity("factor", old["factor"], new["factor"], "1")
    for name, unit in (("lump", "kg"), ("rotary lump", "kg m²")):
        if name in old:
            yield Quantity(f"{name} on each node", old[name], new[name], unit)


def _rigid(
    family: Family, shape: ElementShape | None, before: Real, after: Real
) -> Iterator[Quantity]:
    """Mass and the place of its centre along the element's translations."""
    if family.matrix != "M" or shape is None:
        return
    bodies = [shape.rigid.T @ A @ shape.rigid for A in (before, after)]
    there = [a for a in range(3) if np.any(shape.kind == a)]
    if not there:
        return
    axis = there[0]
    mass = [float(B[axis, axis]) for B in bodies]
    yield Quantity("mass", mass[0], mass[1], "kg")
    # m x × t: the moment of inertia forces of a translation about the centre of the nodes
    offsets = [
        float(np.linalg.norm(B[3:, axis])) * shape.length / m
        for B, m in zip(bodies, mass, strict=True)
    ]
    offsets = [v if v > NOTHING * shape.length else 0.0 for v in offsets]
    yield Quantity("offset of its centre", offsets[0], offsets[1], "m")


def _moved(q: Quantity) -> bool:
    if q.before is None or q.after is None:
        return (q.before is None) != (q.after is None)
    return abs(q.after - q.before) > SAID * max(abs(q.before), abs(q.after)) and (
        q.unit != "m" or abs(q.after) > 1e-9
    )


def _words(q: Quantity) -> str:
    old, new = (
        "unbounded" if v is None else f"{'−' if v < 0.0 else ''}{abs(v):.4g}"
        for v in (q.before, q.after)
    )
    return f"{q.name} {old} → {new}{'' if q.unit == '1' else ' ' + q.unit}"
