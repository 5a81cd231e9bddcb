"""Records that begin in motion, through the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cvxupdate.cli import app
from tests.cases.in_motion import MODEL, RATE, STATE, history

CHANNELS = """channels = [
  { column = 0, quantity = "force", node = 3, dof = "x" },
  { column = 1, quantity = "acceleration", node = 1, dof = "x" },
  { column = 2, quantity = "acceleration", node = 2, dof = "x" },
  { column = 3, quantity = "acceleration", node = 3, dof = "x" },
]
"""


def test_a_softer_spring_is_found_though_nothing_began_at_rest(tmp_path: Path) -> None:
    text = MODEL
    for seed, use in ((1, "fit"), (2, "hold-out")):
        run = history(tuple((3 - 2 * seed) * x for x in STATE), 0.7, seed=seed)
        np.savetxt(tmp_path / f"{use}.csv", run.data, delimiter=",", fmt="%.8g")
        text += f'[[recordings]]\nkind = "time"\nuse = "{use}"\nrate = {RATE}\n'
        text += f'file = "{use}.csv"\n{CHANNELS}'
    (tmp_path / "problem.toml").write_text(text)
    out = tmp_path / "out"
    ran = CliRunner().invoke(app, ["diagnose", str(tmp_path / "problem.toml"), "--out", str(out)])
    assert ran.exit_code == 0, ran.output
    found = json.loads((out / "diagnosis.json").read_text())
    assert sum("begins in motion" in w["says"] for w in found["warnings"]) == 2
    (first,) = found["findings"]
    assert first["physics"] == "stiffness_change" and first["location"]["groups"] == ["middle"]
    assert first["parameters"]["factor"] == pytest.approx(0.7, abs=0.02)
    assert first["confidence"] >= 0.5 and found["fit"]["hold_out"]["after"] < 0.05
