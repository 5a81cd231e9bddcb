"""Many starts: drawn inside the bounds, kept as they finish, and told apart by ridges."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.parallel import Where
from cvxupdate.report.run_page import run_page
from cvxupdate.study import run
from cvxupdate.update.modal_fit import modal_fit
from cvxupdate.update.modal_loop import begun_again, released, with_pairing
from cvxupdate.update.starts import (
    Kept,
    StartEnd,
    mark_of,
    random_starts,
    run_starts,
)
from tests.cases.structures import PORTAL, measured, portal, structure

PROBLEM = """
title = "Two masses"
source = "none"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 1.0 }, { id = 2, x = 2.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 1.0e3 }, { id = 2, nodes = [1, 2], k = 1.0e3 }]
[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 1.0 }, { id = 12, nodes = [2], m = 1.0 }]
[[recordings]]
kind = "modes"
rows = [{ frequency = 3.1, shape = [0.62, 1.0] }, { frequency = 8.3, shape = [1.0, -0.61] }]
channels = [
  { column = 0, quantity = "displacement", node = 1, dof = "x" },
  { column = 1, quantity = "displacement", node = 2, dof = "x" },
]
[update]
method = "sensitivity"
shape_residual = "difference"
pairing = "misfit"
begin_with = "shapes"
form = "bounded"
starts = 4
seed = 3
parameters = [{ elements = [1, 2], of = "k", each = "element", lower = -0.6, upper = 1.5 }]
"""


def test_random_starts_lie_inside_the_bounds_and_need_them() -> None:
    model = structure(portal(), PORTAL)[1]
    bounded = tuple(replace(q, lower=-0.2, upper=0.4) for q in model.parameters)
    starts = random_starts(replace(model, parameters=bounded), 200, 1)
    assert starts.shape == (200, len(bounded))
    assert starts.min() >= -0.2 and starts.max() <= 0.4
    assert abs(starts.mean() - 0.1) < 0.02  # uniform: the mean of the bounds
    assert np.array_equal(starts, random_starts(replace(model, parameters=bounded), 200, 1))
    free = (*bounded[:-1], replace(bounded[-1], upper=np.inf))
    with pytest.raises(InputError, match="no bounds to draw"):
        random_starts(replace(model, parameters=free), 3, 1)


def squares(scale: float):  # type: ignore[no-untyped-def]
    def solve(number: int, p: np.ndarray) -> StartEnd:
        return StartEnd(number, scale * float(p @ p), tuple(p.tolist()), "converged", 1, 0.0)

    return solve


def test_finished_starts_are_not_solved_again(tmp_path: Path) -> None:
    """An interrupted run: what is there counts, of another problem nothing, nor a damaged line."""
    tasks = [(k, np.array([float(k)])) for k in range(4)]
    kept = Kept(tmp_path / "starts.jsonl", mark_of(b"problem"))
    for number in (1, 2):
        kept.add(StartEnd(number, 77.0, (0.0,), "converged", 1, 0.0))
    Kept(kept.file, mark_of(b"another")).add(StartEnd(0, -1.0, (0.0,), "converged", 1, 0.0))
    assert kept.file is not None
    with kept.file.open("a") as file:
        file.write('{"mark": "cut sho')
    said: list[tuple[int, int]] = []
    ends = run_starts(tasks, squares, {"scale": 2.0}, kept, Where(1), lambda *n: said.append(n))
    assert [e.objective for e in ends] == [0.0, 77.0, 77.0, 18.0]
    assert said == [(3, 4), (4, 4)]


def test_processes_give_what_one_process_gives() -> None:
    tasks = [(k, np.array([float(k), 1.0])) for k in range(3)]
    nowhere = Kept(None, "")
    alone = run_starts(tasks, squares, {"scale": 2.0}, nowhere, Where(1))
    assert run_starts(tasks, squares, {"scale": 2.0}, nowhere, Where(2)) == alone


def test_run_reports_the_minima(tmp_path: Path) -> None:
    path = tmp_path / "problem.toml"
    path.write_text(PROBLEM, encoding="utf-8")
    keep = tmp_path / "starts.jsonl"
    updated = run(path, where=Where(1), keep=keep)
    report = updated.starts
    assert report["count"] == 5 and len(report["ends"]) == 5
    best = report["minima"][0]
    assert best["objective"] == pytest.approx(updated.fit["fit"]["objective"]["after"], rel=1e-4)
    assert best["share"] == 1.0  # two springs, two modes with shapes: one minimum
    assert best["ridge"] is None and best["differs"] == [] and best["on_bounds"] == 0
    assert best["fit"]["mac_mean"] == pytest.approx(updated.fit["fit"]["mac_mean"]["after"])
    page = run_page(updated)
    assert "5 starts led to 1 minimum." in page and "5 (100 %)" in page
    assert any("5 of 5 starts" in note for note in updated.notes)
    assert any("shapes alone" in note for note in updated.notes)
    lines = [json.loads(line) for line in keep.read_text().splitlines()]
    assert {line["number"] for line in lines} == set(range(5))


def test_parameters_on_bounds_are_released_where_that_leads_lower() -> None:
    """A spring too soft at its bound (a corner) against the truth inside: the loop that `released`
    is given decides, and only a lower end counts."""
    spec, model = structure(
        portal(),
        PORTAL[:3],
        update={"method": "frequencies"},
        constraints={"bounds": {"lower": -0.3, "upper": 0.3}},
    )
    table = measured(model, np.array([0.12, -0.08, 0.1]), range(1, 7))
    fit = modal_fit(spec, model, [table])
    good, _ = fit.run(model.zero())
    corner = np.array([-0.3, -0.08, 0.3])
    stuck = replace(good, point=fit.residual.evaluate(corner))
    limits = np.full(3, -0.3), np.full(3, 0.3)
    asked: list[np.ndarray] = []

    def run(p: np.ndarray, _: object = None):  # type: ignore[no-untyped-def]
        asked.append(p)
        return fit.run(p)

    loop, notes = released(run, stuck, *limits)
    assert np.allclose(asked[0], [0.0, -0.08, 0.0])  # amid the bounds
    assert np.allclose(loop.point.p, [0.12, -0.08, 0.1], atol=1e-6)
    assert "2 parameters on their bounds" in notes[0]
    tried: list[np.ndarray] = []

    def again(p: np.ndarray, _: object):  # type: ignore[no-untyped-def]
        tried.append(p)
        return stuck, ()

    same, nothing = released(again, stuck, *limits)
    assert same is stuck and nothing == ()
    assert np.allclose(tried, [[0.0, -0.08, 0.0]])
    wide = np.full(3, -np.inf), np.full(3, 0.3)
    released(again, stuck, *wide)
    assert np.allclose(tried[1], [-0.3, -0.08, 0.15])  # halfway where a side is open
    assert released(run, loop, *limits)[0] is loop  # nothing is on a bound


def test_a_loop_that_hardly_moves_is_begun_again_halfway_to_the_initial_model() -> None:
    """Where the end is lower it is taken, with the history of both; else nothing."""
    spec, model = structure(portal(), PORTAL[:3], update={"method": "frequencies"})
    truth = np.array([0.12, -0.08, 0.1])
    fit = modal_fit(spec, model, [measured(model, truth, range(1, 7))])
    good, _ = fit.run(model.zero())
    far = np.array([0.4, 0.3, -0.3])
    stuck = replace(good, point=fit.residual.evaluate(far), status="stopped")
    asked: list[np.ndarray] = []

    def run(p: np.ndarray):  # type: ignore[no-untyped-def]
        asked.append(p)
        return fit.run(p)

    found = begun_again(run, stuck)
    assert found is not None
    loop, notes = found
    assert np.allclose(asked, [0.5 * far])
    assert np.allclose(loop.point.p, truth, atol=1e-6)
    assert len(loop.history) > len(stuck.history)
    assert [h.number for h in loop.history] == list(range(1, len(loop.history) + 1))
    assert "halfway to the initial model" in notes[0]
    assert begun_again(lambda _: (stuck, ()), stuck) is None


def test_patience_ends_a_loop_that_hardly_moves() -> None:
    """A trust region of nearly nothing, far from the truth: the limit is far away, too."""
    spec, model = structure(portal(), PORTAL[:3], update={"method": "frequencies"})
    fit = modal_fit(spec, model, [measured(model, np.array([0.4, -0.3, 0.5]), range(1, 7))])
    limited = replace(fit.options, radius=1e-5, max_iterations=50)
    ways = {
        n: with_pairing(
            fit.residual, fit.problem, fit.choice, replace(limited, patience=n), model.zero()
        )[0]
        for n in (None, 3)
    }
    assert ways[3].status == "stopped" and len(ways[3].history) == 4
    assert "3 iterations lowered the objective by less than a tenth" in ways[3].reason
    assert len(ways[None].history) > 10
