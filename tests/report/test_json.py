"""result.json: the contract's keys and types, in a fixed order, and never a NaN."""

import json
import math

import numpy as np
import pytest

from cvxupdate.errors import CvxupdateError
from cvxupdate.report import run_files, solvers_files
from cvxupdate.report.as_json import dumps, plain, run_data
from cvxupdate.study import solvers

STATUSES = {"converged", "optimal", "infeasible", "stopped"}
NUMBER = (int, float)


def refuse(constant):
    raise AssertionError(f"{constant} in JSON")


def strict(text):
    """JSON as the standard has it: NaN and Infinity are errors."""
    return json.loads(text, parse_constant=refuse)


def check_run(data):
    """The form of contract section 3."""
    assert list(data)[:10] == [
        "problem",
        "status",
        "reason",
        "method",
        "solver",
        "iterations",
        "parameters",
        "fit",
        "certificate",
        "time",
    ]
    assert data["status"] in STATUSES
    assert all(isinstance(data[k], str) for k in ("problem", "method", "solver", "reason"))
    assert isinstance(data["iterations"], int) and isinstance(data["time"], float)
    for q in data["parameters"]:
        assert (
            isinstance(q["name"], str)
            and isinstance(q["of"], str)
            and isinstance(q["at_bound"], bool)
        )
        assert (q["element"] is None or isinstance(q["element"], int)) and (
            q["group"] is None or isinstance(q["group"], str)
        )
        assert isinstance(q["before"], NUMBER) and isinstance(q["after"], NUMBER)
        assert q["standard_deviation"] is None or q["standard_deviation"] >= 0
    assert set(data["fit"]) >= {"fit", "hold_out"}
    for metrics in data["fit"].values():
        for name, pair in metrics.items():
            assert set(pair) == {"before", "after"}, name
            assert all(v is None or isinstance(v, NUMBER) for v in pair.values())
    for key in ("primal_residual", "dual_residual", "gap"):
        assert data["certificate"][key] is None or isinstance(data["certificate"][key], NUMBER)


def test_updated_has_the_form_of_the_contract(updated):
    files, text = run_files(updated)
    assert files["result.json"] == text and set(files) == {
        "result.json",
        "report.html",
        "updated/problem.toml",
    }
    data = strict(text)
    check_run(data)
    assert data["status"] == "converged"
    assert [q["name"] for q in data["parameters"]] == ["e1.k", "e2.k", "floor.m"]
    assert data["parameters"][0]["element"] == 1 and data["parameters"][2]["group"] == "floor"
    assert data["fit"]["fit"]["frequency_error_percent_mean"]["after"] == pytest.approx(
        np.mean([m["error_after"] for m in data["modes"] if m["use"] == "fit"])
    )
    assert data["certificate"]["gap"] < 1e-6 and data["certificate"]["optimal"] is True


def test_numbers_are_not_rounded(updated):
    data = strict(run_files(updated)[1])
    assert [q["after"] for q in data["parameters"]] == [q.after for q in updated.parameters]


def test_same_result_same_text(updated):
    assert run_files(updated)[1] == run_files(updated)[1]


def test_infeasible_names_the_clauses(infeasible):
    data = strict(run_files(infeasible)[1])
    check_run(data)
    assert data["status"] == "infeasible" and data["iterations"] == 0
    assert data["certificate"]["conflict"] == data["conflict"]
    assert (
        len(data["conflict"]) == 2
        and any("total mass" in c for c in data["conflict"])
        and any("floor.m" in c for c in data["conflict"])
    )
    assert data["relaxation"] and all(q["after"] == q["before"] for q in data["parameters"])


def test_values_that_are_not_finite_become_null(hostile):
    data = strict(run_files(hostile)[1])
    assert (
        data["certificate"]["gap"] is None
        and data["noise"] is None
        and data["modes"][0]["mac_before"] is None
    )
    assert data["parameters"][0]["standard_deviation"] is None


def test_plain_takes_numpy_apart():
    given = {
        "a": np.float64(0.5),
        "b": np.arange(3),
        "c": (np.int64(2), np.bool_(True)),
        "d": 1 + 2j,
        "e": np.array([math.inf, -1.0]),
    }
    assert plain(given) == {
        "a": 0.5,
        "b": [0, 1, 2],
        "c": [2, True],
        "d": {"re": 1.0, "im": 2.0},
        "e": [None, -1.0],
    }
    assert type(plain(np.float64(0.5))) is float and type(plain(np.bool_(True))) is bool
    with pytest.raises(CvxupdateError, match="object, which JSON cannot hold"):
        plain({"x": object()})


def test_dumps_keeps_the_order_and_the_letters(updated):
    text = dumps(run_data(updated))
    assert text.endswith("}\n") and list(strict(text)) == list(run_data(updated))
    assert dumps({"unit": "µm"}) == '{\n  "unit": "µm"\n}\n'


def test_solvers_form(updated):
    spec, rows, spread = solvers(updated.path)
    files, text = solvers_files(spec.name, spec.title, rows, spread)
    data = strict(text)
    assert set(files) == {"result.json", "report.html"} and files["result.json"] == text
    assert list(data) == ["problem", "title", "status", "spread", "solvers"]
    assert data["status"] == "optimal" and data["spread"] == spread <= 1e-6
    assert [s["solver"] for s in data["solvers"]] == [r.solver for r in rows]
    for s in data["solvers"]:
        assert set(s) == {
            "solver",
            "status",
            "objective",
            "iterations",
            "time",
            "certificate",
            "note",
        }
        assert {"primal_residual", "dual_residual", "gap"} <= set(s["certificate"])


def test_solvers_without_an_answer(infeasible):
    spec, rows, spread = solvers(infeasible.path)
    data = strict(solvers_files(spec.name, spec.title, rows, spread)[1])
    assert data["status"] == "infeasible" and data["spread"] is None
    assert all(s["objective"] is None for s in data["solvers"])
