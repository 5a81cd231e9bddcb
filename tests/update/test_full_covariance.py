"""Methods on tables with a full covariance: generalised least squares and Bayes' rule in closed
form, what is refused, and the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cvxupdate
from cvxupdate.cli import main
from cvxupdate.errors import InputError
from cvxupdate.recordings.types import ModeTable
from cvxupdate.study import run
from cvxupdate.update.modal import update_modal
from cvxupdate.update.modal_fit import modal_fit
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

PRIOR = 0.08
ALL = (
    {"groups": ["column", "roof", "arm"], "of": "stiffness", "name": "all"},
    {"group": "tie", "of": "k", "name": "tie"},
)
CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")


def correlated(table: ModeTable, rho: float = 0.85) -> ModeTable:
    """Errors of the frequencies that go together, as those of a temperature do."""
    n, std = len(table.frequency), table.frequency_std
    return replace(
        table, covariance=np.outer(std, std) * (rho + (1.0 - rho) * np.eye(n)), relative_only=False
    )


def linear(method: str, prior: bool) -> Any:
    """Every eigenvalue is proportional to the one stiffness of all."""
    known = [{"kind": "prior", "deviation": PRIOR}] if prior else []
    return structure(
        portal(),
        ALL,
        update={"method": method, "tolerance": 1e-14},
        constraints={"tied": [{"parameters": ["all", "tie"]}]},
        regularisation=known,
    )


@pytest.mark.parametrize(
    ("method", "prior"), [("frequencies", False), ("frequencies", True), ("minimum-variance", True)]
)
def test_generalised_least_squares(method: str, prior: bool) -> None:
    """p = (SᵀV⁻¹S + 1/σ²)⁻¹ SᵀV⁻¹y, and its deviation; far from what the deviations alone say."""
    case = linear(method, prior)
    plain = measured(case[1], [0.1, 0.1], [1, 2, 3, 5], std=0.03, noise=5)
    plain = replace(plain, frequency_std=plain.frequency_std * [1.0, 0.3, 2.0, 1.0])
    table = correlated(plain)
    base = measured(case[1], [0.0, 0.0], [1, 2, 3, 5]).frequency
    S = (2 * np.pi * base) ** 2
    y = (2 * np.pi * table.frequency) ** 2 - S
    rate = 8 * np.pi**2 * table.frequency
    assert table.covariance is not None
    W = np.linalg.inv(table.covariance * np.outer(rate, rate))
    before = 2.0 / PRIOR**2 if prior else 0.0  # two parameters that are one
    p = S @ W @ y / (S @ W @ S + before)
    found = update_modal(*case, [table])
    assert [q.p for q in found.parameters] == pytest.approx([p, p], rel=1e-6)
    other = update_modal(*case, [plain])
    assert abs(other.parameters[0].p - p) > 0.003
    noise = np.sqrt(max((y - S * p) @ W @ (y - S * p) / 3.0, 0.0))
    if noise < 1.5 and method == "minimum-variance":
        wanted = (S @ W @ S + before) ** -0.5
        assert found.parameters[0].p_std == pytest.approx(wanted, rel=1e-6)
    assert any("correlations included" in note for note in found.notes)
    assert not any("correlations included" in note for note in other.notes)


def test_a_table_of_independent_errors_is_fitted_as_by_its_deviations() -> None:
    case = structure(
        portal(),
        PORTAL[:3],
        update={"method": "sensitivity"},
        constraints={"bounds": {"lower": -0.5, "upper": 0.5}},
    )
    model = case[1]
    table = measured(model, TRUTH[:3], [1, 2, 3, 4], channels=CHANNELS, noise=2, shape_std=0.02)
    assert table.shapes is not None and table.shape_std is not None
    spread = np.broadcast_to(table.shape_std, table.shapes.shape).ravel()
    C = np.diag(np.concatenate([table.frequency_std, spread]) ** 2)
    one, other = (update_modal(*case, [t]) for t in (table, replace(table, covariance=C)))
    for a, b in zip(one.parameters, other.parameters, strict=True):
        assert b.p == pytest.approx(a.p, abs=1e-6) and b.p_std == pytest.approx(a.p_std, rel=1e-5)


def test_an_error_that_three_modes_share_is_seen_as_one() -> None:
    """Of one session, another temperature than the rest: what these three say of one another is
    worth more than by the deviations alone, and the estimate scatters less."""
    case = structure(portal(), PORTAL[:2], update={"method": "frequencies"})
    exact = measured(case[1], TRUTH[:2], [1, 2, 3, 4, 5], std=2e-4)
    rng, ends = np.random.default_rng(1), {True: [], False: []}
    common = 0.004 * exact.frequency * [1.0, 1.0, 1.0, 0.0, 0.0]
    C = np.diag(exact.frequency_std**2) + np.outer(common, common)
    for _ in range(20):
        e = exact.frequency_std * rng.standard_normal(5) + common * rng.standard_normal()
        table = replace(
            exact, frequency=exact.frequency + e, frequency_std=np.sqrt(np.diag(C)), covariance=C
        )
        for full in (True, False):
            given = table if full else replace(table, covariance=None)
            found = update_modal(*case, [given]).parameters
            ends[full].append(found[0].p - found[1].p - (TRUTH[0] - TRUTH[1]))
    assert np.std(ends[True]) < 0.8 * np.std(ends[False])


def test_what_it_does_not_go_with() -> None:
    for update, words in (
        ({"method": "frequencies", "pairing": "misfit"}, "weighs modes one by one"),
        ({"method": "sensitivity", "shape_residual": "mac"}, "does not move it|do not move it"),
    ):
        case = structure(portal(), PORTAL, update=update)
        table = measured(case[1], TRUTH, [1, 2], channels=CHANNELS)
        C = np.diag(np.concatenate([table.frequency_std, np.full(12, 0.01)]) ** 2)
        with pytest.raises(InputError, match=words):
            modal_fit(*case, [replace(table, covariance=C)])


PROBLEM = """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1, 2], k = 1000.0 }, { id = 2, nodes = [2, 3], k = 1000.0 }]
[[model.elements]]
type = "mass"
rows = [{ id = 3, nodes = [2], m = 1.0 }, { id = 4, nodes = [3], m = 1.3 }]
[[model.supports]]
nodes = [1]
dofs = ["x"]
[[recordings]]
kind = "modes"
rows = [{ frequency = 3.0 }, { frequency = 7.9 }]
covariance = "V.csv"
[update]
method = "METHOD"
parameters = [{ elements = "all", of = "stiffness" }]
"""


def written(folder: Path, method: str) -> Path:
    np.savetxt(folder / "V.csv", [[1e-3, 9e-4], [9e-4, 4e-3]], delimiter=",")
    path = folder / "problem.toml"
    path.write_text(PROBLEM.replace("METHOD", method), encoding="utf-8")
    return path


def test_the_command_and_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = written(tmp_path, "frequencies"), tmp_path / "out"
    monkeypatch.setattr("sys.argv", ["cvxupdate", "run", str(path), "--out", str(out)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code, capsys.readouterr().err
    result = json.loads((out / "result.json").read_text())
    assert any("V_εε" in note for note in result["notes"])
    assert result["modes"][0]["standard_deviation"] == pytest.approx(1e-3**0.5)
    assert "correlations included" in (out / "report.html").read_text()


def test_from_arrays_as_from_files(tmp_path: Path) -> None:
    """The same table of `cvxupdate.Modes`, a turned sensor and all."""
    rng = np.random.default_rng(4)
    root = rng.standard_normal((6, 9))
    C = root @ root.T * 1e-4
    shapes = np.array([[0.6, 1.0], [-1.0, 0.7]])
    modes = cvxupdate.Modes([3.0, 7.9], shapes, ["2:X", "3:-X"], covariance=C)
    sign = np.array([1, 1, 1, -1, 1, -1])
    np.testing.assert_allclose(modes.covariance, C * np.outer(sign, sign))
    kept = modes.at(["3:X"])
    np.testing.assert_allclose(
        kept.covariance, modes.covariance[np.ix_([0, 1, 3, 5], [0, 1, 3, 5])]
    )
    assert np.shape(modes.table()["covariance"]) == (6, 6)
    with pytest.raises(InputError, match="covariance: is 3 × 3"):
        cvxupdate.Modes([3.0, 7.9], shapes, ["2:X", "3:X"], covariance=C[:3, :3])


def test_the_other_methods_say_that_deviations_alone_count(tmp_path: Path) -> None:
    path = written(tmp_path, "ceam")
    text = path.read_text().replace(
        "rows = [{ frequency = 3.0 }, { frequency = 7.9 }]",
        "rows = [{ frequency = 3.0, shape = [0.6, 1.0] },\n"
        "        { frequency = 7.9, shape = [1.0, -0.5] }]\n"
        'channels = [{ column = 0, quantity = "displacement", node = 2, dof = "x" },\n'
        '            { column = 1, quantity = "displacement", node = 3, dof = "x" }]',
    )
    path.write_text(text)
    assert any("its deviations alone" in d.says for d in run(path).warnings)
