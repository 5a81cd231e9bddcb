"""The pattern of damping in a table: exact complex modes of chains with a dashpot, a rate of decay,
a lossy spring, against what the pattern says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eig, eigh

from cvxupdate.diagnose.modes.damping import (
    LUCK,
    damping_trials,
    law_odds,
    law_strain,
    needed_drop,
)
from cvxupdate.diagnose.modes.kinds import chi_square
from cvxupdate.diagnose.modes.ratios import Ratios
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.settings import STATED
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.recordings.identify.decay import decay_rates
from cvxupdate.recordings.types import ModeTable, Origin

WORDS = ("viscous_damper", "structural_damping", "mass_proportional_damping")


def ratios(lab, C, D, zeta=0.004):
    """Damping ratios of the lab's complex modes, −Re s / |s|, with modal damping besides
    (scattered, seeded)."""
    lam, phi = eigh(lab.K, lab.M)
    own = zeta * np.exp(0.2 * np.random.default_rng(3).standard_normal(len(lam)))
    modal = lab.M @ phi @ np.diag(2 * own * np.sqrt(lam)) @ phi.T @ lab.M
    n = len(lam)
    zero, one = np.zeros((n, n)), np.eye(n)
    s = eig(
        np.block([[zero, one], [-lab.K - 1j * D, -modal - C]]),
        np.block([[one, zero], [zero, lab.M]]),
        right=False,
    )
    s = np.sort_complex(1j * s[s.imag > 0])[::-1] / 1j  # by frequency
    s = s[np.argsort(s.imag)]
    measured = -s.real / np.abs(s)
    return Ratios(measured, 0.02 * measured, np.full(n, zeta), phi, np.sqrt(lam))


def found(chain, ratios):
    model = with_nuisance(undamped(chain[1]))
    m = model.matrices(model.zero())
    context = SearchContext(model, m.K, m.M, 60.0, 8.0, (), (), lambda node, kind: model, 0.004)
    return damping_trials(ratios, [c for w in WORDS for c in candidates_of(context, (w,))])


def test_nothing_where_only_scatter_is(chain, lab):
    before, trials = found(chain, ratios(lab(), np.zeros((4, 4)), np.zeros((4, 4))))
    assert before < 4.0 and trials == []


def test_a_dashpot_across_a_spring(chain, lab):
    real = lab(c=(0, 0, 25.0, 0))
    before, trials = found(chain, ratios(real, real.C, np.zeros((4, 4))))
    best = trials[0]
    near = [t for t in trials if t.strain < best.strain + 6.0]
    named = [
        t for t in near if t.effect.physics == "viscous_damper" and t.effect.place.nodes == (2, 3)
    ]
    assert before > 20.0 and named
    c = named[0].effect
    model = c.change.model
    value, deviation = c.figures[0].value(
        model, model.parameters[-1], named[0].size, named[0].deviation
    )
    assert abs(value - 25.0) < 3.0 * deviation and deviation < 12.0


def test_one_rate_of_decay(chain, lab):
    real = lab()
    _, trials = found(chain, ratios(real, 6.0 * real.M, np.zeros((4, 4)), zeta=4e-4))
    named = [
        t
        for t in trials
        if t.effect.physics == "mass_proportional_damping" and t.strain < trials[0].strain + 6.0
    ]
    assert named and named[0].size == pytest.approx(6.0, abs=3.0 * named[0].deviation)


def test_the_rate_of_a_word_is_the_derivative_of_the_complex_modes_damping(chain, lab):
    """φᵀCφ / 2ω to first order: an error of second order in the dashpot."""
    real, bare = lab(c=(0, 0, 0.5, 0)), lab()
    with_it, without = (
        ratios(real, real.C, np.zeros((4, 4))),
        ratios(bare, bare.C, np.zeros((4, 4))),
    )
    model = with_nuisance(undamped(chain[1]))
    m = model.matrices(model.zero())
    context = SearchContext(model, m.K, m.M, 60.0, 8.0, (), (), lambda node, kind: model, 0.004)
    c = next(c for c in candidates_of(context, ("viscous_damper",)) if c.place.nodes == (2, 3))
    unit = c.change.model.parameters[-1].unit_size
    np.testing.assert_allclose(
        with_it.measured - without.measured, bare_rate(bare, without) * 0.5, rtol=2e-2
    )
    np.testing.assert_allclose(without.rate(c.change) / unit, bare_rate(bare, without), rtol=1e-9)


def bare_rate(bare, r):
    slip = r.shapes[1] - r.shapes[2]
    return slip**2 / (2 * r.omega)


def test_the_drop_that_is_asked_for_is_what_luck_gives_the_best_of_the_places():
    """Squares of standard normal numbers, one-sided: of independent places the best exceeds the
    limit about once in five hundred times."""
    z = np.random.default_rng(7).standard_normal((400_000, 5))
    for places in (1, 5):
        best = z[:, :places].max(axis=1)
        luck = np.mean((best > 0) & (best**2 > needed_drop(places, 8)))
        assert luck == pytest.approx(LUCK, rel=0.15)
    assert needed_drop(60, 5) == needed_drop(5, 5) > needed_drop(1, 5)


SPREAD = np.array([16.1, 25.3, 28.4, 28.9, 30.5, 58.0])  # Hz: a frame with nothing concealed


def of(zeta, f=SPREAD, file=0.01):
    """Ratios with a tenth of deviation, of a file that knows one for all."""
    n = len(f)
    return Ratios(zeta, 0.1 * zeta, np.full(n, file), np.eye(n), 2.0 * np.pi * f)


def test_six_ratios_that_happen_to_fall_are_no_law():
    """They pass the test of a law (robust scatter 0.2); one rate of decay was told at 90 %."""
    zeta = np.array([0.01298, 0.01514, 0.01349, 0.01459, 0.009304, 0.007438])
    assert law_odds(of(zeta)) < 0.2
    assert law_odds(of(2.4 / (2.0 * np.pi * SPREAD))) > 0.8


@pytest.mark.parametrize("scatter", [0.25, 0.35])
def test_scattered_ratios_are_called_a_law_once_in_a_hundred_times(scatter):
    """By the test of a law alone three to seven times."""
    rng, n, told, both = np.random.default_rng(5), len(SPREAD), 0, 0
    numbers = np.arange(1, n + 1)
    for _ in range(1000):
        zeta = 0.01 * np.exp(scatter * rng.standard_normal(n))
        modes = (SPREAD, 1e-3 * SPREAD, zeta, 0.1 * zeta, (), None, None, numbers)
        law = decay_rates(ModeTable(Origin("t", "t", "fit"), *modes)).verdict
        told += law == "constant decay rate"
        both += law == "constant decay rate" and law_odds(of(zeta)) >= STATED
    assert both < 0.01 * 1000 < 0.03 * 1000 < told


@pytest.mark.parametrize(
    "parts", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.3, 0.0, 1.0), (0.5, 1.0, 0.5)]
)
def test_a_law_of_all_modes_is_no_mismatch_and_one_mode_that_stands_out_is(parts):
    omega = np.geomspace(60.0, 6000.0, 8)
    scale = np.exp(np.mean(np.log(omega)))
    law = parts[0] * scale / omega + parts[1] + parts[2] * omega / scale
    zeta = 0.004 * law * np.exp(0.2 * np.random.default_rng(5).standard_normal(8))
    most = chi_square(0.997, 8)
    told = Ratios(zeta, 0.05 * zeta, np.full(8, 0.004), np.eye(8), omega)
    assert law_strain(told) < most
    zeta[3] *= 8.0
    assert law_strain(told) > most


def test_no_effect_is_told_at_more_than_it_can_be(chain, lab):
    """A loss factor is below one: ratios that a spring's share of strain energy would need more for
    are not its."""
    heavy = np.array([0.01, 0.6, 0.01, 0.01])
    base = ratios(lab(), np.zeros((4, 4)), np.zeros((4, 4)))
    _, trials = found(chain, replace(base, measured=heavy, std=0.02 * heavy))
    assert all(0.0 < t.size < t.effect.limits[1] for t in trials)


def test_heavy_damping_tells_less_than_light(chain, lab):
    base = ratios(lab(), np.zeros((4, 4)), np.zeros((4, 4)))
    light, heavy = (
        replace(base, measured=z * np.ones(4), std=1e-3 * np.ones(4)) for z in (0.01, 0.5)
    )
    assert np.all(heavy.spread > 0.5) and np.all(light.spread < 1.1 * light.own)


def test_what_a_hidden_oscillator_loses_is_no_damper_elsewhere(chain, lab):
    """Two modes that share an oscillator's motion are damped by its own dashpot."""
    base = ratios(lab(), np.zeros((4, 4)), np.zeros((4, 4)))
    inside = np.array([[0.1, 1.0, 0.8, 0.0]])
    there = replace(base, measured=base.measured + 0.03 * inside[0])
    assert found(chain, there)[0] > 20.0
    before, trials = found(chain, replace(there, swinging=inside))
    assert before < 4.0 and trials == []


def test_what_a_strong_dashpot_adds_may_be_all_of_a_ratio(chain, lab):
    """Noise of a ratio is of all of it; the scatter of what was there before, of that alone."""
    base = ratios(lab(), np.zeros((4, 4)), np.zeros((4, 4)))
    added = np.array([0.09, 0.01, 0.0, 0.0])
    there = replace(base, measured=0.9 * (base.file + added), std=0.1 * (base.file + added))
    assert there.strain(added[None])[0] < 6.0 < 20.0 < there.strain(np.zeros((1, 4)))[0]
