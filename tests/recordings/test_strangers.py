"""Tables of modes as strangers wrote them (tests/strangers/portal), and the responses beside their
own matrices."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.recordings.types import ModeTable
from cvxupdate.study import open_problem

PORTAL = Path(__file__).resolve().parents[1] / "strangers" / "portal"


def table(folder: Path, name: str, text: str | None = None) -> ModeTable:
    """The table of the portal's problem with another file in place of modes.csv."""
    for part in ("nodes.csv", "beams.csv", "modes.csv", "export.csv"):
        shutil.copy(PORTAL / part, folder / part)
    if text is not None:
        (folder / name).write_text(text, encoding="utf-8")
    problem = (PORTAL / "problem.toml").read_text(encoding="utf-8")
    path = folder / "problem.toml"
    path.write_text(problem.replace('"modes.csv"', f'"{name}"'), encoding="utf-8")
    (found,) = open_problem(path)[2]
    assert isinstance(found, ModeTable)
    return found


def test_a_table_with_a_column_for_each_sensor_is_the_same_table(tmp_path: Path) -> None:
    """``mode, frequency_Hz, damping_pct, 4:+X, …``: frequencies, shapes, damping in per cent."""
    own, export = table(tmp_path, "modes.csv"), table(tmp_path, "export.csv")
    assert np.allclose(export.frequency, own.frequency, rtol=1e-12)
    assert np.allclose(export.shapes, own.shapes, atol=1e-12)
    assert np.allclose(export.damping, 0.009, rtol=1e-12) and own.damping[0] == 0.0088


def test_decimal_commas(tmp_path: Path) -> None:
    found = table(tmp_path, "comma.csv", "frequency;shape\n19,7;0,1 0,2 0 0 0 0 0 0\n")
    assert found.frequency.tolist() == [19.7] and found.shapes[0, :3].tolist() == [0.1, 0.2, 0.0]


def test_a_shape_that_is_too_short_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 2, column shape: has 2 entries for 8 channels"):
        table(tmp_path, "short.csv", "frequency,shape\n19.7,0.1 0.2\n")
