"""Method rfm with weights taken anew at every step."""

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.study import run
from tests.cases.problems import to_toml

SHARED = Path(__file__).resolve().parents[2] / "problems" / "generic"


def problem(folder: Path, **update: object) -> Path:
    """The beam of 7.7.2A with other settings."""
    text = (SHARED / "beam_a" / "problem.toml").read_text(encoding="utf-8")
    for name in ("beam_a.toml",):
        text = text.replace(f"../{name}", (SHARED / name).as_posix())
    for name in ("fit.npz", "other.npz"):
        text = text.replace(f'"{name}"', f'"{(SHARED / "beam_a" / name).as_posix()}"')
    lines = [
        row for row in text.splitlines() if row.split(" = ")[0] not in update and "noise" not in row
    ]
    at = lines.index('method = "rfm"') + 1
    lines[at:at] = [*to_toml(update).splitlines(), "noise = 0.001"]
    path = folder / "problem.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_it_ends_where_converged_weights_do(tmp_path: Path) -> None:
    """Without the band, and with a trust region that has to shrink first."""
    step = run(problem(tmp_path, begin_with="all", tolerance=1e-6))
    both = run(problem(tmp_path, begin_with="all", reweight="converged", tolerance=1e-6))
    assert step.status == both.status == "converged"
    np.testing.assert_allclose(
        [q.p for q in step.parameters], [q.p for q in both.parameters], atol=1e-5
    )
    assert [h["number"] for h in step.history] == list(range(1, step.iterations + 1))


def test_the_limit_is_said(tmp_path: Path) -> None:
    found = run(problem(tmp_path, max_iterations=1))
    assert found.status == "stopped" and found.iterations == 1
    assert "limit of 1 iter" in found.reason


def test_other_residuals_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="reweight"):
        run(problem(tmp_path, residual="auto"))
