"""Forces and sensors beside their nodes: what is fitted of them, its derivatives, what it does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.nominal.theory import ASIDE, theory_lines
from cvxupdate.diagnose.nominal.written import sayable
from cvxupdate.diagnose.responses.aside import with_aside
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.study import open_problem
from tests.cases.rigs import frame, frfs
from tests.diagnose.test_by_modes import DRIVES, LINES, SENSORS, clamped, quiet

OFF = 0.006  # m


def sound(folder: Path, off: float) -> ResponseEvidence:
    """What a sound bar's responses say whose forces and sensors are so far beside their nodes."""
    path = frfs(folder, clamped(), clamped(), SENSORS, DRIVES, LINES, off=off)
    found = gathered(*open_problem(path), quiet)
    assert isinstance(found, ResponseEvidence)
    return found


@pytest.fixture(scope="module")
def evidence(tmp_path_factory: pytest.TempPathFactory) -> ResponseEvidence:
    return sound(tmp_path_factory.mktemp("aside"), OFF)


def names(model) -> list[str]:
    return [q.name for q in model.parameters if q.group == ASIDE]


def test_of_forces_each_is_fitted_and_of_sensors_what_tells(evidence) -> None:
    own = names(evidence.model)
    assert own[0] == "force n10.z by n10.ry" and "sensor n7.z by n7.ry" in own
    assert not any("force n4" in name for name in own), "what is held out is not fitted"
    assert not any(".rz" in name or ".x" in name for name in own)
    whole = with_aside(evidence.original, ("n10.z",), (), 900.0)
    assert names(whole) == ["force n10.z by n10.ry"]
    (line,) = [x for x in theory_lines(evidence.model, evidence.bases[-1]) if "beside" in x]
    assert "no finding" in line


def test_what_a_drive_across_moves_is_fitted_of_the_sensors_along(tmp_path) -> None:
    """A force along z hardly moves the beam of a frame along x, and one along x hardly along z: a
    sensor across reads what its own two degrees give it (another laboratory's f05)."""
    path = frfs(tmp_path, frame(), frame(), [(24, "z"), (7, "x")], [(24, "z")], LINES[:40])
    model = open_problem(path)[1]
    sensors = ("n24.z", "n7.x")
    (across,) = ["sensor n24.z by n24.x"]
    assert across not in names(with_aside(model, ("n24.z",), sensors, 900.0))
    assert across in names(with_aside(model, ("n7.x",), sensors, 900.0))
    assert across in names(with_aside(model, ("n24.z", "n7.x"), sensors, 900.0))


def test_along_the_only_axis_nothing_is_beside(chain) -> None:
    _, model = chain
    assert with_aside(model, ("n4.x",), ("n1.x",), 75.0) is model


def test_a_file_has_no_word_for_it_and_needs_none(evidence) -> None:
    fit = evidence.bases[-1]
    kept, values, _ = sayable(fit.setting.model, fit.p)
    assert names(kept) == [] and len(values) == len(kept.parameters)
    assert all("beside" not in line for line in sayable(fit.setting.model, 0.0 * fit.p)[2])


@pytest.mark.parametrize("both", [False, True], ids=["one drive", "a unit of each of two"])
def test_derivatives(evidence, both: bool) -> None:
    setting = evidence.bases[-1].setting
    if both:
        one, two = (*setting.signals, *evidence.data.sharp_hold_out)
        at = one.s[: len(one.Y)]
        units = np.broadcast_to(np.eye(2, dtype=complex), (len(at), 2, 2))
        Y, std = (np.repeat(x, 2, axis=2) for x in (one.Y, one.std))
        inputs = (*one.inputs, *two.inputs)
        setting = setting.on([replace(one, s=at, Y=Y, std=std, U=units, inputs=inputs, mix=None)])
    rng = np.random.default_rng(3)
    p = evidence.bases[-1].p.copy()
    aside = [j for j, q in enumerate(setting.model.parameters) if q.group == ASIDE]
    p[aside] = 0.004 * rng.normal(size=len(aside))
    point = setting.evaluate(p)
    A = point.jacobian()
    for j in (0, 2, *aside):
        step = np.zeros(len(p))
        step[j] = 1e-7
        plus, minus = (setting.evaluate(p + k * step, point).differences[0] for k in (1, -1))
        wanted = (plus - minus) / 2e-7
        limit = 1e-5 if j in aside else 0.05  # of others modal damping is held
        assert np.linalg.norm(A[:, j] - wanted) < limit * np.linalg.norm(wanted), j


def test_a_sound_structure_is_as_sound_a_few_millimetres_beside(evidence, tmp_path) -> None:
    """What is left there is the mesh's, of which both bars are; without levers it is several times
    as much, whatever is fitted."""
    base, at_nodes = evidence.bases[-1], sound(tmp_path, 0.0).bases[-1]
    assert base.misfit < 1.2 * at_nodes.misfit
    found = dict(zip(base.setting.columns, base.p, strict=True))
    assert abs(found["force n10.z by n10.ry"]) == pytest.approx(OFF, rel=0.2)
    exact = replace(
        base.setting,
        model=base.setting.model.with_parameters(
            [
                replace(q, lower=-1e-9, upper=1e-9) if q.group == ASIDE else q
                for q in base.setting.model.parameters
            ]
        ),
    )
    without = fitted(exact, np.zeros(len(exact.columns)), EFFORTS["sharp"])
    assert without.misfit > 3.0 * base.misfit


def test_a_file_says_what_it_has_no_word_for(evidence) -> None:
    """Within their usual deviation nothing is said."""
    fit = evidence.bases[-1]
    model = fit.setting.model
    (lever,) = [j for j, q in enumerate(model.parameters) if q.name.startswith("force")]
    for size, count in ((0.004, 0), (0.006, 1)):
        p = model.zero()
        p[lever] = size
        _, _, said = sayable(model, p)
        assert sum("more than usually beside their nodes" in line for line in said) == count
