"""Structures driven by a motion, through the command line: transmissibilities and a record of a
shaking table, computed by exact partition, with something concealed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cvxupdate.cli import app
from cvxupdate.study import diagnose
from tests.cases.shaking_table import tower, transmissibilities

PLATFORMS = (2, 3, 4, 5, 6, 7)
NOISE = 0.01
ETA = 0.02  # of the tower, as a loss factor
TRIED = ("stiffness_change", "mass_change", "added_mass", "joint_flexibility", "grounding_spring")
"""Some of the catalogue, for time."""


def shaken(
    folder: Path, softer: float, top: float = 130.0, seen: Sequence[int] = PLATFORMS
) -> Path:
    """A problem file of the tower as drawn, with transmissibilities of the real one up to ``top``
    Hz at the nodes ``seen``."""
    f, text = np.linspace(2.0, top, 640), tower()
    exact = transmissibilities(2j * np.pi * f, softer, tower, (1,), seen)
    for seed, use in enumerate(("fit", "hold-out")):
        rng, size = np.random.default_rng([14, seed]), NOISE * np.abs(exact)
        noise = rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape)
        np.savez(
            folder / f"{use}.npz",
            frequency=f,
            H=(exact + size * noise / np.sqrt(2.0))[:, :, None],
            variance=(size**2)[:, :, None],
            response_node=np.array(seen),
            response_dof=np.ones(len(seen)),
        )
        text += f"""[[recordings]]
kind = "frf"
use = "{use}"
file = "{use}.npz"
response = "acceleration"
references = [{{ node = 1, dof = "x", quantity = "acceleration" }}]
"""
    text += f"[diagnose]\nphysics = {list(TRIED)}\n"
    path = folder / "problem.toml"
    path.write_text(text)
    return path


@pytest.mark.slow
def test_a_softer_storey_is_found_on_a_shaking_table(tmp_path: Path) -> None:
    path, out = shaken(tmp_path, 0.7), tmp_path / "out"
    ran = CliRunner().invoke(app, ["diagnose", str(path), "--out", str(out)])
    assert ran.exit_code == 0, ran.output
    found = json.loads((out / "diagnosis.json").read_text())
    (first,) = found["findings"]
    assert found["verdict"] in ("missing_physics", "parameter_error")
    assert first["physics"] == "stiffness_change" and first["confidence"] >= 0.5
    assert first["location"]["groups"] == ["storey 2"]
    assert first["parameters"]["factor"] == pytest.approx(0.7, abs=0.02)
    assert found["fit"]["hold_out"]["after"] < 0.1 * found["fit"]["hold_out"]["before"]
    updated = out / "updated" / "problem.toml"
    assert "[[model.bases]]" in updated.read_text()
    again = CliRunner().invoke(app, ["correlate", str(updated), "--out", str(tmp_path / "again")])
    assert again.exit_code == 0, again.output
    fit = json.loads((tmp_path / "again" / "result.json").read_text())["fit"]["fit"]
    after = found["fit"]["fit"]["after"]
    assert after < 1.05 * NOISE and "hysteretic = " in updated.read_text()
    # the file has the mesh's shift of 0.011 % again: so much of half the width of a resonance
    shift = np.sqrt(max(0.0, fit["frf_error"]["before"] ** 2 - after**2))
    assert shift < 1.1e-4 / (ETA / 2.0)


def test_few_points_over_two_modes_tell_it_too(tmp_path: Path) -> None:
    """What the fit leaves is noise: the tower has a loss factor, which no viscous damping fits."""
    found = diagnose(shaken(tmp_path, 0.8, 80.0, (3, 5, 7)))
    (first,) = found.findings
    assert first.physics == "stiffness_change" and first.place.groups == ("storey 2",)
    assert first.parameters["factor"] == pytest.approx(0.8, abs=0.02) and first.confidence >= 0.5
    assert found.fit["hold_out"]["after"] < 1.2 * NOISE
