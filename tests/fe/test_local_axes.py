"""The table of local axes in docs/problem-files.md: along which way a flat bar is soft."""

import numpy as np
import pytest

from cvxupdate import Model

SPACE = ("x", "y", "z", "rx", "ry", "rz")
SOFT, STIFF = 10.44, 52.19  # Hz: 0.8 m of steel, 40 × 8 mm, clamped, about either axis


def first(kind: str, dofs: tuple[str, ...], end: tuple[float, ...], **row) -> tuple[str, float]:
    """Along which way the tip moves in the first mode, and its frequency; width 8, height 40 mm."""
    nodes = [dict(zip("xyz", np.array(end) * k / 10, strict=True)) | {"id": k} for k in range(11)]
    rows = [{"id": k + 1, "nodes": [k, k + 1], **row} for k in range(10)]
    block = {"type": kind, "material": "steel", "section": "bar", "rows": rows}
    table = {
        "dofs": list(dofs),
        "nodes": nodes,
        "materials": {"steel": {"E": 2.1e11, "rho": 7850.0}},
        "sections": {"bar": {"shape": "rectangle", "width": 0.008, "height": 0.04}},
        "supports": [{"nodes": [0], "dofs": list(dofs)}],
        "elements": [block],
    }
    modes = Model.from_problem({"model": table}).modes(1)
    at = [label for label in modes.labels if label in ("n10.x", "n10.y", "n10.z")]
    tip = modes.at(at)
    return at[int(np.argmax(np.abs(tip.shapes)))][-1], float(modes.frequencies[0])


@pytest.mark.parametrize(
    ("kind", "dofs", "end", "row", "way", "f"),
    [
        ("beam2d", ("x", "y", "rz"), (0.8, 0, 0), {}, "y", SOFT),
        ("beam2d", ("x", "y", "rz"), (0, 0.8, 0), {}, "x", SOFT),
        ("beam2d", ("x", "y", "rz"), (0.8, 0, 0), {"orientation": [0, 1, 0]}, "y", SOFT),
        ("beam2d", ("x", "z", "ry"), (0.8, 0, 0), {}, "z", STIFF),
        ("beam3d", SPACE, (0.8, 0, 0), {}, "y", SOFT),
        ("beam3d", SPACE, (0, 0.8, 0), {}, "x", SOFT),
        ("beam3d", SPACE, (0, 0, 0.8), {}, "y", SOFT),
        ("beam3d", SPACE, (0, 0, -0.8), {}, "y", SOFT),
        ("beam3d", SPACE, (0.8, 0, 0), {"orientation": [0, 1, 0]}, "z", SOFT),
        ("beam3d", SPACE, (0, 0, 0.8), {"orientation": [0, 1, 0]}, "x", SOFT),
    ],
)
def test_a_flat_bar_is_soft_along_local_y(kind, dofs, end, row, way, f):
    assert first(kind, dofs, end, **row) == (way, pytest.approx(f, rel=2e-3))
