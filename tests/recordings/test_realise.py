"""Real modes from complex ones, on systems whose normal modes are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.realise import (
    ahmadian_gladwell,
    chen_hsu_tsuei,
    complexity_area,
    complexity_phase,
    ibrahim_fill,
    ibrahim_state,
    imregun_ewins,
    niedbal,
    normal_frf,
    normal_poles,
    normal_stiffness,
    phase_collinearity,
    simple,
)
from cvxupdate.recordings.realise.shape import mac_with

N = 6


def matrices(close: bool) -> tuple[NDArray, NDArray, NDArray]:
    """Unsymmetric chain; ``close`` adds two nearly equal tuned branches: a pair of close modes. C
    is one heavy dashpot."""
    m = np.array([2.0, 1.5, 1.0, 1.7, 0.8, 1.2])
    k = np.array([9.0, 6.0, 8.0, 5.0, 7.0, 4.0, 3.0]) * 1e5
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    if close:
        K = np.zeros((N, N))
        for i, j, v in [
            (0, -1, 2e7),
            (0, 1, 4e5),
            (1, 2, 3e5),
            (0, 3, 4.05e5),
            (3, 4, 3.02e5),
            (0, 5, 9e5),
        ]:
            K[i, i] += v
            if j >= 0:
                K[j, j] += v
                K[i, j] -= v
                K[j, i] -= v
        m = np.array([20.0, 1.0, 1.0, 1.0, 1.0, 0.4])
    C = np.zeros((N, N))
    C[1, 1] = 1.0
    C[3:5, 3:5] += 0.3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.diag(m), K, C


def modes(
    close: bool, damping: float
) -> tuple[NDArray, NDArray, NDArray, NDArray, tuple[NDArray, NDArray, NDArray]]:
    """Normal frequencies (Hz) and shapes, complex poles and shapes; ``damping``: the largest
    fraction of critical."""
    M, K, C = matrices(close)

    def complex_modes(scale: float) -> tuple[NDArray, NDArray]:
        A = np.block(
            [
                [np.zeros((N, N)), np.eye(N)],
                [-np.linalg.solve(M, K), -np.linalg.solve(M, scale * C)],
            ]
        )
        s, v = np.linalg.eig(A)
        keep = np.flatnonzero(s.imag > 0)
        keep = keep[np.argsort(np.abs(s[keep]))]
        return s[keep], v[:N, keep].T

    first = complex_modes(1.0)[0]
    scale = damping / float(np.max(-first.real / np.abs(first)))
    poles, shapes = complex_modes(scale)
    w2, phi = scipy.linalg.eigh(K, M)
    rng = np.random.default_rng(0)
    shapes = shapes * np.exp(2j * np.pi * rng.random(poles.size))[:, None]
    return np.sqrt(w2) / (2 * np.pi), phi.T, poles, shapes, (M, K, scale * C)


def mac(a: NDArray, b: NDArray) -> float:
    return float((a @ b) ** 2 / ((a @ a) * (b @ b)))


def receptance(f: NDArray, M: NDArray, K: NDArray, C: NDArray) -> NDArray:
    w = 2 * np.pi * f[:, None, None]
    return np.linalg.inv(K - w**2 * M + 1j * w * C)


def fill(poles: NDArray, shapes: NDArray) -> NDArray:
    f, phi, *_ = modes(False, 0.01)
    return ibrahim_fill(poles[:4], shapes[:4], f[4:], phi[4:])[1]


SHAPE_ONLY: dict[str, Callable[[NDArray, NDArray], NDArray]] = {
    "simple": lambda p, s: simple(s),
    "ahmadian-gladwell": lambda p, s: ahmadian_gladwell(s),
    "imregun-ewins": lambda p, s: imregun_ewins(s),
    "niedbal": lambda p, s: niedbal(s),
}
WITH_DAMPING: dict[str, Callable[[NDArray, NDArray], NDArray]] = {
    "ibrahim state": lambda p, s: ibrahim_state(p, s)[1],
    "ibrahim fill": lambda p, s: ibrahim_fill(p, s, np.zeros(0), np.zeros((0, N)))[1],
}


@pytest.mark.parametrize("method", [*SHAPE_ONLY, *WITH_DAMPING])
def test_light_damping_gives_the_normal_modes(method: str) -> None:
    _, phi, poles, shapes, _ = modes(False, 0.01)
    real = {**SHAPE_ONLY, **WITH_DAMPING}[method](poles, shapes)
    assert np.isrealobj(real) and real.shape == phi.shape
    assert min(mac(a, b) for a, b in zip(real, phi, strict=True)) > 0.999


def test_degradation_table() -> None:
    """Worst MAC with the normal modes, by method, damping (largest ratio) and spacing: printed with
    pytest -s."""
    worst: dict[str, list[float]] = {}
    cases = [(False, 0.01), (False, 0.05), (False, 0.15), (True, 0.002), (True, 0.01), (True, 0.05)]
    for close, damping in cases:
        _, phi, poles, shapes, _ = modes(close, damping)
        for name, method in {**SHAPE_ONLY, **WITH_DAMPING}.items():
            real = method(poles, shapes)
            worst.setdefault(name, []).append(
                min(mac(a, b) for a, b in zip(real, phi, strict=True))
            )
    print(
        "\nworst MAC       " + "".join(f"{'close' if c else 'apart':>7}{d:5.1%}" for c, d in cases)
    )
    for name, row in worst.items():
        print(f"{name:<18}" + "".join(f"{v:12.5f}" for v in row))
    for name in SHAPE_ONLY:
        # more damping is never better, and close modes suffer at a damping that separate modes
        # forgive
        apart, close = worst[name][:3], worst[name][3:]
        assert apart[0] > apart[1] > apart[2]
        assert close[0] > close[1] > close[2] - 1e-3
        assert close[1] < apart[0]
    for name in WITH_DAMPING:
        # complete sets: the damping is identified and taken off, exactly
        assert min(worst[name]) > 1.0 - 1e-8


def test_close_heavily_damped_modes_defeat_every_method_that_only_sees_shapes() -> None:
    f, phi, poles, shapes, _ = modes(True, 0.05)
    assert np.min(np.diff(f) / f[:-1]) < 0.03
    for name in ("simple", "ahmadian-gladwell", "imregun-ewins"):
        real = SHAPE_ONLY[name](poles, shapes)
        assert min(mac(a, b) for a, b in zip(real, phi, strict=True)) < 0.9


@pytest.mark.parametrize("close", [False, True])
def test_ibrahim_gives_undamped_frequencies(close: bool) -> None:
    f, _, poles, shapes, _ = modes(close, 0.1)
    assert ibrahim_state(poles, shapes)[0] == pytest.approx(f, rel=1e-7)
    assert ibrahim_fill(poles, shapes, np.zeros(0), np.zeros((0, N)))[0] == pytest.approx(
        f, rel=1e-7
    )


def test_niedbal_undoes_the_transformation_that_it_assumes() -> None:
    """Complex shapes R (I + i T)^-1 of orthonormal real ones R, T antisymmetric (so that no shape
    is turned by a phase of its own): (2.33) with Re of the transformation I, and (2.34) exact."""
    rng = np.random.default_rng(4)
    R = np.linalg.qr(rng.standard_normal((7, 3)))[0]
    T = np.array([[0.0, 0.3, -0.2], [-0.3, 0.0, 0.4], [0.2, -0.4, 0.0]])
    given = R @ np.linalg.inv(np.eye(3) + 1j * T)
    found = niedbal(given.T)
    sign = np.sign(np.sum(found * R.T, axis=1))[:, None]
    assert found * sign == pytest.approx(R.T, abs=1e-12)


def test_a_crossing_is_placed_between_its_lines() -> None:
    """Lines 2 Hz apart: frequency and shape are those of the crossing, not of the line next to
    it."""
    f, phi, *_, (M, K, C) = modes(False, 0.02)
    lines = np.arange(40.0, 232.0, 2.0)
    frequency, shapes = chen_hsu_tsuei(lines, receptance(lines, M, K, C))
    assert frequency == pytest.approx(f, rel=1e-3)
    off = [1.0 - mac(a, b) for a, b in zip(shapes, phi, strict=True)]
    nearest = lines[np.argmin(np.abs(lines[:, None] - f), axis=0)]
    H = receptance(nearest, M, K, C)
    beside = []
    for k, part in enumerate(0.5 * (normal_stiffness(H) + normal_stiffness(H).transpose(0, 2, 1))):
        values, vectors = np.linalg.eigh(part)
        beside.append(1.0 - mac(vectors[:, np.argmin(np.abs(values))], phi[k]))
    assert max(off) < 0.1 * max(beside)


def test_incomplete_sets() -> None:
    f, phi, poles, shapes, _ = modes(False, 0.02)
    frequency, real = ibrahim_state(poles[:3], shapes[:3])
    assert frequency == pytest.approx(f[:3], rel=1e-3)
    assert min(mac(a, b) for a, b in zip(real, phi, strict=False)) > 0.995
    frequency, real = ibrahim_fill(poles[:3], shapes[:3], f[3:], phi[3:])
    assert frequency == pytest.approx(f[:3], rel=1e-3)
    assert min(mac(a, b) for a, b in zip(real, phi, strict=False)) > 0.999
    with pytest.raises(RecordingError, match="do not make 6"):
        ibrahim_fill(poles[:3], shapes[:3], f[4:], phi[4:])
    with pytest.raises(RecordingError, match="are dependent at these channels"):
        ibrahim_fill(poles[:3], shapes[:3], f[3:], phi[[3, 3, 5]] * 1.0)
    with pytest.raises(RecordingError, match="at least as many channels"):
        ibrahim_state(poles, shapes[:, :4])


def test_what_fills_up_is_left_out_wherever_it_lies() -> None:
    """The second mode was missed: the model's own stands in, below some of the measured ones."""
    f, phi, poles, shapes, _ = modes(False, 0.02)
    own = [0, 2, 3]
    others = [1, 4, 5]
    frequency, real = ibrahim_fill(poles[own], shapes[own], f[others], phi[others])
    assert frequency == pytest.approx(f[own], rel=1e-3)
    assert min(mac(a, b) for a, b in zip(real, phi[own], strict=True)) > 0.999


def test_rigid_body_motion_may_fill_up() -> None:
    """A free chain: its rigid-body motion was not measured; complete with it, the method is
    exact."""
    m, k = np.array([2.0, 1.5, 1.0, 1.7]), np.array([6.0, 8.0, 5.0]) * 1e5
    K = np.diag(np.append(k, 0.0) + np.append(0.0, k)) - np.diag(k, 1) - np.diag(k, -1)
    C = 60.0 * np.array([[0, 0, 0, 0], [0, 1, -1, 0], [0, -1, 1, 0], [0, 0, 0, 0]])
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-K / m[:, None], -C / m[:, None]]])
    values, vectors = np.linalg.eig(A)
    keep = np.flatnonzero(values.imag > 1.0)
    keep = keep[np.argsort(np.abs(values[keep]))]
    w2, phi = scipy.linalg.eigh(K, np.diag(m))
    frequency, real = ibrahim_fill(values[keep], vectors[:4, keep].T, np.zeros(1), np.ones((1, 4)))
    assert frequency == pytest.approx(np.sqrt(w2[1:]) / (2 * np.pi), rel=1e-8)
    assert np.abs(np.abs(values[keep]) / np.sqrt(w2[1:]) - 1.0).max() > 1e-4
    assert min(mac(a, b) for a, b in zip(real, phi.T[1:], strict=True)) > 1.0 - 1e-9


@pytest.mark.parametrize("hysteretic", [False, True])
def test_frf_route_is_exact_for_any_damping(hysteretic: bool) -> None:
    f, phi, _, _, (M, K, C) = modes(True, 0.1)
    lines = np.linspace(0.5 * f[0], 1.1 * f[-1], 4000)
    H = receptance(lines, M, K, C)
    if hysteretic:
        D = 2e2 * C
        H = np.linalg.inv(K + 1j * D - (2 * np.pi * lines[:, None, None]) ** 2 * M)
    undamped = K - (2 * np.pi * lines[:, None, None]) ** 2 * M
    # an array at once: pytest.approx takes seconds for its 144,000 numbers
    allowed = np.maximum(1e-7 * np.abs(undamped), 1e-6 * np.abs(K).max())
    assert np.all(np.abs(normal_stiffness(H) - undamped) <= allowed)
    inside = slice(None, None, 97)
    assert normal_frf(H[inside]) @ undamped[inside] == pytest.approx(
        np.broadcast_to(np.eye(N), undamped[inside].shape), abs=1e-5
    )
    for frequency, shapes in (chen_hsu_tsuei(lines, H), normal_poles(lines, normal_frf(H))):
        assert frequency == pytest.approx(f, rel=1e-6)
        assert min(mac(a, b) for a, b in zip(shapes, phi, strict=True)) > 0.9999


def test_as_many_forces_as_modes_act_are_enough() -> None:
    """Two modes that heavy damping couples, six responses, two forces: exact, poles and all; with
    one force a pole that both modes feel is not where it was."""
    f, phi, *_ = modes(False, 0.01)
    w2, own = (2 * np.pi * f[:2]) ** 2, phi[:2].T
    lines = np.linspace(0.7 * f[0], 1.3 * f[1], 6000)
    w = 2 * np.pi * lines[:, None, None]
    coupled = np.array([[60.0, 45.0], [45.0, 90.0]])
    inner = np.diag(w2) - w**2 * np.eye(2)
    H = own @ np.linalg.inv(inner + 1j * w * coupled) @ own[[1, 4]].T
    wanted = own @ np.linalg.inv(inner) @ own[[1, 4]].T
    found = normal_frf(H)
    assert np.abs(found[::7] / wanted[::7] - 1.0).max() < 1e-6
    frequency, shapes = normal_poles(lines, found)
    assert frequency == pytest.approx(f[:2], rel=1e-7)
    assert min(mac(a, b) for a, b in zip(shapes, phi, strict=False)) > 0.9999
    alone = normal_frf(H[:, :, :1])
    assert np.abs(alone / wanted[:, :, :1] - 1.0).max() > 0.1


shapes_strategy = st.integers(0, 10_000).map(
    lambda seed: np.random.default_rng(seed).standard_normal((3, 7, 2)) @ np.array([1.0, 0.6j])
)


@given(shapes_strategy)
@settings(max_examples=40, deadline=None)
def test_best_mac_is_the_largest_eigenvector_and_both_methods_reach_it(shapes: NDArray) -> None:
    rotated, climbed = ahmadian_gladwell(shapes), imregun_ewins(shapes)
    for c, a, b in zip(shapes, rotated, climbed, strict=True):
        # of all real r the ratio |c^H r|² / r^T r is largest for the top eigenvector of Re(c c^H)
        best = np.linalg.eigvalsh(np.real(np.outer(c, np.conj(c))))[-1] / np.vdot(c, c).real
        assert mac_with(c, a) == pytest.approx(best, rel=1e-10)
        assert mac_with(c, b) == pytest.approx(best, rel=1e-7)


@given(shapes_strategy, st.floats(-3.0, 3.0), st.floats(0.1, 10.0))
@settings(max_examples=40, deadline=None)
def test_results_do_not_depend_on_phase_or_scale(
    shapes: NDArray, phase: float, scale: float
) -> None:
    turned = scale * np.exp(1j * phase) * shapes
    for method in (simple, ahmadian_gladwell, niedbal):
        a, b = method(shapes), method(turned)
        assert all(mac(x, y) > 1 - 1e-9 for x, y in zip(a, b, strict=True))
    for factor in (phase_collinearity, complexity_phase, complexity_area):
        assert factor(turned) == pytest.approx(factor(shapes), abs=1e-9)
        assert np.all((factor(shapes) >= 0.0) & (factor(shapes) <= 1.0 + 1e-12))


def test_complexity_of_a_real_shape_and_of_a_travelling_wave() -> None:
    real = np.array([[1.0, -2.0, 0.5, 3.0]]) * np.exp(0.7j)
    wave = np.exp(2j * np.pi * np.arange(64) / 64)[None, :]
    assert phase_collinearity(real) == pytest.approx([1.0])
    assert complexity_phase(real) == pytest.approx([0.0], abs=1e-12)
    assert complexity_area(real) == pytest.approx([0.0], abs=1e-12)
    assert phase_collinearity(wave) == pytest.approx([0.0], abs=1e-12)
    assert complexity_phase(wave) == pytest.approx([1.0], abs=0.02)
    # regular 64-gon
    assert complexity_area(wave) == pytest.approx([32 / np.pi * np.sin(np.pi / 32)], rel=1e-9)


def test_messages() -> None:
    with pytest.raises(RecordingError, match="independent shapes"):
        niedbal(np.ones((5, 3), dtype=complex))
    with pytest.raises(RecordingError, match="as many responses as forces"):
        normal_frf(np.ones((4, 2, 3), dtype=complex))
