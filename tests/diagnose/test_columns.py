"""Columns of many candidates at a time are those of the models that grow from them, one by one;
shares are those of the plain formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cvxupdate.diagnose.columns import Columns, columns_of, delay_unit, sums_of
from cvxupdate.diagnose.data import ordinary
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.signals import frf_lines, smooth

from cvxupdate.diagnose.fit import setting_for
from cvxupdate.diagnose.screen import left_over, screen
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import HiddenOscillator

WORDS = (
    "stiffness_change",
    "added_mass",
    "grounding_spring",
    "viscous_damper",
    "structural_damping",
    "mass_proportional_damping",
    "sensor_fault",
    "attached_resonator",
)


@pytest.fixture
def scene(chain, lab, measure):
    """(model of the file, ordinary model, signals, point, candidates) with two recordings, one of
    them smoothed more."""
    _, model = chain
    start = ordinary(undamped(model))
    m = start.matrices(start.zero())
    signals = tuple(
        smooth(frf_lines(measure(lab(c=(0, 0, 9.0, 0)), k, seed=k)), e)
        for k, e in ((4, 0.03), (1, 0.1))
    )
    sensors = tuple(dict.fromkeys(label for s in signals for label in s.sensors))
    context = SearchContext(
        start, m.K, m.M, 75.0, 5.0, sensors, (), lambda node, kind: start, 0.005
    )
    candidates = [c for word in WORDS for c in candidates_of(context, (word,))]
    setting = setting_for(start, model, signals, 75.0, 5.0)
    return model, start, signals, setting.evaluate(np.zeros(len(setting.columns))), candidates


def test_columns_are_those_of_the_models_that_grow(scene):
    model, start, signals, point, candidates = scene
    _, weights, _ = point.differences
    n = len(start.parameters)
    compared = set()
    for c, J in zip(candidates, columns_of(point, candidates), strict=True):
        if isinstance(c.action, HiddenOscillator):
            continue
        faults = () if c.fault is None else (replace(c.fault, unit=delay_unit(point)),)
        setting = setting_for(
            start if faults else c.change.model, model, signals, 75.0, 5.0, faults
        )
        p = np.zeros(len(setting.columns))
        if c.fault and c.fault.how == "swap":
            p[-1] = -1.0  # nothing is exchanged yet
        A = (
            setting.evaluate(p).jacobian()[:, -1:]
            if faults
            else setting.evaluate(p).jacobian()[:, n : n + c.count]
        )
        wanted = weights[:, None] * A
        np.testing.assert_allclose(
            J, wanted, rtol=1e-8, atol=1e-9 * max(np.abs(wanted).max(), 1e-300), err_msg=c.name
        )
        compared.add(c.physics)
    assert compared == set(WORDS) - {"attached_resonator"}


def test_a_hidden_oscillator_s_column_is_a_mass_where_its_spring_is_stiff(scene):
    """Far below its own frequency a mass on a spring is a mass."""
    *_, point, candidates = scene
    hidden = next(c for c in candidates if isinstance(c.action, HiddenOscillator))
    lump = next(
        c for c in candidates if c.physics == "added_mass" and c.place.nodes == hidden.place.nodes
    )
    stiff = replace(hidden, action=replace(hidden.action, frequency=1e6, zeta=0.0))
    a, b = columns_of(point, [stiff, lump])
    unit = lump.change.tangent[0][0].M[0, 0, 0]
    np.testing.assert_allclose(unit * a, b, rtol=1e-6, atol=1e-7 * np.abs(b).max())


def test_shares_are_those_of_the_plain_formula(scene):
    *_, point, candidates = scene
    left = left_over(point)
    total = left.residual @ left.residual
    assert sums_of(candidates)
    columns = columns_of(point, candidates)
    for score, J in zip(screen(point, candidates), columns, strict=True):
        Jp = left.freed(J)
        best = np.linalg.lstsq(Jp, left.residual, rcond=None)[0]
        free = np.linalg.norm(Jp, axis=0) > 1e-6 * np.linalg.norm(J, axis=0)
        if not np.all(free):
            continue
        if score.candidate.sign > 0 and best[0] < 0.0:
            assert score.share == 0.0
            continue
        rest = left.residual - Jp @ best
        assert score.share == pytest.approx(1.0 - rest @ rest / total, abs=1e-9), (
            score.candidate.name
        )


def test_pieces_make_no_difference(scene, monkeypatch):
    *_, point, candidates = scene
    whole = {
        k: J
        for numbers, own in Columns(point).batches(dict(enumerate(candidates)))
        for k, J in zip(numbers, own.T, strict=True)
    }
    monkeypatch.setattr("cvxupdate.diagnose.columns.ROOM", 1)
    for numbers, own in Columns(point).batches(dict(enumerate(candidates))):
        for k, J in zip(numbers, own.T, strict=True):
            np.testing.assert_allclose(J, whole[k], rtol=1e-10, atol=1e-12 * np.abs(J).max())
