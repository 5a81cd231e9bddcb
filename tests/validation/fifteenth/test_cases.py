"""Cases of the fifteenth laboratory: what is kept of them is what it writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.study import open_problem
from validation.fifteenth.__main__ import main
from validation.fifteenth.cases import every_case

KEPT = Path(__file__).resolve().parents[3] / "problems" / "strange" / "fifteenth"


@pytest.mark.parametrize("name", ["f09_stands", "m08_storeys"])
def test_a_kept_case_is_written_again(tmp_path: Path, name: str) -> None:
    assert main([str(tmp_path), name]) == 0
    for path in sorted((KEPT / name).iterdir()):
        again = tmp_path / name / path.name
        if path.suffix == ".npz":
            kept, new = np.load(path), np.load(again)
            assert set(kept) == set(new)
            for key in ("frequency", "H", "coherence"):
                np.testing.assert_allclose(new[key], kept[key], rtol=1e-6, atol=1e-9)
        elif path.name == "problem.toml":
            assert again.read_text(encoding="utf-8") == path.read_text(encoding="utf-8")
    spec, model, recordings = open_problem(tmp_path / name / "problem.toml")
    assert model.size > 0 and recordings and spec.recordings


def test_what_is_not_known_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "out"), "f99"]) == 2
    assert "no case is called f99. Cases: f01_portal" in capsys.readouterr().err
    assert main([]) == 2
    assert not (tmp_path / "out").exists()


def test_there_are_twenty_four_and_a_third_conceals_nothing() -> None:
    cases = every_case()
    assert len({case.name for case in cases}) == 24
    assert sum(not case.concealed for case in cases) == 8
