"""Exact members in a diagnosis: divided as the band asks, everything else left as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cvxupdate.diagnose.nominal import members
from cvxupdate.diagnose.nominal.members import divided
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.settings import EXACT_MESH
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import FrequencyResponse, Origin
from cvxupdate.spec import Spec
from cvxupdate.study import open_problem
from tests.cases.elements import STEEL, chain, lines, toml

BENT = [(0.0, 0.0, 0.0), (0.0, 0.62, 0.0), (0.81, 0.7, 0.0), (0.9, 0.1, 0.0)]
BAR = {"shape": "rectangle", "width": 0.012, "height": 0.02}


def text(kind: str) -> dict[str, Any]:
    """A portal clamped at both feet, with a lump on its roof."""
    model = lines(kind, BENT, chain(3), ["x", "y", "rz"], BAR, STEEL)
    for row in model["elements"][0]["rows"][1:]:
        del row["group"]
    model["elements"].append({"type": "mass", "rows": [{"id": 9, "nodes": [3], "m": 0.4}]})
    model["supports"] = [{"nodes": [1, 4], "dofs": ["x", "y", "rz"]}]
    return model


def opened(folder: Path, model: dict[str, Any]) -> tuple[Spec, Model]:
    path = folder / "problem.toml"
    path.write_text(f"model = {toml(model)}\n", encoding="utf-8")
    return open_problem(path)[:2]


def recording(top: float) -> FrequencyResponse:
    line = np.linspace(5.0, top, 50)
    return FrequencyResponse(Origin("r", "r"), line, np.ones((50, 1, 1)), "displacement", (), ())


@pytest.mark.parametrize("top", [60.0, 300.0])
def test_as_many_parts_as_the_band_asks(tmp_path: Path, top: float) -> None:
    spec, model = opened(tmp_path, text("exact_beam"))
    found = divided(spec, model, [recording(top)])
    assert found is not None and found.off <= EXACT_MESH
    exact = model_modes(model, 12).frequencies
    mesh = model_modes(found.model, 12).frequencies
    band = exact <= top
    assert np.abs(mesh / exact - 1.0)[band].max() <= EXACT_MESH
    assert not found.model.exact
    assert f"divided into {found.parts} beams" in found.says


def test_more_parts_for_a_wider_band(tmp_path: Path) -> None:
    spec, model = opened(tmp_path, text("exact_beam"))
    low, high = (divided(spec, model, [recording(top)]) for top in (60.0, 400.0))
    assert low is not None and high is not None and low.parts < high.parts
    assert high.model.size == 3 * (3 * high.parts - 1)
    beams, lump = high.spec.model.elements
    assert beams.type == "beam3d" and len(beams.rows) == 3 * high.parts
    assert {row.group for row in beams.rows} == {"even", "exact member 2", "exact member 3"}
    assert lump == spec.model.elements[1]


def test_members_without_a_group_scatter_together_as_beams_do(tmp_path: Path) -> None:
    """One by one they would take up what is missing at a node between them."""
    spec, model = opened(tmp_path, text("exact_beam"))
    found = divided(spec, model, [recording(60.0)])
    mesh = with_nuisance(opened(tmp_path, text("beam3d"))[1])
    assert found is not None
    names = [q.name for q in with_nuisance(found.model).parameters]
    assert names == [q.name for q in mesh.parameters]
    assert names == ["even.stiffness", "beam3d.stiffness", "even.mass", "beam3d.mass", "mass.mass"]


def test_a_meshed_model_stays_as_it_is(tmp_path: Path) -> None:
    spec, model = opened(tmp_path, text("beam2d"))
    assert divided(spec, model, [recording(60.0)]) is None


def test_where_no_division_is_enough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(members, "EXACT_MESH", 1e-14)
    spec, model = opened(tmp_path, text("exact_beam"))
    with pytest.raises(InputError, match="more than 32 parts"):
        divided(spec, model, [recording(60.0)])
