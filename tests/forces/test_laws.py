"""Laws of internal force against what defines them: tangents by complex step, energies and areas of
loops in closed form, Masing's rule, a law by its differential equation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from cvxupdate import forces as nl
from cvxupdate.errors import ModelError

BATCH = nl.join(
    [
        nl.linear(40.0, 3.0),
        nl.cubic([200.0, -90.0], [0.0, 30.0], [25.0, 0.0]),
        nl.clearance([500.0, 500.0], [0.11, -0.13]),
        nl.clearance(300.0, 0.1, "two"),
        nl.jenkins([50.0, 80.0], [4.0, 7.0], [0.0, 0.03]),
        nl.bouc_wen([60.0, 60.0], [5.0, 5.0], [1.0, 2.3], [0.5, 0.8]),
        nl.quadratic(12.0),
    ]
)


def loop(amplitude: float, points: int = 4001, turns: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0.0, 2.0 * np.pi * turns, points)
    return amplitude * np.sin(t), amplitude * np.cos(t)


def area(x: np.ndarray, f: np.ndarray) -> float:
    """∮ f dx over the last turn of two, f straight between samples."""
    half = len(x) // 2
    return float(np.sum(0.5 * (f[half + 1 :] + f[half:-1]) * np.diff(x[half:])))


@pytest.mark.parametrize("x", [0.07, 0.21, -0.22])
@pytest.mark.parametrize("v", [0.8, -0.5])
def test_tangents_are_derivatives(x: float, v: float) -> None:
    state = BATCH.start(0.02)
    at, rate = np.full(BATCH.size, x), np.full(BATCH.size, v)
    got = BATCH.respond(at, rate, state)
    dx = BATCH.respond(at + 1e-30j, rate + 0j, state).force.imag / 1e-30
    dv = BATCH.respond(at + 0j, rate + 1e-30j, state).force.imag / 1e-30
    exact = BATCH.kinds != nl.NAMES.index("bouc_wen")  # which is integrated
    np.testing.assert_allclose(got.stiffness[exact], dx[exact], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(got.stiffness, dx, atol=1e-5 * 60.0)
    np.testing.assert_allclose(got.damping, dv, rtol=1e-12, atol=1e-12)


def test_memoryless_forces_are_the_gradient_of_what_they_store() -> None:
    laws = BATCH.take([0, 1, 2, 3, 4, 5])
    x = np.array([0.05, 0.2, -0.3, 0.2, -0.2, 0.17])
    state = laws.start()
    slope = laws.stored(x + 1e-30j, laws.start(0j)).imag / 1e-30
    np.testing.assert_allclose(slope, laws.force(x, np.zeros(6), state), rtol=1e-12)


def test_contact_pushes_only_beyond_its_gap() -> None:
    laws = nl.join([nl.clearance([10.0, 10.0], [0.1, -0.1]), nl.clearance(10.0, 0.1, "two")])
    x = np.array([[-0.3], [-0.1], [0.0], [0.1], [0.3]])
    force, _ = laws.trace(np.repeat(x, 3, axis=1), np.zeros((5, 3)))
    np.testing.assert_allclose(force[:, 0], [0, 0, 0, 0, 2.0], atol=1e-12)
    np.testing.assert_allclose(force[:, 1], [-2.0, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(force[:, 2], [-2.0, 0, 0, 0, 2.0], atol=1e-12)


def test_loop_of_jenkins_has_its_area() -> None:
    """4 F (X − F/k): a parallelogram; with free play p, 4 F (X − F/k − p/2)."""
    k, limit, play, top = 50.0, 4.0, 0.05, 0.3
    x, v = loop(top)
    plain, _ = nl.jenkins(k, limit).trace(x[:, None], v[:, None])
    loose, _ = nl.jenkins(k, limit, play).trace(x[:, None], v[:, None])
    assert area(x, plain[:, 0]) == pytest.approx(4 * limit * (top - limit / k), rel=1e-4)
    assert area(x, loose[:, 0]) == pytest.approx(4 * limit * (top - limit / k - play / 2), rel=1e-4)
    small, _ = nl.jenkins(k, limit).trace(x[:, None] * 0.2, v[:, None])
    assert area(x * 0.2, small[:, 0]) == pytest.approx(0.0, abs=1e-12)  # never slips


def test_free_play_follows_a_reversal() -> None:
    """From slip: F/k back to no force, the play at no force, then F/k to slip the other way."""
    laws = nl.jenkins(100.0, 5.0, 0.04)
    back = np.array([0.5, 0.45, 0.43, 0.41, 0.36, 0.30])[:, None]
    force, _ = laws.trace(
        back, np.zeros_like(back), laws.respond(np.array([0.5]), np.zeros(1), laws.start()).state
    )
    np.testing.assert_allclose(force[:, 0], [5.0, 0.0, 0.0, 0.0, -5.0, -5.0], atol=1e-12)


def test_masing() -> None:
    """After a reversal an Iwan element follows its virgin curve twice as large (Masing 1926)."""
    laws = nl.iwan([30.0, 50.0, 20.0], [1.0, 3.0, 4.0])
    rise = np.linspace(0.0, 0.17, 400)
    path = np.concatenate([rise, 0.17 - 2.0 * rise])
    each, _ = laws.trace(np.repeat(path[:, None], 3, axis=1), np.zeros((800, 3)))
    total = each.sum(axis=1)
    virgin, branch = total[:400], total[400:]
    np.testing.assert_allclose((total[399] - branch) / 2.0, virgin, atol=1e-12)
    assert virgin[1] / rise[1] == pytest.approx(100.0)  # its initial stiffness: all of them


@pytest.mark.parametrize(("n", "gamma"), [(1.0, 0.5), (2.0, 0.5), (1.7, 0.8)])
def test_bouc_wen_by_its_differential_equation(n: float, gamma: float) -> None:
    k, limit, top = 60.0, 5.0, 0.4

    def rate(t: float, u: np.ndarray) -> np.ndarray:
        dx = top * np.cos(t)
        return (
            (
                dx
                - (1 - gamma) * abs(dx) * np.sign(u) * abs(u) ** n * np.sign(u) * np.sign(dx)
                - gamma * abs(dx) * np.sign(u) * abs(u) ** n
            )
            * k
            / limit
        )

    times = np.linspace(0.0, 4.0 * np.pi, 4001)
    x, v = loop(top)
    exact = solve_ivp(
        rate, (0, times[-1]), [0.0], t_eval=times, rtol=1e-10, atol=1e-12, max_step=0.02
    )
    force, _ = nl.bouc_wen(k, limit, n, gamma).trace(x[:, None], v[:, None])
    assert np.max(np.abs(force[:, 0] - limit * exact.y[0])) < 2e-4 * limit


def test_one_long_move_takes_bouc_wen_to_its_limit_at_once() -> None:
    """Ten thousand times the distance of the knee in one step, and as far back."""
    law = nl.bouc_wen(70.0, 7.0, [1.0, 2.0], 0.5)
    x = np.array([0.0, 1e3, -1e3])[:, None] * np.ones(2)
    force, _ = law.trace(x, np.gradient(x, axis=0))
    np.testing.assert_allclose(force[1:], np.array([[7.0, 7.0], [-7.0, -7.0]]), rtol=1e-8)


def test_loop_of_bouc_wen_has_its_area() -> None:
    """n = 1, γ = 1/2: unloading is straight and loading u = 1 − (1 − u₀) e^{−ξ}, so in the steady
    state both branches and their area are known in closed form."""
    k, limit, top = 60.0, 5.0, 0.25
    span = 2.0 * top * k / limit  # of ξ, over a branch

    def end(u: float) -> float:
        """u at the end of a branch that begins at −u."""
        return 1.0 - np.exp(-(span - u))

    tip = 0.5
    for _ in range(200):
        tip = end(tip)

    def branch(xi: float) -> float:
        return -tip + xi if xi <= tip else 1.0 - np.exp(-(xi - tip))

    half = quad(branch, 0.0, span, points=[tip])[0]
    work = 2.0 * half * limit * limit / k
    x, v = loop(top, 18001, 6.0)
    force, _ = nl.bouc_wen(k, limit).trace(x[:, None], v[:, None])
    last = slice(15000, None)
    got = float(np.sum(0.5 * (force[last][1:, 0] + force[last][:-1, 0]) * np.diff(x[last])))
    assert got == pytest.approx(work, rel=2e-4)


def test_dissipation_is_work_less_what_is_stored_and_never_negative() -> None:
    rng = np.random.default_rng(4)
    path = np.cumsum(rng.normal(0.0, 0.02, 3000))
    laws = BATCH.take([6, 7, 8])
    x = np.repeat(path[:, None], 3, axis=1)
    force, state = laws.trace(x, np.zeros_like(x))
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x, axis=0), axis=0)
    lost = work - laws.stored(x[-1], state)
    assert np.all(lost > 0.0)


def test_events_change_sign_where_something_happens() -> None:
    laws = nl.join([nl.clearance(10.0, -0.1), nl.jenkins(10.0, 1.0, 0.02), nl.cubic(1.0)])
    e = laws.events(np.array([-0.2, 0.13, 1.0]), np.array([1.0, -2.0, 3.0]), laws.start())
    assert e[0, 0] == pytest.approx(0.1) and np.isnan(e[0, 1:]).all()
    assert e[1, 1] == -2.0 and e[1, 2] == pytest.approx(0.2)
    assert np.isnan(e[2]).all()


def test_columns_are_forces_per_coefficient() -> None:
    """Every column times its coefficient is the law's own force."""
    rng = np.random.default_rng(2)
    x = np.cumsum(rng.normal(0.0, 0.05, (500, 2)), axis=0)
    v = np.gradient(x, 0.01, axis=0)
    slips, limits = np.array([0.02, 0.1, 0.3]), np.array([1.5, 0.0, 2.5])
    iwan = nl.jenkins_columns(x, slips) @ limits
    for place in (0, 1):
        path, rate = np.repeat(x[:, [place]], 3, axis=1), np.repeat(v[:, [place]], 3, axis=1)
        own, _ = nl.jenkins(limits / slips + 1e-300, limits).trace(path, rate)
        np.testing.assert_allclose(iwan[:, place], own.sum(axis=1), atol=1e-10)
    for gap, both in ((0.2, False), (-0.3, False), (0.1, True)):
        own, _ = nl.clearance([7.0, 7.0], gap, "two" if both else "one").trace(x, v)
        np.testing.assert_allclose(
            7.0 * nl.contact_columns(x, [gap], both)[..., 0], own, atol=1e-12
        )
    pairs = [
        (nl.cubic_column(x), nl.cubic([7.0, 7.0])),
        (nl.signed_square_column(x), nl.cubic(0.0, [7.0, 7.0])),
        (nl.even_column(x), nl.cubic(0.0, 0.0, [7.0, 7.0])),
        (nl.quadratic_column(v), nl.quadratic([7.0, 7.0])),
        (nl.friction_column(v), nl.friction([7.0, 7.0])),
        (nl.bouc_wen_columns(x, [0.1], 2.0), nl.bouc_wen(70.0, [7.0, 7.0], 2.0)),
    ]
    for column, laws in pairs:
        np.testing.assert_allclose(7.0 * column[..., 0], laws.trace(x, v)[0], atol=1e-9)
    near = nl.friction_column(v, 1e-6)
    assert np.max(np.abs(near - nl.friction_column(v))) < 1e-3


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(ModelError, match="gap must be 0 or more"):
        nl.clearance(1.0, -0.1, "two")
    with pytest.raises(ModelError, match="k must be above 0"):
        nl.jenkins(0.0, 1.0)
    with pytest.raises(ModelError, match="has no 'k3'"):
        nl.friction(1.0).parameter(0, "k3")
