"""Harmonic balance and continuation: closed forms, and the steady state of the integrator."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate import forces as nl
from cvxupdate.errors import InputError
from cvxupdate.simulate import follow, harmonic_balance, simulate, system_of

TO_GROUND = np.array([[0.0], [1.0], [0.0]])


def one(law, k=100.0, c=0.6, m=1.0):
    return system_of([[m]], [[c]], [[k]], law, [[1.0]], [[1.0]], [[1.0]])


def test_linear_is_the_frequency_response():
    got = harmonic_balance(one(nl.linear(30.0, 0.2)), [3.0], 1.7)
    w = 2 * np.pi * 1.7
    assert got.displacement[0, 1] == pytest.approx(3.0 / (130.0 - w**2 + 0.8j * w), rel=1e-9)
    assert np.abs(got.displacement[0, [0, 2, 3]]).max() < 1e-12


def test_one_harmonic_of_duffing_is_the_closed_form():
    """(ω₀² − Ω² + ¾ k3 X²)² X² + (cΩX)² = p² (Worden and Tomlinson 2001, section 3.3)."""
    k3, p = 800.0, 5.0
    for got in follow(one(nl.cubic(k3)), [p], 1.0, 2.6, harmonics=1, points=40):
        w, X = 2 * np.pi * got.frequency, abs(got.displacement[0, 1])
        left = ((100.0 - w**2 + 0.75 * k3 * X**2) * X) ** 2 + (0.6 * w * X) ** 2
        assert left == pytest.approx(p**2, rel=1e-6)


def test_the_branch_goes_around_its_folds():
    """A hardening peak leans over: three answers at one frequency, amplitude on its backbone at the
    top, where the force balances damping alone."""
    k3, p = 800.0, 5.0
    branch = follow(one(nl.cubic(k3)), [p], 1.0, 3.0, harmonics=3, points=40)
    f = np.array([r.frequency for r in branch])
    X = np.array([abs(r.displacement[0, 1]) for r in branch])
    assert np.any(np.diff(f) < 0.0) and f[-1] == pytest.approx(3.0)
    top = int(np.argmax(X))
    backbone = np.sqrt(100.0 + 0.75 * k3 * X[top] ** 2) / (2 * np.pi)
    assert f[top] == pytest.approx(backbone, rel=0.02)
    assert X[top] == pytest.approx(p / (0.6 * 2 * np.pi * f[top]), rel=0.02)


@pytest.mark.parametrize(
    ("law", "harmonics", "close"),
    [
        (nl.cubic(2500.0, 300.0), 11, 1e-3),
        (nl.clearance(900.0, 0.02), 15, 3e-3),
        (nl.jenkins(300.0, 4.0, 0.01), 15, 5e-3),
        (nl.bouc_wen(300.0, 4.0), 15, 3e-3),
        (nl.friction(2.0), 15, 1e-2),
        (nl.quadratic(8.0), 9, 1e-3),
    ],
    ids=["cubic", "contact", "jenkins", "bouc-wen", "friction", "quadratic damping"],
)
def test_it_is_the_steady_state_of_the_integrator(lab, law, harmonics, close):
    system, f, per = lab.three_masses(law, TO_GROUND), 1.3, 256
    got = harmonic_balance(system, [20.0], f, harmonics)
    turns = 60
    phase = 2 * np.pi * np.arange(turns * per + 1) / per
    run = simulate(system, 20.0 * np.cos(phase)[:, None], f * per)
    last = run.displacement[-per - 1 : -1]
    assert np.linalg.norm(got.at(phase[:per]) - last) < close * np.linalg.norm(last)


def test_derivatives_of_the_forces(lab):
    from cvxupdate.simulate.periodic import equations

    laws = nl.join([nl.jenkins(300.0, 4.0), nl.quadratic(3.0)])
    system = lab.three_masses(laws, np.array([[1.0, -1.0], [-1.0, 0.0], [0.0, 1.0]]))
    eq = equations(system, [5.0], 3)
    rng = np.random.default_rng(3)
    X, w = rng.normal(0, 0.05, eq.size), 7.0
    _, J, slope = eq.residual(X, w)
    for k in range(eq.size):
        e = np.zeros(eq.size)
        e[k] = 1e-7
        d = (eq.residual(X + e, w)[0] - eq.residual(X - e, w)[0]) / 2e-7
        np.testing.assert_allclose(J[:, k], d, atol=2e-5 * np.abs(J).max())
    d = (eq.residual(X, w + 1e-5)[0] - eq.residual(X, w - 1e-5)[0]) / 2e-5
    np.testing.assert_allclose(slope, d, atol=1e-4 * np.abs(slope).max() + 1e-9)


def test_faults_are_said():
    with pytest.raises(InputError, match="above 0 Hz"):
        harmonic_balance(one(nl.cubic(1.0)), [1.0], 0.0)
    with pytest.raises(InputError, match="the force must be"):
        harmonic_balance(one(nl.cubic(1.0)), [1.0, 2.0], 1.0)
    with pytest.raises(InputError, match="two different"):
        follow(one(nl.cubic(1.0)), [1.0], 1.0, 1.0)
