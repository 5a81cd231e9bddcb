"""Fits along the motion that the sensors say, of two masses of which one strikes stops."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.fit import fitted, fitted_at
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from
from cvxupdate.diagnose.motion.evidence import MotionEvidence
from cvxupdate.diagnose.motion.guided import begun, guided_rates
from cvxupdate.diagnose.motion.rates import STEP
from cvxupdate.diagnose.motion.runs import beginning
from cvxupdate.diagnose.motion.smoother import Beyond
from cvxupdate.diagnose.responses.setting import EFFORTS
from cvxupdate.diagnose.settings import RESPONSE_DISCREPANCY
from cvxupdate.diagnose.types import Score
from cvxupdate.errors import ModelError
from cvxupdate.recordings.measured import DECAY
from cvxupdate.study import open_problem
from tests.diagnose.motion.test_drift import problem
from validation.motions.laws import Law

SIZES = np.array([2.0e5, 4.0e-4])  # N/m and m: stiff stops well within the motion


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    folder = tmp_path_factory.mktemp("guided")
    problem(folder, [(0.0, 0.0)] * 3, [1.0, 3.0, 2.0], Law("play", tuple(SIZES)))
    spec, model, recordings = open_problem(folder / "problem.toml")[:3]
    found = gathered(spec, model, recordings, lambda text: None)
    assert isinstance(found, MotionEvidence), "the level is told"
    return found


def planted(evidence, times, level=0):
    """The stops at nominal nuisance parameters, of so many times their sizes."""
    setting = evidence.setting(evidence.model, ())
    base = Hypothesis((), evidence.evaluated(setting, np.zeros(len(setting.columns))))
    effect = next(
        e
        for e in evidence.candidates(evidence.model, ("clearance",))
        if e.place.nodes == (1,) and e.action.sides == "two"
    )
    return seed_from(evidence, base, Score(effect, 1.0, times * SIZES, exact=True), level)


def test_a_fit_finds_its_way_from_afar(evidence) -> None:
    """Nuisance parameters nominal, sizes far off: output error alone is caught on the way, from one
    start or another."""
    smooth, caught = evidence.stages[0], []
    for times in ((5.0, 5.0), (4.0, 0.3), (10.0, 1.0)):
        seed = planted(evidence, np.array(times))
        caught.append(fitted(seed.setting, seed.start, EFFORTS["coarse"]).misfit)
        led = fitted(seed.setting, begun(seed.setting, seed.start, smooth), EFFORTS["coarse"])
        assert led.misfit < 2.0, "1: noise and what a sound model leaves"
        assert begun(seed.setting, seed.start, ()) is seed.start
    assert max(caught) > 100.0


@pytest.mark.parametrize("times", [(0.7, 0.8), (1.5, 1.2), (0.5, 1.0)])
def test_a_fit_grows_into_motions_that_part(evidence, times) -> None:
    """Of whole records the derivative says what happens long after motions have parted: fits that
    begin a fifth off leave hundreds of times the noise. From the beginning of the records on they
    find their way."""
    seed = planted(evidence, np.array(times), level=1)
    stuck = fitted(seed.setting, seed.start, EFFORTS["sharp"]).misfit
    led = fitted_at(seed.setting, begun(seed.setting, seed.start, ())).misfit
    assert led < 4.0 and stuck > 100.0 * led


def test_what_a_steep_window_does_not_hear_is_not_marched(evidence) -> None:
    seed = planted(evidence, 1.0, level=1)
    signals, runs = seed.setting.signals, seed.setting.runs
    same = [beginning(s, runs[s.name], DECAY) for s in signals]
    for ours, theirs in zip(same, signals, strict=True):
        np.testing.assert_allclose(ours.Y, theirs.Y, rtol=1e-9, atol=1e-12 * np.abs(ours.Y).max())
        np.testing.assert_allclose(ours.std, theirs.std)
    early = seed.setting.on([beginning(s, runs[s.name], 4.0 * DECAY) for s in signals])
    part, whole = (early.evaluate(seed.start) for _ in range(2))
    vars(whole)["heard"] = dict.fromkeys(part.heard, 1.0)
    vars(whole).pop("motions", None)
    assert set(part.heard.values()) == {0.25}
    for ours, theirs in zip(part.modelled(), whole.modelled(), strict=True):
        allowed = 0.5 * RESPONSE_DISCREPANCY * np.abs(theirs).max()
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=allowed)
    assert all(not np.any(f[len(f) // 3 :]) for f, _, _ in part.motions.values())


def test_of_a_steep_window_no_more_lines_are_taken_than_say_something(evidence) -> None:
    """Under e^{−δt} a line says what its neighbours within δ do; where few are taken already (here
    every second one), fewer or none are left out."""
    signal = evidence.stages[-1][0]
    run = evidence.runs[signal.name]
    few = beginning(signal, run, 4.0 * DECAY)
    assert len(few.s) == len(signal.s[::2]) == len(few.Y) == len(few.std)
    np.testing.assert_allclose(few.s.imag, signal.s.imag[::2])
    thin = replace(signal, s=signal.s[::5], Y=signal.Y[::5], U=signal.U[::5], std=signal.std[::5])
    assert len(beginning(thin, run, 4.0 * DECAY).s) == len(thin.s)


def test_it_begins_where_it_is_told_where_that_is_better(evidence) -> None:
    seed = planted(evidence, 0.6)
    best = fitted(
        seed.setting, begun(seed.setting, seed.start, evidence.stages[0]), EFFORTS["sharp"]
    )
    again = fitted_at(seed.setting, begun(seed.setting, best.p, evidence.stages[0]))
    assert again.cost <= best.cost


def test_without_laws_nothing_is_done(evidence) -> None:
    setting = evidence.setting(evidence.model, ())
    p = np.zeros(len(setting.columns))
    assert begun(setting, p, evidence.stages[0]) is p


def test_rates_of_the_laws_are_differences(evidence) -> None:
    seed = planted(evidence, 1.0)
    point = replace(seed.setting, guided=True).evaluate(seed.start)
    unknowns, rates = guided_rates(point)
    assert unknowns == [len(evidence.model.parameters), len(evidence.model.parameters) + 1]
    name = next(iter(rates))
    f, x, v = point.motions[name]
    p = seed.start.copy()
    p[unknowns[0]] += STEP
    laws = seed.setting.evaluate(p).forces[0]
    np.testing.assert_allclose(laws.trace(x, v)[0] - f, STEP * rates[name][..., 0], atol=1e-9)


def test_the_motion_of_a_place_is_what_it_was(evidence) -> None:
    """From accelerometers with noise, under stops five times as stiff as the structure: no drift,
    and with the law's force nearer to what a simulation of the truth has."""
    true = planted(evidence, 1.0, level=1).setting.evaluate(planted(evidence, 1.0).start)
    point = replace(true.setting, guided=True).evaluate(true.p)
    shape = point.modes.shapes.T @ point.forces[1][:, 0]
    for name, (_, x, _) in true.motions.items():
        bare, _ = Beyond.alone(point, evidence.runs[name]).smoother(shape).motion()
        given = point.motions[name][1][:, 0]
        heard = slice(0, 9 * len(given) // 10)  # at the end a taper lets it down
        was = x[:: len(x) // len(given), 0][heard]
        off = [np.std(m[heard] - was) / np.std(was) for m in (bare, given)]
        assert off[1] < off[0] < 0.3
        assert np.max(np.abs(bare[heard])) < 1.5 * np.max(np.abs(was))


def test_what_breaks_loose_in_what_is_held_out_is_no_fit(tmp_path, monkeypatch) -> None:
    """A spring that softens holds at the levels that were fitted and lets go at ten times these:
    `diagnose` ended in "grows beyond all bounds", and nothing was said."""
    problem(tmp_path, [(0.0, 0.0)] * 3, [1.0, 2.0, 20.0], Law("play", tuple(SIZES)))
    evidence = gathered(*open_problem(tmp_path / "problem.toml")[:3], lambda text: None)
    assert isinstance(evidence, MotionEvidence)
    setting = evidence.setting(evidence.model, ())
    base = Hypothesis((), evidence.evaluated(setting, np.zeros(len(setting.columns))))
    cubic = next(
        e for e in evidence.candidates(evidence.model, ("cubic_stiffness",)) if e.count == 1
    )
    own = sys.modules[MotionEvidence.__module__]
    monkeypatch.setattr(own, "fitted", lambda setting, start, options: fitted_at(setting, start))
    monkeypatch.setattr(own, "begun", lambda setting, start, smooth: start)
    held = [s.name for s in evidence.held]
    assert held and not set(held) & {s.name for s in evidence.stages[0]}
    for size in -np.geomspace(1e4, 1e16, 40):
        score = Score(cubic, 1.0, np.array([size]), exact=True)
        seed = seed_from(evidence, base, score, evidence.levels - 1)
        try:
            evidence.evaluated(seed.setting, seed.start)
        except ModelError:
            pytest.fail("no softening lets go at the high level alone")
        try:
            evidence.fitted(seed, "coarse")
            evidence.fitted(seed, "sharp")
        except ModelError as fault:
            assert "beyond all bounds" in str(fault)
            return
    pytest.fail("nothing ever let go")
