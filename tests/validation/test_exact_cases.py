"""One exact member for every straight run of beams: the same structure, without its mesh."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import read_text
from cvxupdate.spec.write import to_toml
from cvxupdate.study import open_problem
from validation.exact_cases import AT, DRIVE, SENSORS, bay, with_exact


def test_the_bay_with_exact_members_is_the_bay(tmp_path: Path) -> None:
    """Twenty beams become twelve members, between corners, junctions and sensors; frequencies are
    those of the mesh to within its error."""
    path = bay(tmp_path)
    _, mesh, recordings = open_problem(path)
    assert [r.origin.use for r in recordings] == ["fit", "hold-out"]
    tables = tomllib.loads(path.read_text(encoding="utf-8"))["model"]
    text = to_toml({"model": with_exact(tables, {*SENSORS, DRIVE, AT})})
    exact = build_model(read_text(text, tmp_path / "exact.toml"))
    assert sum(len(b.ids) for b in exact.blocks) == 12 < sum(len(b.ids) for b in mesh.blocks)
    ours, theirs = (model_modes(m, 14).flexible().frequencies[:4] for m in (exact, mesh))
    np.testing.assert_allclose(theirs, ours, rtol=2e-3)
    assert np.all(theirs > 0.9999 * ours)  # a mesh is too stiff
