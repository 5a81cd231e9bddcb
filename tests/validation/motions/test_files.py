"""The files of a case."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from validation.motions import files
from validation.motions.cases import draw

SEED = 203  # a softening spring that lets go of its cantilever at the level drawn


def test_where_nothing_holds_a_structure_the_level_is_halved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn, wrote = draw(SEED), []

    def write(case: files.Case, folder: Path) -> None:
        wrote.append(case)
        if len(wrote) < 3:
            raise FloatingPointError("the motion grows beyond bounds")

    monkeypatch.setattr(files, "write", write)
    made = files.make(SEED, tmp_path)
    for own, run in zip(made.runs, drawn.runs, strict=True):
        np.testing.assert_allclose(own.force, 0.25 * run.force)
        assert (own.level, own.use) == (run.level, run.use)


def test_what_no_level_keeps_standing_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(case: files.Case, folder: Path) -> None:
        raise FloatingPointError("the motion grows beyond bounds")

    monkeypatch.setattr(files, "write", write)
    with pytest.raises(FloatingPointError, match="beyond bounds"):
        files.make(SEED, tmp_path)
