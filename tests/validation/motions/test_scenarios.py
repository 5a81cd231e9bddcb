"""One cantilever in five scenarios: its modes in closed form, its march against scipy's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cvxupdate.study import open_problem
from validation.motions.scenarios import (
    LENGTH,
    LEVELS,
    RHO,
    SCENARIOS,
    STEPS,
    E,
    Scenario,
    bench,
    marched,
    write,
)

ROOTS = np.array([1.87510407, 4.69409113, 7.85475744])  # of cos x cosh x = −1


def frequencies(s: Scenario) -> np.ndarray:
    return np.sqrt(bench(s).square[:3])


def test_a_slender_bar_has_the_modes_of_a_cantilever() -> None:
    s = Scenario(height=0.004)
    exact = (ROOTS / LENGTH) ** 2 * np.sqrt(E * s.height**2 / (12.0 * RHO))
    np.testing.assert_allclose(frequencies(s), exact, rtol=1e-3)


def test_every_scenario_is_softer_than_the_drawing() -> None:
    for s in SCENARIOS.values():
        plain = frequencies(Scenario(height=s.height))
        softer = s.shear or s.damage < 1.0 or np.isfinite(s.clamp)
        assert np.all(frequencies(s) <= plain * (1.0 + 1e-9))
        assert bool(np.any(frequencies(s) < 0.995 * plain)) == softer
    stiff = frequencies(replace(SCENARIOS["boundary"], clamp=1e9))
    np.testing.assert_allclose(stiff, frequencies(Scenario()), rtol=1e-4)


def test_a_softening_material_is_marched_as_by_scipy() -> None:
    b = bench(SCENARIOS["material"])
    assert b.soft > 0.0
    n, step = 120, 1.0 / (b.rate * STEPS)
    coarse = 40.0 * np.sin(1.3 * np.sqrt(b.square[0]) * np.arange(n) / b.rate)
    fine = np.interp(np.arange(2 * STEPS * (n - 1) + 1) / (2 * STEPS), np.arange(n), coarse)
    push = b.shapes[b.beam.row(0.45)]

    def rate(t, y):
        q, v = np.split(y, 2)
        f = np.interp(t * b.rate, np.arange(n), coarse)
        curved = b.bend @ q
        moment = b.beam.stiff * curved / np.sqrt(1.0 + b.soft * curved**2)
        return np.concatenate([v, push * f - b.slow * v - moment @ b.bend])

    at = np.arange(n) / b.rate
    run = solve_ivp(rate, (0.0, at[-1]), np.zeros(12), "LSODA", at, rtol=1e-9, atol=1e-12)
    exact = np.array([rate(t, y)[6:] for t, y in zip(at, run.y.T, strict=True)])
    own = marched(b.square, b.slow, push, b.bend, b.beam.stiff, b.soft, fine, step)
    assert np.abs(own - exact).max() < 1e-3 * np.abs(exact).max()


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_its_files_are_a_problem(name: str, tmp_path) -> None:
    _, model, recordings = open_problem(write(name, tmp_path))
    assert len(model.node_ids) == 21 and len(recordings) == len(LEVELS)
    assert [r.origin.use for r in recordings] == ["fit", "fit", "hold-out"]
    assert all(np.all(np.isfinite(r.data)) and np.std(r.data[:, -1]) > 0.0 for r in recordings)
