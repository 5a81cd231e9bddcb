"""The commands as functions: one problem in any form, results with tables, figures and files, and
objects of one's own in the convex step."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import cvxupdate
from cvxupdate import InputError, Model, Modes, Problem
from cvxupdate.convex import ConicClause, LinearClause

K = (6.0e4, 4.0e4, 5.2e4)
M = (2.0, 1.4, 1.1)


def chain(k: tuple[float, ...] = K, m: tuple[float, ...] = M, damping: float = 0.01) -> Model:
    springs = {
        "type": "spring",
        "dof": "x",
        "rows": [
            {"id": i, "nodes": [i - 1, i][i < 2 :], "k": v, "group": f"k{i}"}
            for i, v in enumerate(k, 1)
        ],
    }
    masses = {"type": "mass", "nodes": [[1], [2], [3]], "m": m}
    x = np.array([[0.0], [1.1], [1.9]])
    return Model(x, [springs, masses], dofs=["x"], damping={"kind": "modal", "zeta": damping})


TRUTH = chain((6.6e4, 4.0e4, 5.2e4))
AT = ["n1.x", "n2.x", "n3.x"]
EACH = ["k1: k", "k2: k", "k3: k"]


@pytest.fixture(scope="module")
def updated() -> Any:
    modes = TRUTH.modes(3)
    return cvxupdate.update(chain(), Modes(modes.frequencies, modes.shapes, AT), EACH)


def test_names_of_rooms_are_functions() -> None:
    code = (
        "import cvxupdate.diagnose.pipeline, cvxupdate.update.result, cvxupdate.correlate\n"
        "import cvxupdate\n"
        "from cvxupdate.correlate import mac\n"
        "print(*(type(getattr(cvxupdate, n)).__name__ for n in "
        "('diagnose', 'update', 'correlate', 'inspect')), mac.__name__)"
    )
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert made.stdout.split() == ["function"] * 4 + ["mac"]


def test_an_update_finds_the_truth(updated) -> None:
    assert updated.status == "converged"
    assert [q.after for q in updated.parameters] == pytest.approx([6.6e4, 4.0e4, 5.2e4], rel=1e-4)
    assert updated.model.modes(3).frequencies == pytest.approx(TRUTH.modes(3).frequencies, rel=1e-5)
    assert updated.facts == updated.data.model and "status" in dir(updated)
    assert len(repr(updated)) < 200 and "<table>" in updated._repr_html_()
    with pytest.raises(AttributeError):
        _ = updated.nothing


def test_tables_and_figures_of_an_update(updated) -> None:
    pytest.importorskip("pandas")
    table = updated.to_dataframe()
    assert list(table["name"]) == [q.name for q in updated.parameters]
    assert len(updated.to_dataframe("modes")) == 3 and len(updated.to_dataframe("history")) > 0
    assert len(updated.after.to_dataframe("mac")) == 9
    assert updated.after.fit["fit"]["mac_min"]["after"] == pytest.approx(1.0)
    for figure in (updated.plot_parameters(), updated.plot_frequencies(), updated.after.plot_mac()):
        assert figure.axes
    with pytest.raises(InputError, match="no recording 0"):
        updated.plot_frf()
    with pytest.raises(InputError, match="parameters, modes, history"):
        updated.to_dataframe("everything")


def test_what_is_saved_runs_again(updated, tmp_path) -> None:
    updated.save(tmp_path / "out")
    names = {p.name for p in (tmp_path / "out").rglob("*") if p.is_file()}
    assert names == {"result.json", "report.html", "problem.toml"}
    again = cvxupdate.correlate(tmp_path / "out" / "updated" / "problem.toml")
    assert again.fit["fit"]["frequency_error_percent_mean"]["after"] < 1e-3


def test_a_problem_of_matrices_and_responses_is_saved_whole(tmp_path) -> None:
    model = Model.from_matrices(TRUTH.K, TRUTH.M, TRUTH.C, labels=AT)
    frf = TRUTH.frf(np.arange(5.0, 60.0, 0.5), AT, ["n3.x"], "acceleration")
    path = Problem(model, frf, title="saved").save(tmp_path / "a")
    (tmp_path / "a").rename(tmp_path / "b")  # nothing in it says where it was
    text = (tmp_path / "b" / "problem.toml").read_text()
    assert str(tmp_path) not in text and "tmp" not in text.replace("saved", "")
    found = cvxupdate.correlate(tmp_path / "b" / path.name)
    assert found.fit["fit"]["frf_error"]["after"] < 1e-6
    assert cvxupdate.check(tmp_path / "b" / path.name)["free DOFs"] == 3
    assert found.plot_frf(response="n1.x").axes
    with pytest.raises(InputError, match="there is no response n9.x"):
        found.plot_frf(response="n9.x")


def test_a_problem_takes_parameters_in_words_as_update_does(tmp_path) -> None:
    model, modes = chain(), Modes([5.0, 12.0, 17.0])
    rows = [{"group": "k2", "of": "k"}, {"group": "k3", "of": "k", "lower": -0.3}]
    words = Problem(model, modes, update={"parameters": ["k2: k", rows[1]]})
    whole = Problem(model, modes, update={"method": "frequencies", "parameters": rows})
    assert words.spec.update == whole.spec.update
    one = cvxupdate.run(whole, update={"parameters": "k2: k"})
    assert [q.name for q in one.parameters] == ["k2.k"]
    assert cvxupdate.run(words.save(tmp_path)).status == cvxupdate.run(whole).status
    with pytest.raises(InputError, match="'k2' is not understood"):
        Problem(model, modes, update={"parameters": ["k2"]})
    table = {"parameters": {"file": "none.csv"}}
    with pytest.raises(InputError, match=r"none\.csv"):
        Problem(model, modes, update=table)


def test_files_of_arrays_go_with_their_object() -> None:
    from pathlib import Path

    frf = TRUTH.frf([5.0, 6.0], AT, ["n3.x"])
    file = Path(frf.table()["file"])
    assert file.is_file()
    del frf
    assert not file.exists()


@dataclass(frozen=True)
class Half:
    """p of the first parameter is at most half of what it wants."""

    keys: ClassVar[dict[str, Any]] = {}

    def clauses(self, columns):
        return (LinearClause("half", (0,), np.eye(1), np.array([-np.inf]), np.array([0.05])),)


@dataclass(frozen=True)
class Ball:
    keys: ClassVar[dict[str, Any]] = {}

    def clauses(self, columns):
        import cvxpy as cp

        return (
            ConicClause(
                "ball",
                lambda p, slack: [cp.norm(p) <= 0.02 + slack],
                lambda p: 0.02 - float(np.linalg.norm(p)),
            ),
        )


@pytest.mark.parametrize(("own", "most"), [(Half(), 0.05), (Ball(), 0.02)])
def test_a_constraint_of_ones_own_holds(own, most: float) -> None:
    modes = Modes(TRUTH.modes(3).frequencies, frequency_std=0.01)
    up = cvxupdate.update(chain(), modes, EACH, constraints=[own])
    p = np.array([q.p for q in up.parameters])
    assert p[0] == pytest.approx(most, rel=1e-3) if most == 0.05 else np.linalg.norm(p) <= 0.0201
    table = {"bounds": {"lower": -0.01, "upper": 0.01}}
    both = cvxupdate.update(chain(), modes, EACH, constraints=[own, table])
    assert max(abs(q.p) for q in both.parameters) <= 0.01 + 1e-9
    with pytest.raises(InputError, match="a file cannot hold"):
        Problem(chain(), modes, constraints=own).save("nowhere")


def test_a_diagnosis_names_the_spring() -> None:
    f = np.arange(5.0, 60.0, 0.25)
    exact = TRUTH.frf(f, AT, ["n3.x"], "acceleration")
    rng = np.random.default_rng(3)
    noise = rng.standard_normal((2, *exact.H.shape)) * 2e-3 * np.abs(exact.H)
    frf = cvxupdate.Frf(
        f, exact.H + noise[0] + 1j * noise[1], AT, ["n3.x"], quantity="acceleration"
    )
    found = cvxupdate.diagnose(chain(), frf, physics=["stiffness_change", "added_mass"])
    assert found.verdict in ("missing_physics", "parameter_error") and found.model is not None
    assert len(repr(found)) < 300 and "<div>" in found._repr_html_()
    assert found.fit["fit"]["after"] < 0.02
    assert found.plot_frf().axes and found.after.fit["fit"]["frf_error"]["after"] < 0.05


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: cvxupdate.correlate(chain()), "a model alone"),
        (lambda: cvxupdate.correlate(chain(), "a.uff"), "from_file"),
        (lambda: cvxupdate.correlate(chain(), [3]), "is no recording"),
        (lambda: cvxupdate.correlate("a.toml", Modes([1.0])), "has its own"),
        (lambda: cvxupdate.diagnose(chain(), Modes([1.0]), physics=[3]), "is no effect"),
        (lambda: cvxupdate.diagnose(chain(), Modes([1.0]), physics=["magic"]), "magic"),
        (lambda: cvxupdate.update(chain(), Modes([1.0]), ["k1"]), "not understood"),
        (lambda: cvxupdate.update(chain(), Modes([1.0]), ["k9: k"]), "k9"),
        (lambda: cvxupdate.update(chain(), Modes([1.0]), EACH, method="magic"), "magic"),
        (lambda: cvxupdate.update(chain(), Modes([1.0]), EACH, constraints=[3]), "is none"),
        (lambda: cvxupdate.update(chain(), Modes([1.0]), EACH, constraints=[Half]), "is none"),
        (
            lambda: cvxupdate.update(chain(), Modes([1.0]), EACH, constraints=[{"bound": 1}]),
            "bound",
        ),
        (lambda: cvxupdate.update(chain(), [], EACH), "recording"),
        (lambda: cvxupdate.run(chain(), Modes([1.0])), r"needs an \[update\]"),
        (lambda: cvxupdate.inspect(3), "is no file"),
    ],
)
def test_bad_input_is_said_in_words(call, says: str) -> None:
    with pytest.raises(InputError, match=says):
        call()


def test_results_are_short_at_a_prompt(updated) -> None:
    """An update printed 117,768 characters."""
    for shown in (updated, updated.after, updated.model):
        assert 0 < len(repr(shown)) < 500 and "\n\n" not in repr(shown)
