"""Columns of many candidates at a time are those of the models that grow from them, one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.responses import columns
from cvxupdate.diagnose.responses.columns import Columns, columns_of, delay_unit
from cvxupdate.diagnose.responses.setting import setting_for
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


def test_columns_are_those_of_the_models_that_grow(scene):
    model, start, signals, point, candidates = scene
    _, weights, _ = point.differences
    n = len(start.parameters)
    compared = set()
    for c, J in zip(candidates, columns_of(point, candidates), strict=True):
        if isinstance(c.action, HiddenOscillator):
            continue
        faults = () if c.fault is None else (replace(c.fault, unit=delay_unit(point.setting.top)),)
        setting = setting_for(start if faults else c.change.model, model, signals, 75.0, faults)
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


def test_pieces_make_no_difference(scene, monkeypatch):
    *_, point, candidates = scene
    whole = {
        k: J
        for numbers, own in Columns(point).batches(dict(enumerate(candidates)))
        for k, J in zip(numbers, own.T, strict=True)
    }
    monkeypatch.setattr(columns, "ROOM", 1)
    for numbers, own in Columns(point).batches(dict(enumerate(candidates))):
        for k, J in zip(numbers, own.T, strict=True):
            np.testing.assert_allclose(J, whole[k], rtol=1e-10, atol=1e-12 * np.abs(J).max())
