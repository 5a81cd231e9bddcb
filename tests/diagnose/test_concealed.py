"""The command on a concealed case, and that the truth beside them is never opened."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CASES = ROOT / "problems" / "concealed"


def command(*arguments, cwd):
    return subprocess.run(
        [Path(sys.executable).parent / "cvxupdate", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_the_package_does_not_know_of_truth():
    for path in (ROOT / "cvxupdate").rglob("*.py"):
        assert "truth.toml" not in path.read_text(encoding="utf-8"), path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "physics", "nodes", "name", "value"),
    [("o05", "grounding_spring", [1], "k", 3500.0)],
)
def test_concealed_cases(tmp_path, case, physics, nodes, name, value):
    """Also without truth.toml beside the problem: there is nothing to peep at."""
    shutil.copytree(CASES / case, tmp_path / case, ignore=shutil.ignore_patterns("truth.toml"))
    done = command("diagnose", f"{case}/problem.toml", "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    data = json.loads(done.stdout)
    assert data["verdict"] == "missing_physics"
    first = data["findings"][0]
    assert first["physics"] == physics and first["location"]["nodes"] == nodes
    assert first["parameters"][name] == pytest.approx(value, rel=0.25)
    assert data["fit"]["hold_out"]["after"] <= 0.5 * data["fit"]["hold_out"]["before"]
    assert sorted(p.name for p in (tmp_path / "out" / case / "diagnose").iterdir()) == [
        "diagnosis.json",
        "report.html",
        "updated",
    ]
    check = command("check", f"out/{case}/diagnose/updated/problem.toml", cwd=tmp_path)
    assert check.returncode == 0, check.stderr


def test_bad_input_writes_nothing(tmp_path):
    (tmp_path / "problem.toml").write_text("[model]\n", encoding="utf-8")
    done = command("diagnose", "problem.toml", cwd=tmp_path)
    assert (
        done.returncode == 2
        and done.stderr.startswith("cvxupdate: ")
        and "Traceback" not in done.stderr
    )
    assert [p.name for p in tmp_path.iterdir()] == ["problem.toml"]
