"""Beams of elements too short for the file's mesh, were they to deform in shear; rods too few."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.nominal.mesh import mesh_error
from cvxupdate.diagnose.responses.worth import _coarse_rods, _short
from cvxupdate.diagnose.settings import RESPONSE_DISCREPANCY, UNEXPLAINED
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import load_problem
from tests.cases.chain import BAR


def text(depth: float) -> str:
    """As wide as deep."""
    return BAR.replace("height = 0.008", f"height = {depth}").replace("0.04", f"{depth}")


def bar(folder, depth: float):
    path = folder / f"{depth}.toml"
    path.write_text(text(depth), encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


@pytest.mark.parametrize(("depth", "short"), [(0.06, True), (0.008, False)])
def test_short_elements_want_a_finer_mesh_where_shear_may_be_told(tmp_path, depth, short):
    """By what extrapolation may miss, in half-power bandwidths: with heavy damping it is lost."""
    spec, model = bar(tmp_path, depth)
    top = 1.1 * model_modes(model, 6).flexible().frequencies[3]
    missed = mesh_error(spec, model, top, sheared=True).missed(top)
    assert _short(spec, model, top, 0.5 * missed / UNEXPLAINED) == short
    assert not _short(spec, model, top, 2.0 * missed / UNEXPLAINED)


@pytest.mark.parametrize(("kind", "wants"), [("rod", True), ("beam3d", False)])
def test_rods_want_a_finer_mesh_where_extrapolation_may_miss_what_is_heard(tmp_path, kind, wants):
    path = tmp_path / "problem.toml"
    along = text(0.03).replace('dofs = ["z", "ry"]', 'dofs = ["x", "z", "ry"]', 1)
    if kind == "rod":
        along = text(0.03).replace('["z", "ry"]', '["x"]').replace("beam3d", "rod")
        along = along.replace('dofs = ["z"]', 'dofs = ["x"]')
    path.write_text(along, encoding="utf-8")
    spec = load_problem(path)
    model = build_model(spec)
    top = 1.1 * model_modes(model, 4).flexible().frequencies[2]
    missed = mesh_error(spec, model, top).missed(top)
    assert _coarse_rods(spec, model, top, 0.5 * missed / RESPONSE_DISCREPANCY) == wants
    assert not _coarse_rods(spec, model, top, 2.0 * missed / RESPONSE_DISCREPANCY)
