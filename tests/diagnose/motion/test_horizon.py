"""Recordings of which a simulation follows no more than the beginning."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered, in_simulation
from cvxupdate.diagnose.motion.evidence import MotionEvidence
from cvxupdate.diagnose.motion.horizon import followed_part, foretold
from cvxupdate.diagnose.settings import EXPLAINED, OPEN
from cvxupdate.study import open_problem
from tests.diagnose.motion.test_drift import problem
from validation.motions.laws import Law

OWN = sys.modules["cvxupdate.diagnose.motion.horizon"]


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    folder = tmp_path_factory.mktemp("horizon")
    problem(folder, [(0.0, 0.0)] * 3, [1.0, 3.0, 2.0], Law("play", (2.0e5, 4.0e-4)))
    return open_problem(folder / "problem.toml")[:3]


@pytest.fixture(scope="module")
def evidence(opened):
    found = gathered(*opened, lambda text: None)
    assert isinstance(found, MotionEvidence), "the level is told"
    return found


@pytest.mark.parametrize(
    ("early", "whole", "part"),
    [
        ((0.4, 0.8, 6.0), 30.0, 0.25),
        ((0.4, 0.8, 0.9), 30.0, 0.5),
        ((0.4, 0.8, 2.0), OPEN * EXPLAINED, 1.0),
        ((0.4, 40.0, 200.0), 500.0, 1.0),
    ],
    ids=["a quarter", "half", "all of it", "an eighth, which is too little"],
)
def test_the_longest_beginning_that_a_law_explains(
    evidence, monkeypatch, early, whole, part
) -> None:
    """A chain with stiff stops (motions, seed 485) was `undetermined` at any place: the true law
    left noise of a quarter of the record and 30 times that of all of it."""
    fits = [SimpleNamespace(misfit=m, p=np.zeros(1)) for m in early]
    monkeypatch.setattr(OWN, "lengthened", lambda setting, starts: fits)
    monkeypatch.setattr(OWN, "fitted", lambda *_: SimpleNamespace(misfit=whole))
    first = evidence.bases[0]
    monkeypatch.setattr(MotionEvidence, "fitted", lambda self, seed, effort: first)
    assert followed_part(evidence) == part


def test_the_beginnings_alone_are_compared(opened, evidence, monkeypatch) -> None:
    """Of what is fitted and of what is held out, of the nominal model and of what is found."""
    spec, _, recordings = opened

    def silent(text: str) -> None:
        pass

    def again(linear, part):
        return in_simulation(spec, recordings, linear, silent, part)

    monkeypatch.setattr(OWN, "followed_part", lambda evidence: 0.25)
    early, says = foretold(evidence, again, silent)
    assert isinstance(early, MotionEvidence) and "the first 25% of each" in says
    assert set(early.runs) == set(evidence.runs)
    for name, run in early.runs.items():
        whole = evidence.runs[name]
        assert run.samples == whole.samples // 4
        np.testing.assert_allclose(run.force, whole.force[: run.samples])
    assert all(len(r.data) == early.runs[r.origin.name].samples for r in early.came.data.fit)
    assert early.budget is evidence.budget, "it is one diagnosis"
    monkeypatch.setattr(OWN, "followed_part", lambda evidence: 1.0)
    assert foretold(evidence, again, silent)[0] is evidence


def test_a_beginning_that_a_linear_model_explains_tells_no_law(opened, evidence, monkeypatch):
    """Sweeps begin below resonance, where any law follows: what comes later was thrown away."""
    linear = SimpleNamespace(depends=True, bases=[SimpleNamespace(misfit=EXPLAINED)])
    monkeypatch.setattr(OWN, "followed_part", lambda evidence: 0.25)
    found, says = foretold(evidence, lambda *_: linear, lambda text: None)
    assert found is evidence and says == ""
