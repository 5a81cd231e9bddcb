"""Which measurement next: where two laws that do alike part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered, in_simulation
from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from
from cvxupdate.diagnose.motion.apart import LOUDER, Apart, apart, next_measurement, told
from cvxupdate.diagnose.types import Score
from cvxupdate.errors import ModelError
from cvxupdate.study import open_problem
from tests.cases.shaken import FREQUENCIES
from tests.diagnose.motion.test_drift import problem


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    folder = tmp_path_factory.mktemp("apart")
    problem(folder, [(0.0, 0.0)] * 3, [1.0, 2.0, 2.0])
    spec, model, recordings = open_problem(folder / "problem.toml")[:3]
    linear = gathered(spec, model, recordings, lambda text: None)
    return in_simulation(spec, recordings, linear, lambda text: None)


def fit(evidence, physics, node, *size):
    """A law at a node, as it is."""
    setting = evidence.at_level(evidence.setting(evidence.model, ()), evidence.levels - 1)
    base = Hypothesis((), evidence.evaluated(setting, np.zeros(len(setting.columns))))
    effect = next(
        e for e in evidence.candidates(evidence.model, (physics,)) if e.place.nodes == (node,)
    )
    seed = seed_from(evidence, base, Score(effect, 1.0, np.array(size), exact=True), 1)
    return evidence.evaluated(seed.setting, seed.start)


def test_a_hardening_spring_is_told_from_none_at_the_highest_level(evidence) -> None:
    """A cubic force grows with the square of the level against a linear one."""
    weak, none = fit(evidence, "cubic_stiffness", 1, 5e6), fit(evidence, "cubic_stiffness", 1, 1e-3)
    run = max(evidence.runs.values(), key=lambda r: r.level)
    own = [s for s in evidence.stages[-1] if s.name == run.name]
    found = apart(weak, none, run, own)
    assert found.factor == max(LOUDER)
    assert found.difference > 2.0 * found.now > 0.0
    # where it answers most: at a resonance
    assert np.min(np.abs(FREQUENCIES / found.frequency - 1.0)) < 0.2
    says = next_measurement(evidence.runs, evidence.stages[-1], (weak, none), ("A", "B"))
    assert says.startswith("To tell A from B, measure at level 8 (4 times the loudest run)")


def test_friction_is_told_at_the_lowest_level(evidence) -> None:
    rubbing = fit(evidence, "dry_friction", 1, 2.0)
    run = max(evidence.runs.values(), key=lambda r: r.level)
    own = [s for s in evidence.stages[-1] if s.name == run.name]
    none = fit(evidence, "dry_friction", 1, 1e-6)
    assert apart(rubbing, none, run, own).factor == min(LOUDER)


def test_no_level_is_advised_at_which_nothing_holds_the_model(evidence) -> None:
    """Springs that soften let go somewhere above the levels that were recorded."""
    run = max(evidence.runs.values(), key=lambda r: r.level)
    own = [s for s in evidence.stages[-1] if s.name == run.name]
    none = fit(evidence, "cubic_stiffness", 1, 1e-3)
    holds, size = None, -1e6
    while holds is None:  # as soft as the loudest run allows
        try:
            holds = fit(evidence, "cubic_stiffness", 1, size)
        except ModelError:
            size /= 2.0
    found = apart(holds, none, run, own)
    assert found.factor < max(LOUDER) and np.isfinite(found.difference)


def test_there_is_no_derivative_where_a_model_only_just_holds(evidence) -> None:
    """Softer by a step of the differences it lets go: told as that, and no number."""
    holds, gone = 0.0, -1e7
    for _ in range(16):
        middle = 0.5 * (holds + gone)
        try:
            fit(evidence, "cubic_stiffness", 1, middle)
            holds = middle
        except ModelError:
            gone = middle
    point = fit(evidence, "cubic_stiffness", 1, holds).point
    try:
        rows = point.system().A
    except ModelError as error:
        rows = np.zeros(1)
        assert "beyond all bounds" in str(error)
    assert np.all(np.isfinite(rows))


def test_words() -> None:
    found = Apart(4.0, 2.0, 0.23, 17.0, "n3.x", 0.011)
    assert told(found, "a gap", "a crack") == (
        "To tell a gap from a crack, measure at level 4 (2 times the loudest run): there they "
        "differ by 23 % of the response, most at n3.x around 17.0 Hz; in the loudest run by 1.1 %."
    )
    assert told(replace(found, difference=0.01), "a", "b") == ""
    assert "the level that was recorded (4) with less noise" in told(
        replace(found, factor=1.0), "a", "b"
    )
