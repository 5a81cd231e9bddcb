"""The integrator against closed forms, scipy at tight tolerance, and the balance of energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cvxupdate import forces as nl
from cvxupdate.errors import InputError, ModelError
from cvxupdate.simulate import (
    Start,
    energy_balance,
    modal_system,
    sensitivities,
    simulate,
    system_of,
)

TO_GROUND = np.array([[0.0], [1.0], [0.0]])
BETWEEN = np.array([[-1.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
RATE = 200.0
TIMES = np.arange(0, 6.0, 1.0 / RATE)


FEWER = TIMES[:601]  # for comparisons with scipy, which is two hundred times as slow
SAMPLES = (60.0 * np.cos(9.0 * TIMES) * np.sin(0.7 * TIMES)).tolist()


def push(t):
    """Straight between samples, so that both solve the same equations."""
    if not isinstance(t, float):
        return np.interp(t, TIMES, SAMPLES)
    k = min(int(t * RATE), len(SAMPLES) - 2)
    return SAMPLES[k] + (t * RATE - k) * (SAMPLES[k + 1] - SAMPLES[k])


def one(law, k=100.0, c=0.0, m=1.0):
    return system_of([[m]], [[c]], [[k]], law, [[1.0]], [[1.0]], [[1.0]])


def off(a, b):
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


@pytest.mark.parametrize("coupled", [False, True])
def test_without_laws_the_answer_is_that_of_linear_theory(lab, coupled):
    """A modal sum or complex modes, a spring and a dashpot as a law or in K and C."""
    law = nl.linear(35.0, 1.2)
    system = lab.three_masses(law, TO_GROUND, coupled)
    y = simulate(system, push(FEWER)[:, None], RATE, tolerance=1e-7)
    ref = lab.reference(law, TO_GROUND, push, FEWER, coupled=coupled)
    assert off(y.displacement, ref[:, :3]) < 1e-6
    assert off(y.velocity, ref[:, 3:]) < 1e-6


@pytest.mark.parametrize(
    "law",
    [
        nl.cubic([300.0, -40.0], [0.0, 50.0]),
        nl.clearance([2000.0, 900.0], [0.05, -0.02]),
        nl.clearance([2000.0, 900.0], [0.05, 0.1], "two"),
        nl.quadratic([20.0, 9.0]),
    ],
    ids=["cubic", "contact", "contact on both sides", "quadratic damping"],
)
def test_laws_without_memory_against_scipy(lab, law):
    system = lab.three_masses(law, BETWEEN)
    run = simulate(system, push(FEWER)[:, None], RATE, tolerance=1e-6, keep=True)
    ref = lab.reference(law, BETWEEN, push, FEWER)
    assert off(run.displacement, ref[:, :3]) < 3e-5
    assert off(run.velocity, ref[:, 3:]) < 3e-5
    np.testing.assert_allclose(run.x, run.displacement @ BETWEEN, atol=1e-12)


def test_acceleration_satisfies_the_equation_of_motion(lab):
    law = nl.jenkins([500.0, 300.0], [5.0, 2.0])
    p = push(TIMES)[:, None]
    run = simulate(lab.three_masses(law, BETWEEN), p, RATE)
    left = (
        run.acceleration @ lab.M + run.velocity @ (lab.C + lab.DASHPOT) + run.displacement @ lab.K
    )
    np.testing.assert_allclose(left + run.force @ BETWEEN.T, p @ lab.INPUT.T, atol=1e-9)


@pytest.mark.parametrize(
    "law",
    [
        nl.cubic(2000.0),
        nl.clearance(5000.0, 0.04),
        nl.friction(3.0),
        nl.jenkins(800.0, 6.0, 0.01),
        nl.bouc_wen(800.0, 6.0, 2.0),
        nl.quadratic(8.0),
    ],
    ids=["cubic", "contact", "friction", "jenkins", "bouc-wen", "quadratic damping"],
)
def test_energy_is_balanced(lab, law):
    """To 1e-4 at the default tolerance."""
    system = lab.three_masses(law, TO_GROUND)
    p = push(TIMES)[:, None]
    balance = energy_balance(system, p, RATE, simulate(system, p, RATE, keep=True))
    assert balance.error < 1e-4
    assert balance.supplied > 0.0 and balance.damped > 0.0


def test_free_duffing_has_its_period():
    """T = 4 K(m) / √(ω² + k3 X²), m = k3 X² / 2(ω² + k3 X²): an elliptic integral."""
    from scipy.special import ellipk

    k3, top = 5000.0, 0.3
    stiff = 100.0 + k3 * top**2
    period = 4.0 * ellipk(0.5 * k3 * top**2 / stiff) / np.sqrt(stiff)
    rate = 400.0 / period  # sixteen periods end on a sample
    run = simulate(
        one(nl.cubic(k3)), np.zeros((6401, 1)), rate, Start(np.array([top]), np.zeros(1))
    )
    assert run.displacement[-1, 0] == pytest.approx(top, rel=1e-4)
    assert abs(run.velocity[-1, 0]) < 1e-3 * top * np.sqrt(stiff)


def test_impact_gives_back_its_energy():
    """A free mass meets an elastic stop: it stays π √(m/k) and leaves as fast as it came; with a
    dashpot beside the stop, restitution is e^{−ζπ/√(1−ζ²)} where the stop may pull."""
    k, gap, speed, rate = 4.0e6, 0.01, 2.0, 1000.0
    free = one(nl.clearance(k, gap), k=0.0)
    run = simulate(free, np.zeros((60, 1)), rate, Start(np.zeros(1), np.array([speed])))
    assert run.velocity[-1, 0] == pytest.approx(-speed, rel=1e-4)
    leaves = gap / speed + np.pi * np.sqrt(1.0 / k)
    after = 59.0 / rate - leaves
    assert run.displacement[-1, 0] == pytest.approx(gap - speed * after, rel=1e-3)
    assert run.force.min() >= 0.0


def test_coulomb_stops_where_it_must():
    """Free vibration loses 4F/k of amplitude in a period; it sticks at last within F/k."""
    k, limit, top = 100.0, 2.0, 0.5
    period = 2.0 * np.pi / 10.0
    times = np.arange(0.0, 6.5 * period, period / 64.0)
    run = simulate(
        one(nl.friction(limit), k),
        np.zeros((len(times), 1)),
        64.0 / period,
        Start(np.array([top]), np.zeros(1)),
    )
    x = run.displacement[:, 0]
    for turn in range(1, 6):
        assert x[64 * turn] == pytest.approx(top - 4 * limit / k * turn, abs=2e-3 * top)
    assert np.all(np.abs(run.velocity[-20:, 0]) < 1e-9)  # at rest, not creeping
    assert abs(x[-1]) <= limit / k + 1e-9
    assert run.force[-1, 0] == pytest.approx(-k * x[-1], abs=1e-6)  # what holds it


def test_stick_and_slip_against_scipy(lab):
    """Against Radau with friction made steep but smooth, tanh(v / 1e-5 m/s)."""
    limit, times = 4.0, TIMES[:700]
    p = push(times)
    system = lab.three_masses(nl.friction(limit), TO_GROUND)
    run = simulate(system, p[:, None], RATE)
    inverse, damping = np.linalg.inv(lab.M), lab.C + lab.DASHPOT

    def rate(t, y):
        f = lab.INPUT[:, 0] * np.interp(t, times, p) - damping @ y[3:] - lab.K @ y[:3]
        f[1] -= limit * np.tanh(y[4] / 1e-5)
        return np.concatenate([y[3:], inverse @ f])

    ref = solve_ivp(
        rate, (0, times[-1]), np.zeros(6), t_eval=times, method="Radau", rtol=1e-6, atol=1e-10
    )
    assert off(run.displacement, ref.y[:3].T) < 5e-4
    assert np.mean(np.abs(run.v[:, 0]) < 1e-9) > 0.05  # it does stick


def test_jenkins_follows_its_equation_in_a_system(lab):
    """The slider as a state: scipy's stick and slip by a stiff switch is poor, so the reference is
    the integrator's own limit of short steps, and the trace of the law along its motion."""
    law = nl.jenkins([600.0, 200.0], [5.0, 2.0])
    p = push(TIMES)[:, None]
    coarse = simulate(lab.three_masses(law, BETWEEN), p, RATE)
    fine = simulate(lab.three_masses(law, BETWEEN), p, RATE, tolerance=1e-9)
    assert off(coarse.displacement, fine.displacement) < 1e-4
    dense = np.interp(np.arange(0, TIMES[-1], 1e-4), TIMES, push(TIMES))[:, None]
    many = simulate(lab.three_masses(law, BETWEEN), dense, 1e4)
    force, _ = law.trace(many.x, many.v)
    assert off(many.force, force) < 1e-3


def test_errors_fall_with_the_tolerance(lab):
    law = nl.cubic([300.0, 200.0])
    system, p = lab.three_masses(law, BETWEEN), push(TIMES)[:, None]
    ref = simulate(system, p, RATE, tolerance=1e-11)
    errors = [
        off(simulate(system, p, RATE, tolerance=t).displacement, ref.displacement)
        for t in (1e-4, 1e-6, 1e-8)
    ]
    assert errors[1] < 0.1 * errors[0] and errors[2] < 0.1 * errors[1] and errors[2] < 1e-6


def test_imposed_motion_is_the_force_of_its_spring(lab):
    """A table that moves one end of a spring pushes with k x(t)."""
    table = 0.02 * np.sin(8.0 * TIMES)[:, None]
    law = nl.linear(40.0)
    system = lab.three_masses(law, TO_GROUND)
    moved = simulate(system, np.zeros((len(TIMES), 1)), RATE, offset=table)
    stiff = lab.K + 40.0 * TO_GROUND @ TO_GROUND.T
    none = nl.linear(0.0)
    direct = system_of(lab.M, lab.C + lab.DASHPOT, stiff, none, TO_GROUND, TO_GROUND, np.eye(3))
    dense = np.arange(0.0, TIMES[-1] + 1e-9, 1.0 / (20.0 * RATE))
    wanted = simulate(direct, 0.8 * np.sin(8.0 * dense)[:, None], 20.0 * RATE)
    assert off(moved.displacement, wanted.displacement[::20]) < 3e-6


@pytest.mark.parametrize(
    ("law", "wanted"),
    [
        (nl.cubic([300.0, 100.0], [10.0, 20.0]), [(0, "k3"), (1, "k2")]),
        (nl.clearance([900.0, 700.0], [0.05, -0.03]), [(0, "k"), (1, "gap")]),
        (nl.jenkins([600.0, 200.0], [5.0, 2.0]), [(0, "k"), (1, "force")]),
        (nl.bouc_wen([600.0, 200.0], [5.0, 2.0], 1.5), [(0, "force"), (1, "n")]),
        (nl.quadratic([20.0, 9.0]), [(1, "c2")]),
    ],
    ids=["cubic", "contact", "jenkins", "bouc-wen", "quadratic damping"],
)
@pytest.mark.slow
def test_sensitivities_are_differences(lab, law, wanted):
    times = TIMES[:400]
    p = push(times)[:, None]
    system = lab.three_masses(law, BETWEEN)
    got = sensitivities(system, p, RATE, wanted, tolerance=1e-7)
    for k, place in enumerate(wanted):
        at = law.parameter(*place)
        step = 1e-4 * abs(law.values[at])
        runs = []
        for side in (1.0, -1.0):
            values = law.values.copy()
            values[at] += side * step
            moved = system.with_laws(nl.Laws(law.kinds, values))
            runs.append(simulate(moved, p, RATE, tolerance=1e-9).displacement)
        difference = (runs[0] - runs[1]) / (2.0 * step)
        assert off(got[..., k], difference) < 2e-3


def test_critical_damping_and_rigid_motion():
    """Real complex modes, and a mass that nothing holds."""
    K, M = np.array([[4.0, -4.0], [-4.0, 4.0]]), np.diag([1.0, 2.0])
    C = np.array([[3.0, -1.0], [-1.0, 9.0]])
    law = nl.cubic(6.0)
    times = np.arange(0, 5, 0.02)
    p = np.sin(times)[:, None]
    system = system_of(M, C, K, law, [[1.0], [0.0]], [[0.0], [1.0]], np.eye(2))

    def rate(t, y):
        f = np.array([-6.0 * y[0] ** 3, np.interp(t, times, p[:, 0])])
        return np.concatenate([y[2:], np.linalg.solve(M, f - C @ y[2:] - K @ y[:2])])

    ref = solve_ivp(rate, (0, times[-1]), np.zeros(4), t_eval=times, rtol=1e-10, atol=1e-12)
    assert off(simulate(system, p, 50.0).displacement, ref.y[:2].T) < 1e-4


def test_faults_are_said(lab):
    system = lab.three_masses(nl.cubic(1.0), TO_GROUND)
    with pytest.raises(InputError, match=r"force must be \(samples, 1\)"):
        simulate(system, np.zeros((5, 2)), RATE)
    with pytest.raises(InputError, match="not finite"):
        simulate(system, np.full((5, 1), np.nan), RATE)
    with pytest.raises(InputError, match="modes"):
        simulate(system, np.zeros((5, 1)), RATE, Start(np.zeros(2), np.zeros(2)))
    with pytest.raises(ModelError, match="1 elements"):
        system.with_laws(nl.cubic([1.0, 2.0]))
    with pytest.raises(ModelError, match="mass matrix"):
        system_of([[0.0]], [[0.0]], [[1.0]], nl.cubic(1.0), [[1.0]], [[1.0]], [[1.0]])


def test_modal_system_is_its_matrices(lab):
    """Modes given are as good as matrices given."""
    law = nl.cubic(300.0)
    a = lab.three_masses(law, TO_GROUND)
    b = modal_system(a.omega, a.damping, a.shapes, law, 1)
    p = push(TIMES)[:, None]
    np.testing.assert_allclose(simulate(a, p, RATE).x, simulate(b, p, RATE).x, atol=1e-14)
