"""The march of many variants: against closed forms and against scipy's integrator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cvxupdate.diagnose.motion.march import Variants, marched, propagators
from cvxupdate.forces import Laws, clearance, cubic, friction, jenkins, quadratic
from cvxupdate.forces.laws import join

OMEGA, ZETA, RATE = 2.0 * np.pi * 9.0, 0.03, 3200.0


def one(laws: Laws) -> Variants:
    """A mass of 1 kg on a spring and a dashpot, driven and held at the mass."""
    shape, none = np.ones((1, 1, 1)), np.zeros((1, 1))
    lam, slow = np.array([[OMEGA**2]]), np.array([[2.0 * ZETA * OMEGA]])
    values = np.asarray(laws.values, dtype=float)[None]
    return Variants(lam, slow, shape, shape, none, none, laws.kinds, values)


def drive() -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(2400) / RATE
    return t, 40.0 * np.sin(2.0 * np.pi * 8.0 * t) * np.minimum(1.0, 4.0 * t)


@pytest.mark.parametrize("lam", [0.0, 3.0, 4e3])
def test_a_propagator_is_the_exact_answer_to_a_ramp(lam: float) -> None:
    """From rest under F = τ: η = (τ − 2ζ/ω)/ω² + decaying part; of a rigid body τ³/6."""
    h, slow = 0.02, 0.7 if lam else 0.0
    P = propagators(np.array(lam), np.array(slow), h)
    sol = solve_ivp(
        lambda t, y: [y[1], t / h - slow * y[1] - lam * y[0]],
        (0, h),
        [0, 0],
        rtol=1e-11,
        atol=1e-16,
    )
    assert P[0, 3] == pytest.approx(sol.y[0, -1], rel=1e-7)
    assert P[1, 3] / h == pytest.approx(sol.y[1, -1], rel=1e-7)


@pytest.mark.parametrize(
    ("laws", "force"),
    [
        (cubic(3e6), lambda x, v: 3e6 * x**3),
        (quadratic(4.0), lambda x, v: 4.0 * v * abs(v)),
        (clearance(2e4, 0.006), lambda x, v: 2e4 * max(x - 0.006, 0.0)),
        (friction(6.0), lambda x, v: 6.0 * np.tanh(v / 1e-5)),
    ],
    ids=["cubic", "quadratic", "clearance", "friction"],
)
def test_the_march_agrees_with_scipy(laws: Laws, force) -> None:
    t, f = drive()
    _, x, _ = marched(one(laws), f[:, None], RATE)

    def rate(s: float, y: np.ndarray) -> list[float]:
        own = np.interp(s, t, f) - 2.0 * ZETA * OMEGA * y[1] - OMEGA**2 * y[0]
        return [y[1], own - force(*y)]

    sol = solve_ivp(
        rate, (0.0, t[-1]), [0.0, 0.0], "LSODA", t, rtol=1e-8, atol=1e-11, max_step=2.0 / RATE
    )
    gap = np.linalg.norm(x[0, :, 0] - sol.y[0]) / np.linalg.norm(sol.y[0])
    assert gap < 3e-3


def test_friction_holds_what_it_can() -> None:
    """A drive below the limit moves nothing beyond one step's slip."""
    _, f = drive()
    force, x, _ = marched(one(friction(100.0)), f[:, None], RATE)
    assert np.abs(x).max() < 1e-12
    np.testing.assert_allclose(force[0, 1:, 0], f[1:], atol=1e-9)


def test_variants_do_not_hear_one_another() -> None:
    """Two variants at once are the two alone."""
    _, f = drive()
    a, b = one(cubic(3e6)), one(cubic(5e6))
    both = Variants(
        *(
            np.concatenate([getattr(a, n), getattr(b, n)])
            for n in ("lam", "slow", "drive", "place")
        ),
        a.beside,
        a.between,
        a.kinds,
        np.concatenate([a.values, b.values]),
    )
    together = marched(both, f[:, None], RATE)[1]
    for k, v in enumerate((a, b)):
        np.testing.assert_array_equal(together[k], marched(v, f[:, None], RATE)[1][0])


def test_a_spring_that_softens_until_nothing_holds_is_seen_at_the_end() -> None:
    """Whoever marches looks at the last sample: what has grown beyond all bounds stays so."""
    _, f = drive()
    with np.errstate(all="ignore"):
        force, _, _ = marched(one(cubic(-3e8)), f[:, None], RATE)
    assert not np.isfinite(force[0, -1, 0])


def test_one_place_is_marched_as_one_of_several() -> None:
    """Beside a second place whose law does nothing the first does what it does alone."""
    _, f = drive()
    for laws in (cubic(3e6), friction(6.0), clearance(2e4, 0.006), jenkins(3e3, 8.0)):
        alone = one(laws)
        both = replace(
            one(join([laws, cubic(0.0)])),
            place=np.array([[[1.0, 0.4]]]),
            beside=np.zeros((2, 1)),
            between=np.zeros((2, 2)),
        )
        ours, theirs = (marched(v, f[:, None], RATE) for v in (alone, both))
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(a[0, :, 0], b[0, :, 0], atol=1e-9 * np.abs(a).max())
