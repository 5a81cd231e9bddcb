"""What a table of modes asks of the mesh and of the theory of its lines."""

from __future__ import annotations

from typing import Any

import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.modes.worth import mesh_for
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import Spec
from cvxupdate.study import open_problem
from tests.cases.elements import STEEL, chain, lines, toml
from tests.cases.structures import measured

CHANNELS = [f"n{n}.y" for n in range(1, 12)]
AT = [(0.1 * k, 0.0, 0.0) for k in range(11)]  # m
STOCKY, THICK, SLENDER = 0.08, 0.015, 0.003  # depth, m
SPREAD = 5e-4  # of frequencies


def opened(folder, depth: float, turns: bool = True) -> tuple[Spec, Model]:
    """A free beam, of which sections resist turning or not."""
    section = {"shape": "rectangle", "width": depth, "height": 0.03}
    model: dict[str, Any] = lines("beam2d", AT, chain(10), ["y", "rz"], section, STEEL)
    model["elements"][0]["rotary_inertia"] = turns
    path = folder / "problem.toml"
    path.write_text(f"model = {toml(model)}\n", encoding="utf-8")
    return open_problem(path)[:2]


@pytest.mark.parametrize(
    ("depth", "sought", "words", "stocky"),
    [
        pytest.param(STOCKY, True, ("rotary",), True, id="shear is missed by much"),
        pytest.param(THICK, True, ("rotary",), False, id="shear is an effect that is sought"),
        pytest.param(THICK, False, ("shear", "rotary"), False, id="nobody seeks shear"),
        pytest.param(SLENDER, True, (), False, id="slender"),
    ],
)
def test_what_the_theory_of_lines_leaves_out_is_asked_for_tables_too(
    tmp_path, depth, sought, words, stocky
):
    spec, model = opened(tmp_path, depth)
    mesh = mesh_for(spec, model, 1.1 * model_modes(model, 6).frequencies[5], sought)
    assert not mesh.finer and mesh.theory == words and mesh.stocky == stocky


def test_modes_of_a_program_without_rotary_inertia_lack_nothing(tmp_path):
    """Its sixth mode is 9 % higher; such beams were told to have thicker ends."""
    spec, model = opened(tmp_path, STOCKY)
    euler = opened(tmp_path, STOCKY, turns=False)[1]
    table = measured(euler, (), range(1, 7), channels=CHANNELS, std=SPREAD, shape_std=0.005)
    own = model_modes(model, 8).flexible().frequencies[:6]
    assert table.frequency[5] > 1.05 * own[5], "this is what must not be taken for physics"
    found = diagnose_problem(spec, model, [table])
    assert found.verdict == "consistent", found.says
    assert any("Sections of beams may resist turning or not" in x for x in found.evidence)
