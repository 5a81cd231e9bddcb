"""A simulated second of a reduced model of 100 modes with ten Jenkins elements, against scipy's
`solve_ivp` on the same equations at equal error."""

from __future__ import annotations

import time

import numpy as np
from scipy.integrate import solve_ivp

from cvxupdate import forces as nl
from cvxupdate.simulate import modal_system, simulate

MODES, ELEMENTS, RATE = 100, 10, 4000.0


def frame():
    """Modes of 5 to 1000 Hz, 1 % of critical; elements that slip for a good part of the time."""
    rng = np.random.default_rng(7)
    omega = 2.0 * np.pi * np.geomspace(5.0, 1000.0, MODES)
    shapes = rng.normal(size=(MODES, ELEMENTS + 2)) / np.sqrt(MODES)
    laws = nl.jenkins(np.full(ELEMENTS, 2e4), np.linspace(0.5, 3.0, ELEMENTS))
    t = np.arange(0.0, 1.0 + 0.5 / RATE, 1.0 / RATE)
    push = 60.0 * rng.normal(size=len(t))
    spectrum = np.fft.rfft(push)
    spectrum[np.fft.rfftfreq(len(t), 1.0 / RATE) > 200.0] = 0.0
    damping = np.diag(0.02 * omega)
    return modal_system(omega, damping, shapes, laws, 1), t, np.fft.irfft(spectrum, len(t))


def by_scipy(system, t, push, rtol, method):
    """The slider as a state that follows while it slips: as an engineer would write it."""
    at, into, out = system.parts()
    n, k, limit = MODES, system.laws.values[:, 0], system.laws.values[:, 1]
    square, loss = system.omega**2, np.diag(system.damping).copy()
    force, drive = at.T.copy(), into[:, 0]

    def rate(now, y):
        q, u, z = y[:n], y[n : 2 * n], y[2 * n :]
        f, v = k * (force @ q - z), force @ u
        slips = (np.abs(f) >= limit) & (f * v > 0.0)
        f = np.clip(f, -limit, limit)
        i = min(int(now * RATE), len(t) - 2)
        p = push[i] + (push[i + 1] - push[i]) * (now * RATE - i)
        a = drive * p - at @ f - square * q - loss * u
        return np.concatenate([u, a, np.where(slips, v, 0.0)])

    start = np.zeros(2 * n + ELEMENTS)
    run = solve_ivp(rate, (0.0, t[-1]), start, method, t, rtol=rtol, atol=rtol * 1e-5)
    return run.y[:n].T @ out


def timed(work):
    begin = time.process_time()
    found = work()
    return found, time.process_time() - begin


def error(found, exact):
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


def test_a_second_with_ten_jenkins_elements(benchmark):
    system, t, push = frame()
    exact = simulate(system, push[:, None], RATE, tolerance=1e-9).displacement
    rows = []
    for tolerance in (1e-3, 1e-4, 1e-5):
        run, spent = timed(lambda x=tolerance: simulate(system, push[:, None], RATE, tolerance=x))
        rows.append((f"simulate {tolerance:g}", error(run.displacement, exact), spent, run.steps))
    for rtol in (1e-3, 1e-5, 1e-7):
        y, spent = timed(lambda r=rtol: by_scipy(system, t, push, r, "RK45"))
        rows.append((f"solve_ivp RK45 {rtol:g}", error(y, exact), spent, 0))
    for row in rows:
        print("{:24s} error {:8.1e}  CPU {:7.3f} s  steps {}".format(*row))
    own = rows[:3]
    for name, e, spent, _ in rows[3:]:
        equal = [r for r in own if r[1] <= e]
        if equal:
            fastest = min(r[2] for r in equal)
            print(f"{name}: {spent / fastest:.1f} times as long at no smaller error")
    benchmark(lambda: simulate(system, push[:, None], RATE, tolerance=1e-4))
    assert min(r[1] for r in rows[3:]) < 1e-2  # they solve the same equations
