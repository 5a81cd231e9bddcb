"""Instances of every element type: the contract tests of tests/fe run over all of them.

Weak fixtures hide errors: spans are unequal, nothing is symmetric, line elements are oblique in
space.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.spec import load_problem
from cvxupdate.spec.solids import HEX8, HEX20, TET10

STEEL = {"E": 207e9, "nu": 0.28, "rho": 7850.0}
ALLOY = {"E": 70e9, "nu": 0.33, "rho": 2700.0}
SECTIONS: dict[str, dict[str, Any]] = {
    "bar": {"shape": "rectangle", "width": 0.1, "height": 0.012},
    "upright": {"shape": "rectangle", "width": 0.008, "height": 0.03},
    "round": {"shape": "circle", "diameter": 0.02},
    "tube": {"shape": "circle", "diameter": 0.04, "wall": 0.003},
    "general": {"shape": "general", "A": 6.0e-4, "Iy": 5.0e-8, "Iz": 2.0e-8, "J": 1.3e-8},
    "sheet": {"shape": "plate", "thickness": 0.0025},
    "thick": {"shape": "plate", "thickness": 0.06, "Dx": 1.1, "D1": 0.9, "kappa": 0.8},
    "rolled": {"shape": "plate", "thickness": 0.003, "Dx": 1.1, "Dy": 0.9, "D1": 1.05, "Dxy": 0.85},
}
SPACE = ["x", "y", "z", "rx", "ry", "rz"]


@dataclass(frozen=True)
class Case:
    """One element type in one guise. ``null`` is the number of motions of a single element that
    take no energy, ``mass_rank`` that of its mass."""

    name: str
    model: Mapping[str, Any]
    null: int
    mass_rank: int
    values: Mapping[str, float] = field(
        default_factory=dict
    )  # properties that a problem file has no key for

    def build(self, **values: float) -> Model:
        """The model, with property ``values`` set on every element that has them."""
        return with_values(build(self.model), **{**self.values, **values})


def toml(value: Any) -> str:
    """A value as TOML, tables inline."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Sequence | np.ndarray):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return repr(float(value)) if isinstance(value, float | np.floating) else str(int(value))


def build(model: Mapping[str, Any], folder: Path | None = None, **tables: Any) -> Model:
    """A model by way of a problem file: everything the user's text goes through."""
    with tempfile.TemporaryDirectory() as scratch:
        path = (folder or Path(scratch)) / "problem.toml"
        path.write_text(
            "\n".join(f"{key} = {toml(value)}" for key, value in {"model": model, **tables}.items())
            + "\n",
            encoding="utf-8",
        )
        return build_model(load_problem(path))


def with_values(model: Model, **values: float) -> Model:
    """The model with some properties changed on every element that has them."""
    blocks = tuple(
        replace(
            b,
            properties={
                k: np.full(len(b.ids), values[k]) if k in values else v
                for k, v in b.properties.items()
            },
        )
        for b in model.blocks
    )
    return replace(model, blocks=blocks)


def nodes(points: Any) -> list[dict[str, Any]]:
    """Points (n, 3) as node rows numbered from 1."""
    return [
        {"id": i + 1, "x": float(x), "y": float(y), "z": float(z)}
        for i, (x, y, z) in enumerate(points)
    ]


def chain(count: int) -> list[tuple[int, int]]:
    """Node pairs 1-2, 2-3, … of ``count`` elements."""
    return [(i, i + 1) for i in range(1, count + 1)]


def lines(
    kind: str,
    points: Any,
    pairs: Sequence[tuple[int, int]],
    dofs: Sequence[str],
    section: str | Mapping[str, Any] = "bar",
    material: Mapping[str, float] = STEEL,
    orientation: Sequence[float] | None = None,
    **block: Any,
) -> dict[str, Any]:
    """A model of rods or beams."""
    shape = SECTIONS[section] if isinstance(section, str) else section
    element = {
        "type": kind,
        "material": "m",
        "section": "s",
        **block,
        "rows": [
            {"id": i + 1, "nodes": list(p), "group": "odd" if i % 2 else "even"}
            for i, p in enumerate(pairs)
        ],
    }
    if orientation is not None:
        element["orientation"] = list(orientation)
    return {
        "dofs": list(dofs),
        "nodes": nodes(points),
        "materials": {"m": dict(material)},
        "sections": {"s": dict(shape)},
        "elements": [element],
    }


def grid(
    xs: Any,
    ys: Any,
    section: str | Mapping[str, Any] = "sheet",
    material: Mapping[str, float] = STEEL,
    turn: int = 0,
    **block: Any,
) -> dict[str, Any]:
    """A plate on a grid of lines x = xs, y = ys; ``turn`` starts each element at another corner."""
    shape = SECTIONS[section] if isinstance(section, str) else section
    nx = len(xs)
    points = [(x, y, 0.0) for y in ys for x in xs]
    rows = []
    for j in range(len(ys) - 1):
        for i in range(nx - 1):
            first = j * nx + i + 1
            quad = [first, first + 1, first + nx + 1, first + nx]
            rows.append(
                {
                    "id": len(rows) + 1,
                    "nodes": quad[turn:] + quad[:turn],
                    "group": "odd" if (i + j) % 2 else "even",
                }
            )
    return {
        "dofs": ["z", "rx", "ry"],
        "nodes": nodes(points),
        "materials": {"m": dict(material)},
        "sections": {"s": dict(shape)},
        "elements": [{"type": "plate", "material": "m", "section": "s", **block, "rows": rows}],
    }


def sheet(
    points: Any,
    cells: Sequence[Sequence[int]],
    section: str | Mapping[str, Any] = "sheet",
    material: Mapping[str, float] = STEEL,
    dofs: Sequence[str] = SPACE,
    kind: str = "shell",
    **block: Any,
) -> dict[str, Any]:
    """A model of shells (or of solids, which have no section) on ``points`` (n, 3); ``cells`` name
    them from 0."""
    shape = SECTIONS[section] if isinstance(section, str) else section
    thick = {"section": "s"} if kind == "shell" else {}
    rows = [
        {"id": i + 1, "nodes": [int(n) + 1 for n in cell], "group": "odd" if i % 2 else "even"}
        for i, cell in enumerate(cells)
    ]
    return {
        "dofs": list(dofs),
        "nodes": nodes(points),
        "materials": {"m": dict(material)},
        "sections": {"s": dict(shape)} if thick else {},
        "elements": [{"type": kind, "material": "m", **thick, **block, "rows": rows}],
    }


def squares(
    nx: int, ny: int, jitter: float = 0.0, times: int = 1
) -> tuple[np.ndarray, list[list[int]]]:
    """The unit square in nx × ny quadrilaterals: points (n, 2) and cells. ``jitter`` moves what
    lies inside by up to that part of a side, always the same way; then each side is divided in
    ``times``."""
    grid = np.stack(
        np.meshgrid(np.linspace(0.0, 1.0, nx + 1), np.linspace(0.0, 1.0, ny + 1)), axis=2
    )
    shift = np.random.default_rng(5).uniform(-jitter, jitter, grid.shape) / np.array([nx, ny])
    grid[1:-1, 1:-1] += shift[1:-1, 1:-1]
    for axis in (0, 1):
        grid = _between(grid, axis, times)
    points, mx, my = grid.reshape(-1, 2), nx * times, ny * times
    first = [j * (mx + 1) + i for j in range(my) for i in range(mx)]
    return points, [[a, a + 1, a + mx + 2, a + mx + 1] for a in first]


def _between(grid: np.ndarray, axis: int, times: int) -> np.ndarray:
    """Equal steps between the lines of a grid of points."""
    count = grid.shape[axis] - 1
    whole, part = np.divmod(np.arange(count * times + 1), times)
    low, high = np.take(grid, whole, axis), np.take(grid, np.minimum(whole + 1, count), axis)
    part = (part / times).reshape([-1 if k == axis else 1 for k in range(3)])
    return low + part * (high - low)


def halved(cells: Sequence[Sequence[int]]) -> list[list[int]]:
    """Every quadrilateral as two triangles, along its diagonals in turn."""
    out = []
    for k, (a, b, c, d) in enumerate(cells):
        out += [[a, b, c], [a, c, d]] if k % 2 else [[a, b, d], [b, c, d]]
    return out


def held(model: Mapping[str, Any], *supports: tuple[Any, Sequence[str]]) -> dict[str, Any]:
    """The model with supports (nodes, dofs)."""
    return {
        **model,
        "supports": [
            {"nodes": n if isinstance(n, str) else [int(i) for i in n], "dofs": list(d)}
            for n, d in supports
        ],
    }


def joined(*models: Mapping[str, Any]) -> dict[str, Any]:
    """The first model with the elements of the others added (ids run on, nodes are those of the
    first)."""
    first, elements, number = dict(models[0]), [], 0
    for m in models:
        for block in m["elements"]:
            rows = [{**row, "id": number + i + 1} for i, row in enumerate(block["rows"])]
            number += len(rows)
            elements.append({**block, "rows": rows})
    return {**first, "elements": elements}


POINTS = np.array([[0.1, -0.2, 0.05], [0.62, 0.31, -0.12], [0.95, 0.28, 0.44], [0.41, 0.9, 0.6]])
FLAT_Y = POINTS * [1.0, 1.0, 0.0]
FLAT_Z = POINTS * [1.0, 0.0, 1.0]


CREASED = np.array(
    [
        [0.1, -0.2, 0.05],
        [0.52, -0.11, -0.02],
        [0.95, -0.3, 0.24],
        [0.02, 0.21, 0.1],
        [0.47, 0.3, 0.16],
        [1.01, 0.17, 0.3],
    ]
)
"""Six points of a warped strip in space."""
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4]]
TRIANGLES = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]


def solids(kind: str) -> tuple[np.ndarray, list[list[int]]]:
    """Two bricks side by side, or six tetrahedra that fill one, distorted and oblique in space."""
    x, y, z = np.meshgrid([0.0, 0.5, 1.1], [0.0, 0.4], [0.0, 0.3], indexing="ij")
    corners = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    corners = corners + np.random.default_rng(8).uniform(-0.05, 0.05, corners.shape)
    corners = corners @ np.array([[0.8, 0.6, 0.1], [-0.5, 0.7, 0.3], [0.1, -0.4, 0.9]])
    bricks = [[4 * i + k for k in (0, 4, 6, 2, 1, 5, 7, 3)] for i in range(2)]
    shape = {"hex8": HEX8, "hex20": HEX20, "tet10": TET10}[kind]
    if kind == "tet10":
        rounds = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))
        bricks = [[bricks[0][k] for k in (0, a, b, 6)] for a, b in rounds]
        corners = corners[:8]
    points, cells, middle = list(corners), [], {}
    for brick in bricks:
        cell = list(brick)
        for i, j in shape.edges if shape.quadratic else ():
            pair = frozenset((brick[i], brick[j]))
            if pair not in middle:
                middle[pair] = len(points)
                points.append((corners[brick[i]] + corners[brick[j]]) / 2.0)
            cell.append(middle[pair])
        cells.append(cell)
    return np.array(points), cells


def _points(elements: list[dict[str, Any]], dofs: Sequence[str] = ("x",)) -> dict[str, Any]:
    return {"dofs": list(dofs), "nodes": nodes(POINTS[:3]), "elements": elements}


def _each(**value: tuple[float, ...]) -> list[dict[str, Any]]:
    ((key, amounts),) = value.items()
    return [
        {"id": 50 + i, "nodes": [i + 1], key: a, "group": "ground"} for i, a in enumerate(amounts)
    ]


def _line(kind: str, **value: tuple[float, ...]) -> dict[str, Any]:
    ((key, amounts),) = value.items()
    return {
        "type": kind,
        "dof": "x",
        "rows": [{"id": 10 + i, "nodes": [i + 1, i + 2], key: a} for i, a in enumerate(amounts)],
    }


_MASS = {
    "type": "mass",
    "rows": [
        {"id": 90 + i, "nodes": [i + 1], "m": m, "Ixx": 0.1 * m, "Iyy": 0.2 * m, "Izz": 0.3 * m}
        for i, m in enumerate((2.5, 1.5, 0.7))
    ],
}

_SHAFT = {
    "type": "gyroscopic",
    "omega": 300.0,
    "rows": [{"id": 70, "nodes": [1, 2], "Ip": 2.6e-4}, {"id": 71, "nodes": [3, 2], "Ip": 1.4e-4}],
}
_DISC = {
    "type": "gyroscopic",
    "omega": -210.0,
    "axis": [0.3, -0.9, 0.4],
    "rows": [{"id": 70, "nodes": [1], "Ip": 0.06}, {"id": 71, "nodes": [3], "Ip": 0.02}],
}

_HELD = {"type": "spring", "dofs": ["x", "y"], "rows": _each(k=(3e5, 1e5, 7e4))}


def _nonlinear(kind: str, **values: Any) -> Case:
    """One of a kind between two nodes and one to ground, beside springs that hold all of them."""
    block = {
        "type": kind,
        "dof": "y",
        "rows": [
            {"id": 80, "nodes": [1, 3], **{k: v[0] for k, v in values.items()}},
            {"id": 81, "nodes": [2], **{k: v[1] for k, v in values.items()}},
        ],
    }
    return Case(kind, _points([block, _HELD, _MASS], ["x", "y"]), 0, 0)


NONLINEAR_CASES = (
    _nonlinear("cubic_spring", k3=(2e7, -3e5), k2=(0.0, 40.0), even=(30.0, 0.0)),
    _nonlinear("clearance", k=(4e4, 7e4), gap=(-1e-3, 2e-3), sides=("one", "two")),
    _nonlinear("friction", force=(3.0, 8.0)),
    _nonlinear("jenkins", k=(4e4, 9e4), force=(3.0, 8.0), play=(0.0, 1e-4)),
    _nonlinear("iwan", stiffnesses=([4e4, 2e4], [5e4]), forces=([3.0, 6.0], [8.0])),
    _nonlinear("bouc_wen", k=(4e4, 9e4), force=(3.0, 8.0), n=(1.0, 2.0), gamma=(0.5, 0.7)),
    _nonlinear("quadratic_damper", c2=(12.0, 5.0)),
)

CASES: tuple[Case, ...] = (
    *NONLINEAR_CASES,
    Case("spring", _points([_line("spring", k=(3e5, 5e5)), _MASS]), 1, 0),
    Case(
        "spring to ground",
        _points(
            [{"type": "spring", "dofs": ["x", "rz"], "rows": _each(k=(3e5, 1e5, 7e4))}, _MASS],
            ["x", "rz"],
        ),
        0,
        0,
    ),
    Case(
        "mass",
        _points(
            [_MASS, {"type": "spring", "dofs": SPACE, "rows": _each(k=(3e5, 1e5, 7e4))}], SPACE
        ),
        6,
        6,
    ),
    Case("dashpot", _points([_line("dashpot", c=(30.0, 7.0)), _MASS]), 2, 0),
    Case(
        "dashpot to ground",
        _points(
            [{"type": "dashpot", "dofs": ["x", "ry"], "rows": _each(c=(3.0, 0.1, 0.7))}, _MASS],
            ["x", "ry"],
        ),
        1,
        0,
    ),
    Case(
        "gyroscopic shaft",
        joined(lines("beam3d", POINTS, chain(3), SPACE, "round"), _points([_SHAFT], SPACE)),
        6,
        0,
    ),
    Case(
        "gyroscopic disc",
        _points(
            [_DISC, _MASS, {"type": "spring", "dofs": SPACE, "rows": _each(k=(3e5, 1e5, 7e4))}],
            SPACE,
        ),
        3,
        0,
    ),
    Case("rod consistent", lines("rod", POINTS, [*chain(3), (1, 3)], "xyz", "round"), 5, 6),
    Case(
        "rod lumped", lines("rod", POINTS, [*chain(3), (1, 3)], "xyz", "bar", mass="lumped"), 5, 6
    ),
    Case("rod general", lines("rod", POINTS, chain(3), "xyz", "general", ALLOY), 5, 6),
    Case("beam2d xy", lines("beam2d", FLAT_Y, [*chain(3), (1, 3)], ["x", "y", "rz"], "bar"), 3, 6),
    Case(
        "beam2d xz", lines("beam2d", FLAT_Z, [*chain(3), (1, 3)], ["x", "z", "ry"], "upright"), 3, 6
    ),
    Case(
        "beam2d lumped",
        lines("beam2d", FLAT_Y, chain(3), ["x", "y", "rz"], "tube", mass="lumped"),
        3,
        6,
    ),
    Case(
        "beam2d no rotary inertia",
        lines("beam2d", FLAT_Y, chain(3), ["x", "y", "rz"], "general", rotary_inertia=False),
        3,
        6,
    ),
    Case("beam3d rectangle", lines("beam3d", POINTS, [*chain(3), (1, 3)], SPACE, "bar"), 6, 12),
    Case(
        "beam3d oriented",
        lines("beam3d", POINTS, chain(3), SPACE, "upright", ALLOY, orientation=[0.3, -0.9, 0.4]),
        6,
        12,
    ),
    Case("beam3d round", lines("beam3d", POINTS, chain(3), SPACE, "round"), 6, 12),
    Case("beam3d tube", lines("beam3d", POINTS, chain(3), SPACE, "tube", ALLOY), 6, 12),
    Case(
        "beam3d general",
        lines("beam3d", POINTS, chain(3), SPACE, "general", orientation=[0.1, 0.2, 1.0]),
        6,
        12,
    ),
    Case(
        "beam3d own G",
        lines(
            "beam3d", POINTS, chain(3), SPACE, "upright", {**ALLOY, "G": 31e9}, polar_inertia="J"
        ),
        6,
        12,
    ),
    Case("beam3d lumped", lines("beam3d", POINTS, chain(3), SPACE, "bar", mass="lumped"), 6, 12),
    Case(
        "beam3d no rotary inertia",
        lines("beam3d", POINTS, chain(3), SPACE, "bar", rotary_inertia=False),
        6,
        10,
    ),
    Case(
        "beam3d Timoshenko",
        lines("beam3d", POINTS, [*chain(3), (1, 3)], SPACE, "bar"),
        6,
        12,
        {"shear": 1.0},
    ),
    Case(
        "beam2d half shear",
        lines("beam2d", FLAT_Y, chain(3), ["x", "y", "rz"], "bar"),
        3,
        6,
        {"shear": 0.5, "kappa": 0.8},
    ),
    Case("exact_beam", lines("exact_beam", POINTS, [*chain(3), (1, 3)], SPACE, "bar"), 6, 12),
    Case(
        "exact_beam Timoshenko",
        lines("exact_beam", POINTS, chain(3), SPACE, "upright", {**ALLOY, "G": 31e9}),
        6,
        12,
        {"shear": 1.0},
    ),
    Case("plate", grid([0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26]), 3, 12),
    Case(
        "plate orthotropic", grid([0.0, 0.11, 0.3, 0.42], [0.1, 0.27, 0.36], "rolled", ALLOY), 3, 12
    ),
    Case("plate lumped", grid([0.0, 0.11, 0.3], [0.0, 0.17, 0.26], "rolled", mass="lumped"), 3, 4),
    Case("shell quadrilaterals", sheet(CREASED, QUADS), 6, 20),
    Case("shell triangles", sheet(CREASED, TRIANGLES, "rolled", ALLOY), 6, 15),
    Case("shell thick quadrilaterals", sheet(CREASED, QUADS, "thick"), 6, 20),
    Case(
        "shell thick triangles, oriented",
        sheet(CREASED, TRIANGLES, "thick", orientation=[0.3, -0.9, 0.4]),
        6,
        15,
    ),
    Case(
        "shell offset quadrilaterals",
        sheet(CREASED, QUADS, "rolled", offset=0.004, surface="bottom"),
        6,
        20,
    ),
    Case("shell offset triangles", sheet(CREASED, TRIANGLES, "thick", surface="top"), 6, 15),
    Case("shell lumped quadrilaterals", sheet(CREASED, QUADS, "thick", mass="lumped"), 6, 20),
    Case(
        "shell lumped triangles, no rotary inertia",
        sheet(CREASED, TRIANGLES, mass="lumped", rotary_inertia=False),
        6,
        9,
    ),
    Case(
        "shell flat",
        sheet(CREASED * [1.0, 1.0, 0.0], QUADS, "rolled", dofs=["z", "rx", "ry"]),
        3,
        12,
    ),
    *(
        Case(f"{kind} {mass}", sheet(*solids(kind), kind=kind, dofs="xyz", mass=mass), 6, rank)
        for kind, rank in (("hex8", 24), ("hex20", 60), ("tet10", 30))
        for mass in ("consistent", "lumped")
    ),
)
