"""`identify` and `plan` as functions: the same answers as the commands, from arrays, files and
problems; results as tables, figures and files; refusals in words."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import cvxupdate
from cvxupdate import Frf, InputError, Model, Modes, Problem, TimeHistory
from cvxupdate.commands.identify import identify as command_identify
from cvxupdate.commands.plan import plan as command_plan
from cvxupdate.spec.write import tables_of, to_toml

K, M = (6.0e4, 4.0e4, 5.2e4), (2.0, 1.4, 1.1)
AT = ["n1.x", "n2.x", "n3.x"]
LINES = np.arange(5.0, 70.0, 0.25)
ZETA = 0.012


def chain() -> Model:
    ends = [[1], [1, 2], [2, 3]]
    springs = {
        "type": "spring",
        "dof": "x",
        "rows": [
            {"id": i, "nodes": e, "k": k, "group": f"k{i}"}
            for i, (e, k) in enumerate(zip(ends, K, strict=True), 1)
        ],
    }
    masses = {"type": "mass", "nodes": [[1], [2], [3]], "m": M}
    x = np.array([[0.0, 0.0], [1.1, 0.2], [1.9, 0.9]])
    damping = {"kind": "modal", "zeta": ZETA}
    return Model(x, [springs, masses], dofs=["x"], damping=damping)


@pytest.fixture(scope="module")
def frf() -> Frf:
    exact = chain().frf(LINES, AT, ["n3.x"], "acceleration")
    rng = np.random.default_rng(4)
    std = 0.002 * np.abs(exact.H)
    noise = std * (rng.standard_normal(exact.H.shape) + 1j * rng.standard_normal(exact.H.shape))
    keys: dict[str, Any] = {"quantity": "acceleration", "variance": 2 * std**2, "name": "shaker"}
    return Frf(LINES, exact.H + noise, AT, ["n3.x"], **keys)


@pytest.fixture(scope="module")
def found(frf: Frf) -> Any:
    return cvxupdate.identify(frf, order=24)


@pytest.fixture(scope="module")
def planned() -> Any:
    return cvxupdate.plan(chain(), ["k1: k", "k2: k"], modes=2, sensors=2, noise=0.02)


def test_modes_are_those_of_the_structure(found) -> None:
    true = chain().modes(3)
    (mine,) = found.sets
    for m, f in zip(mine.modes, true.frequencies, strict=True):
        assert abs(m.frequency - f) < 5 * m.frequency_std + 1e-4
        assert m.damping == pytest.approx(ZETA, rel=0.02)
    assert mine.recording == "shaker"
    assert len(repr(found)) < 120 and "3 modes" in repr(found) and "<table>" in found._repr_html_()


def test_what_was_identified_goes_into_an_update(found) -> None:
    modes = found.modes()
    assert isinstance(modes, Modes) and modes.labels == tuple(AT)
    assert modes.frequency_std is not None and modes.damping is not None
    assert modes.shape_std is not None and np.ptp(modes.shape_std, axis=0) == pytest.approx(0.0)
    up = cvxupdate.update(chain(), modes, ["k1: k", "k2: k"], method="frequencies")
    assert up.status == "converged" and max(abs(q.p) for q in up.parameters) < 5e-3


def test_tables_figures_and_files_of_modes(found, tmp_path) -> None:
    pytest.importorskip("pandas")
    table = found.to_dataframe()
    assert list(table["mode"]) == [1, 2, 3] and "damping_std" in table
    poles = found.to_dataframe("poles")
    assert poles["stable"].any() and poles["order"].max() <= 24
    assert found.plot_stabilisation().axes and len(found.plot_frf().axes) == 3
    found.save(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {
        "damping.toml",
        "modes.csv",
        "recordings.toml",
        "report.html",
        "result.json",
    }
    stated = json.loads((tmp_path / "result.json").read_text())["sets"][0]["modes"]
    assert [m["frequency"] for m in stated] == table["frequency"].tolist()
    with pytest.raises(InputError, match="no recording 1; 1 of them"):
        found.modes(1)
    with pytest.raises(InputError, match="modes, poles"):
        found.to_dataframe("everything")


def test_the_same_from_arrays_tables_text_and_a_problem(frf, found, tmp_path) -> None:
    tables = {"recordings": [frf.table()]}
    problem = Problem(chain(), frf)
    path = problem.save(tmp_path)
    wanted = found.sets[0].frequency
    for given in (tables, problem, path, [frf]):
        again = cvxupdate.identify(given, order=24)
        assert again.sets[0].frequency == pytest.approx(wanted, rel=1e-12)
    assert cvxupdate.identify(problem, order=24).geometry is not None
    assert cvxupdate.identify(to_toml(tables), order=24).sets[0].frequency == pytest.approx(wanted)
    with_model = to_toml(tables_of(problem.spec))
    assert command_identify(with_model).geometry is not None


def test_a_time_history_of_arrays(tmp_path) -> None:
    """White force on one mass and spring: its frequency and damping within their deviations."""
    from scipy.signal import cont2discrete, dlsim

    rng = np.random.default_rng(2)
    f, zeta, rate = 9.0, 0.02, 128.0
    w = 2 * np.pi * f
    system = cont2discrete(
        tuple(
            np.array(a, dtype=float)
            for a in (
                [[0, 1], [-(w**2), -2 * zeta * w]],
                [[0], [1]],
                [[-(w**2), -2 * zeta * w]],
                [[1]],
            )
        ),
        1 / rate,
        "foh",
    )
    force = rng.standard_normal(int(40 * rate))
    _, motion, _ = dlsim(system, force)
    data = np.c_[motion[:, 0], force]
    history = TimeHistory(data, rate, [("n1.x", "acceleration"), ("n1.x", "force")])
    got = cvxupdate.identify(history, band=(4.0, 20.0), estimator="h1", recording=1)
    (mode,) = got.sets[0].modes
    assert abs(mode.frequency - f) < 0.05 and mode.damping == pytest.approx(zeta, rel=0.3)


@pytest.mark.parametrize(
    ("given", "keys", "says"),
    [
        (3, {}, "recordings: a int is none"),
        ([], {}, "recordings: a list is none"),
        (Modes([3.0]), {}, "nothing to identify"),
        ("nowhere.uff", {}, "nowhere.uff"),
        ({"recordings": []}, {}, "no recording"),
        ("frf", {"band": (5.0,)}, r"band: \(5.0,\) is no band"),
        ("frf", {"band": (50.0, 5.0)}, "is no band"),
        ("frf", {"method": "prony"}, "no method 'prony'"),
        ("frf", {"recording": 4}, "no recording '4'"),
    ],
)
def test_refusals_of_identify(frf, given, keys, says) -> None:
    with pytest.raises(InputError, match=says):
        cvxupdate.identify(frf if given == "frf" else given, **keys)


def test_a_plan_is_that_of_the_command(planned, tmp_path) -> None:
    problem = Problem(
        chain(),
        update={
            "method": "rfm",
            "parameters": [{"group": "k1", "of": "k"}, {"group": "k2", "of": "k"}],
        },
    )
    theirs = command_plan(
        problem.save(tmp_path), cvxupdate.commands.planned.Options(2, None, 2, noise=0.02)
    )
    assert planned.sensors[0].labels == theirs.sensors[0].labels
    assert planned.lines[0].deviations == pytest.approx(theirs.lines[0].deviations)
    assert cvxupdate.plan(problem, modes=2).parameters == ("k1.k", "k2.k")
    other = cvxupdate.plan(problem, "k3: k", modes=2)
    assert other.parameters == ("k3.k",)
    assert cvxupdate.plan(chain(), modes=2).lines == ()


def test_tables_figures_and_files_of_a_plan(planned, tmp_path) -> None:
    pytest.importorskip("pandas")
    places = planned.to_dataframe()
    assert list(places["kind"]).count("sensor") == 2 and places["place"].str.startswith("n").all()
    assert len(planned.to_dataframe("sensors")) == len(planned.sensors)
    assert set(planned.to_dataframe("parameters")["parameter"]) == {"k1.k", "k2.k"}
    assert len(planned.to_dataframe("lines")) == sum(len(x.lines) for x in planned.lines)
    assert planned.plot_places().axes and planned.plot_indicator().axes
    planned.save(tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"plan.csv", "report.html", "result.json"}
    assert (
        repr(planned).startswith("PlanResult(2 sensors: n") and "<table>" in planned._repr_html_()
    )


def test_refusals_of_plan() -> None:
    with pytest.raises(InputError, match="sensors 0 is none"):
        cvxupdate.plan(chain(), sensors=0)
    with pytest.raises(InputError, match="not understood"):
        cvxupdate.plan(chain(), "stiffness")
    bare = Model.from_matrices([[3.0e5, -1.0e5], [-1.0e5, 1.0e5]], [[2.0, 0], [0, 1.0]])
    with pytest.raises(InputError, match="no coordinates"):
        cvxupdate.plan(bare, modes=1).plot_places()
