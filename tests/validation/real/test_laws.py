"""Real parts and circuits whose force is no linear one."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.spec import load_problem
from cvxupdate.study import diagnose
from validation.real import laws

ROOT = Path(__file__).resolve().parents[3]
TRUTH = tomllib.loads((ROOT / "problems" / "real" / "truth.toml").read_text(encoding="utf-8"))
DATA = os.environ.get("CVXUPDATE_DATA")
needs_damper = pytest.mark.skipif(
    DATA is None or not (Path(DATA) / laws.DAMPER).is_dir(),
    reason=f"the data set {laws.DAMPER} is not under CVXUPDATE_DATA",
)


@needs_damper
def test_each_run_of_the_damper_is_a_problem_with_the_other_rate_held_out() -> None:
    spec = load_problem(laws.damper_run(25, "1Hz", "0.5Hz"))
    assert [(r.use, Path(str(r.file)).name) for r in spec.recordings] == [
        ("fit", "ds1_1Hz_25lb.json"),
        ("hold-out", "ds1_0.5Hz_25lb.json"),
    ]
    assert len(TRUTH["damper"]["tensions"]) == len(TRUTH["damper"]["plateaus"])


def test_nothing_written_is_no_free_run(tmp_path: Path) -> None:
    assert np.isnan(laws.free_run(tmp_path / "problem.toml", tmp_path))


@needs_damper
def test_the_damper_rubs_and_has_free_play() -> None:
    """Its plateau and its travel are the README's; at the other rate half of the error is gone."""
    said = diagnose(laws.damper_run(70, "1Hz", "0.5Hz"))
    found = {f.physics: f.parameters for f in said.findings}
    known = TRUTH["damper"]
    plateau = dict(zip(known["tensions"], known["plateaus"], strict=True))[70]
    assert found["dry_friction"]["force"] / laws.KIP == pytest.approx(plateau, rel=known["within"])
    low, high = known["travel"]
    assert low <= found["clearance"]["gap"] / laws.INCH <= high
    assert said.fit["hold_out"]["after"] <= 0.5 * said.fit["hold_out"]["before"]
