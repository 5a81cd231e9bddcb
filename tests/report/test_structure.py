"""Sheets and solids in figures: what is drawn of them, and nodal lines over triangles."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from cvxupdate.correlate.compare import geometry_of
from cvxupdate.correlate.result import Geometry
from cvxupdate.fe.build import build_model
from cvxupdate.report.diagnosis_places import sketch_of
from cvxupdate.report.structure import nodal_lines, skeleton
from cvxupdate.report.views import view_of
from cvxupdate.spec import Spec, load_problem
from tests.cases.elements import SPACE, halved, sheet, solids, squares, toml


def read(folder: Path, model: dict[str, object]) -> tuple[Spec, Geometry]:
    path = folder / "problem.toml"
    path.write_text(f"model = {toml(model)}\n", encoding="utf-8")
    spec = load_problem(path)
    geometry = geometry_of(spec, build_model(spec))
    assert geometry is not None
    return spec, geometry


def test_nodal_lines_run_over_triangles_and_quadrilaterals_alike(tmp_path: Path) -> None:
    """w = x − 0.3: one straight nodal line there, whatever the cells."""
    points, cells = squares(4, 3, 0.2)
    xyz = np.column_stack([points, np.zeros(len(points))])
    mixed = [*cells[:6], *halved(cells[6:])]
    _, geometry = read(tmp_path, sheet(xyz, mixed, dofs=["z", "rx", "ry"]))
    ax = Figure().add_subplot()
    nodal_lines(ax, geometry, geometry.xyz[:, 0] - 0.3)
    line = np.vstack([v for p in ax.collections[-1].get_paths() for v in [p.vertices] if len(v)])
    assert np.allclose(line[:, 0], 0.3)
    assert np.ptp(line[:, 1]) > 0.999


def test_shells_are_drawn_as_they_stand(tmp_path: Path) -> None:
    points, cells = squares(2, 2)
    xyz = np.column_stack([points, 0.3 * points[:, 0] ** 2])
    spec, geometry = read(tmp_path, sheet(xyz, halved(cells), dofs=SPACE))
    assert [len(p.nodes) for p in geometry.parts] == [3] * 8
    ax = Figure().add_subplot()
    skeleton(ax, geometry, view_of(geometry.xyz, np.array([True] * 3)), {1: 1.0})
    assert len(ax.collections[0].get_paths()) == 8
    sketch = sketch_of(spec)
    assert sketch is not None and [p.nodes for p in sketch.parts] == [
        p.nodes for p in geometry.parts
    ]


def test_solids_show_their_outside(tmp_path: Path) -> None:
    """Two bricks that share a face have ten others; six tetrahedra around a diagonal, twelve."""
    for kind, count, corners in (("hex8", 10, 4), ("hex20", 10, 4), ("tet10", 12, 3)):
        points, cells = solids(kind)
        spec, geometry = read(tmp_path, sheet(points, cells, kind=kind, dofs="xyz"))
        assert [len(p.nodes) for p in geometry.parts] == [corners] * count
        sketch = sketch_of(spec)
        assert sketch is not None and {p.id for p in sketch.parts} == {
            row.id for block in spec.model.elements for row in block.rows
        }
