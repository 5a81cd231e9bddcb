"""`run`, `correlate` and `diagnose` state one figure for one model and file: on problems of every
model that has frequency responses or time histories."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate import study
from cvxupdate.beside import compared
from cvxupdate.correlate import response_errors
from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.gather import gathered
from cvxupdate.errors import CvxupdateError
from cvxupdate.update.score import response_metrics

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
SKIPPED = ("truth.toml", "problem_all_layouts.toml")  # 150 recordings of one kind: minutes


def files():
    """Every problem that has responses, but for those of one model whose recordings are of the same
    kinds and quantities: they differ in what `run` may change, or in noise; nor `strange`, whose
    models and recordings are such as `concealed` has."""
    out = {}
    for path in sorted(PROBLEMS.rglob("*.toml"), key=lambda p: (p.name != "problem.toml", p)):
        if path.name in SKIPPED or path.is_relative_to(PROBLEMS / "strange"):
            continue
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        recordings = tables.get("recordings", [])
        if not {r["kind"] for r in recordings} & {"frf", "time"}:
            continue
        model = dict(tables["model"])
        if "include" in model:
            model["include"] = str((path.parent / model["include"]).resolve())
        kinds = {(r["kind"], r.get("use"), r.get("response"), r.get("unit")) for r in recordings}
        data = {r.get("dataset") or r.get("state") for r in recordings}
        out.setdefault(repr((model, sorted(map(str, kinds)), sorted(map(str, data)))), path)
    return sorted(out.values())


FILES = files()
RUN = ("chain10/noisy", "bay/fe1_x1_noisy", "ceam/case1")
"""Quick enough to be run to the end."""
DIAGNOSED = {"concealed/o01": "attached_resonator", "concealed/o03": "clearance"}
"""The only effect that is looked for: what is stated depends on none, and this ends the search."""


def befores(fit):
    """{use: {metric: before}} of the responses alone."""
    return {
        key: {
            name: pair["before"]
            for name, pair in fit[key].items()
            if name in ("frf_error", "response_error")
        }
        for key in ("fit", "hold_out")
    }


def assert_same(a, b):
    assert a.keys() == b.keys()
    for key in a:
        assert a[key] == pytest.approx(b[key], rel=1e-6), key


def nominal_metrics(spec, model, recordings):
    """What `diagnose` states where nothing was fitted."""
    evidence = gathered(spec, model, recordings, lambda text: None)
    setting = evidence.setting(evidence.model, ())
    return evidence.metrics(evidence.evaluated(setting, np.zeros(len(setting.columns))))


def test_there_are_problems_with_frfs_and_with_time_histories():
    names = {str(path.relative_to(PROBLEMS).parent) for path in FILES}
    assert set(DIAGNOSED) <= names and len(names) > 30
    assert all((PROBLEMS / name / "problem.toml").is_file() for name in RUN)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PROBLEMS)))
def test_the_commands_agree_as_modelled(path):
    try:
        spec, model, recordings = study.open_problem(path)
    except CvxupdateError as error:
        pytest.skip(f"its data are not here: {error}")
    wanted = response_errors(model, recordings)
    if wanted["fit"]:
        assert_same(befores(nominal_metrics(spec, model, recordings)), wanted)
    assert_same(befores(response_metrics(model, model.zero(), recordings)), wanted)
    try:
        found = compared(spec, model, recordings)
    except CvxupdateError:
        assert not wanted["fit"] and not wanted["hold_out"]  # nothing to compare, so no figure
    else:
        assert_same(befores(found.fit), wanted)


@pytest.mark.parametrize("name", RUN)
def test_run_itself_states_it(name):
    path = PROBLEMS / name / "problem.toml"
    assert_same(befores(study.run(path).fit), befores(study.correlate(path).fit))


@pytest.mark.parametrize("name", DIAGNOSED)
def test_diagnose_itself_states_it(name):
    """In its metrics, and, where there is one kind of recording, as its fit."""
    path = PROBLEMS / name / "problem.toml"
    spec, model, recordings = study.open_problem(path)
    only = spec.diagnose.model_copy(update={"physics": (DIAGNOSED[name],)})
    found = diagnose_problem(replace(spec, diagnose=only), model, recordings)
    wanted = befores(study.correlate(path).fit)
    assert_same(befores(found.metrics), wanted)
    for key, metrics in wanted.items():
        (value,) = metrics.values()
        assert found.fit[key]["before"] == pytest.approx(value, rel=1e-6)
