"""Structures for tests of residuals and loops: unequal spans, no symmetry, stiffness, mass *and*
damping parameters.

`structure` gives a model by way of a problem file, with the parsed `Spec`; `measured` simulates a
table of modes of the model at known parameters.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.spec import Spec, load_problem
from tests.cases.elements import STEEL, grid, nodes, toml

DUMMY = [
    {"kind": "modes", "rows": [{"frequency": 1.0}]}
]  # the grammar wants a recording; tests hand over their own


def portal() -> dict[str, Any]:
    """A clamped bent bar in a plane: unequal spans, two sections, a lump, a spring and a dashpot to
    ground; structural loss in all beams."""
    points = [
        (0.0, 0.0, 0.0),
        (0.0, 0.31, 0.0),
        (0.04, 0.72, 0.0),
        (0.33, 0.8, 0.0),
        (0.71, 0.77, 0.0),
        (0.93, 0.42, 0.0),
    ]
    beams = [
        {"id": i + 1, "nodes": [i + 1, i + 2], "section": s, "group": g}
        for i, (s, g) in enumerate(
            zip("aaabb", ("column", "column", "roof", "roof", "arm"), strict=True)
        )
    ]
    return {
        "dofs": ["x", "y", "rz"],
        "nodes": nodes(points),
        "materials": {"steel": STEEL},
        "sections": {
            "a": {"shape": "rectangle", "width": 0.01, "height": 0.03},
            "b": {"shape": "rectangle", "width": 0.008, "height": 0.025},
        },
        "elements": [
            {"type": "beam2d", "material": "steel", "rows": beams},
            {
                "type": "mass",
                "rows": [{"id": 20, "nodes": [4], "m": 0.9, "Izz": 2e-4, "group": "lump"}],
            },
            {
                "type": "spring",
                "dof": "x",
                "rows": [{"id": 30, "nodes": [5], "k": 2.0e5, "group": "tie"}],
            },
            {
                "type": "dashpot",
                "dof": "y",
                "rows": [{"id": 40, "nodes": [3], "c": 12.0, "group": "damper"}],
            },
        ],
        "supports": [{"nodes": [1], "dofs": ["x", "y", "rz"]}],
        "damping": {"kind": "structural", "eta": 0.01},
    }


# every kind of parameter: p-values of stiffness, mass and damping, physical ones, a lump, a spring
PORTAL = (
    {"group": "column", "of": "stiffness"},
    {"group": "roof", "of": "E"},
    {"group": "arm", "of": "stiffness"},
    {"group": "column", "of": "mass"},
    {"group": "lump", "of": "m"},
    {"group": "tie", "of": "k"},
    {"group": "damper", "of": "c"},
)
TRUTH = np.array([0.12, -0.08, 0.1, -0.06, 0.15, 0.2, 0.0])


def free_chain() -> dict[str, Any]:
    """Five unequal masses on a line, joined by unequal springs, free; a support spring of stiffness
    zero at one end."""
    stiffness, masses = (3.1e5, 5.3e5, 2.2e5, 7.1e5), (1.7, 0.9, 2.3, 1.1, 0.6)
    return {
        "dofs": ["x"],
        "nodes": nodes([(x, 0.0, 0.0) for x in (0.0, 0.2, 0.5, 0.6, 1.1)]),
        "elements": [
            {
                "type": "spring",
                "dof": "x",
                "rows": [
                    {"id": i + 1, "nodes": [i + 1, i + 2], "k": k, "group": f"k{i + 1}"}
                    for i, k in enumerate(stiffness)
                ],
            },
            {
                "type": "mass",
                "rows": [
                    {"id": 11 + i, "nodes": [i + 1], "m": m, "group": f"m{i + 1}"}
                    for i, m in enumerate(masses)
                ],
            },
            {
                "type": "spring",
                "dof": "x",
                "rows": [{"id": 31, "nodes": [2], "k": 0.0, "group": "support"}],
            },
        ],
    }


def crossing() -> dict[str, Any]:
    """Two bending planes of one clamped bar: its frequencies in y and z cross when the section's
    rigidities change."""
    points = [(0.0, 0.0, 0.0), (0.21, 0.0, 0.0), (0.5, 0.0, 0.0), (0.6, 0.0, 0.0)]
    return {
        "dofs": ["y", "z", "ry", "rz"],
        "nodes": nodes(points),
        "materials": {"steel": STEEL},
        "sections": {"s": {"shape": "general", "A": 3e-4, "Iy": 2.0e-9, "Iz": 2.3e-9, "J": 1e-9}},
        "elements": [
            {
                "type": "beam3d",
                "material": "steel",
                "section": "s",
                "rows": [{"id": i + 1, "nodes": [i + 1, i + 2], "group": "bar"} for i in range(3)],
            },
            {"type": "mass", "rows": [{"id": 9, "nodes": [3], "m": 0.2}]},
        ],
        "supports": [{"nodes": [1], "dofs": ["y", "z", "ry", "rz"]}],
    }


def square(ratio: float = 1.0) -> dict[str, Any]:
    """A free plate on a 4 × 4 mesh; ``ratio`` 1: square, so many modes come in pairs."""
    lines = np.linspace(0.0, 0.4, 5)
    return grid(lines, ratio * lines)


def structure(
    model: Mapping[str, Any], parameters: Sequence[Mapping[str, Any]], **tables: Any
) -> tuple[Spec, Model]:
    """The problem of a model and its parameters; ``update`` = {…} adds to the [update] table, other
    tables as in a problem file."""
    update = {"method": "frequencies", "parameters": list(parameters), **tables.pop("update", {})}
    text = {"model": model, "recordings": DUMMY, "update": update, **tables}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.toml"
        path.write_text(
            "\n".join(f"{key} = {toml(value)}" for key, value in text.items()) + "\n",
            encoding="utf-8",
        )
        spec = load_problem(path)
        return spec, build_model(spec)


def measured(
    model: Model,
    p: Any,
    modes: Sequence[int],
    *,
    channels: Sequence[str] = (),
    std: float = 1e-3,
    noise: int | None = None,
    pairs: Sequence[int] = (),
    use: str = "fit",
    shape_std: float = 0.01,
    relative_only: bool = False,
) -> ModeTable:
    """Flexible ``modes`` (from 1) of ``model`` at ``p``: ``std`` relative deviation of the
    frequencies, ``noise`` a seed (None: exact).

    ``channels`` are labels such as "n4.x" at which shapes are known; shapes are scaled to a largest
    entry of ±1 and ``shape_std`` is absolute.
    """
    flexible = model_modes(model, max(modes), np.asarray(p, dtype=float)).flexible()
    at = np.array(modes) - 1
    f = flexible.frequencies[at]
    shapes = (
        np.array([flexible.shapes[[model.place[c] for c in channels], i] for i in at])
        if channels
        else None
    )
    if shapes is not None:
        shapes = shapes / np.abs(shapes).max(axis=1, keepdims=True)
    rng = np.random.default_rng(0 if noise is None else noise)
    scatter = 0.0 if noise is None else 1.0
    deviation = std * f
    f = f + scatter * deviation * rng.standard_normal(len(f))
    if shapes is not None:
        shapes = shapes + scatter * shape_std * rng.standard_normal(shapes.shape)
    unknown = np.full(len(f), np.nan)
    places = tuple(
        Channel(int(c.split(".")[0][1:]), c.split(".")[1], "displacement") for c in channels
    )
    return ModeTable(
        Origin(use, f"simulated {use}", use),
        f,
        deviation,
        unknown,
        unknown,
        places,
        shapes,
        None if shapes is None else np.full(shapes.shape, shape_std),
        np.array(pairs or [0] * len(f), dtype=np.int64),
        relative_only,
    )
