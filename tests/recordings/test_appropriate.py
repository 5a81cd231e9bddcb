"""Force appropriation on systems with known normal modes."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.appropriate import (
    METHODS,
    appropriate,
    asher,
    exciter_places,
    extended_asher,
    mmif,
    modified_asher,
    nash,
    principal_forces,
    traill_nash,
)

N = 5
SQUARE = ("asher", "modified-asher", "traill-nash")


def system(
    close: float | None = None, zeta: float = 0.01, lumped: float = 0.0
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """M, K, C and the normal shapes (modes, N); ``close``: relative spacing of modes 2 and 3;
    ``lumped``: one dashpot's share."""
    m = np.array([2.0, 1.5, 1.0, 1.7, 0.8])
    k = np.array([9.0, 6.0, 8.0, 5.0, 7.0, 4.0]) * 1e5
    M, K = np.diag(m), np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    w2, phi = scipy.linalg.eigh(K, M)
    w = np.sqrt(w2)
    if close is not None:
        w[2] = w[1] * (1.0 + close)
        K = M @ phi @ np.diag(w**2) @ phi.T @ M
    C = M @ phi @ np.diag(2 * zeta * w) @ phi.T @ M
    C[1, 1] += lumped
    return M, K, C, phi.T


def receptance(f: NDArray, M: NDArray, K: NDArray, C: NDArray) -> NDArray:
    w = 2 * np.pi * f[:, None, None]
    return np.linalg.inv(K - w**2 * M + 1j * w * C)


def mac(a: NDArray, b: NDArray) -> float:
    return float((a @ b) ** 2 / ((a @ a) * (b @ b)))


def natural(M: NDArray, K: NDArray) -> NDArray:
    return np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)) / (2 * np.pi)


def test_indicators_solve_the_equations_that_they_cite() -> None:
    """On any H, at every line: (2.38) Re H f = λ Im H f, (2.41) Re Hᵀ Re H f = α f, (2.43)
    Re Hᵀ Re H f = β (Re Hᵀ Re H + Im Hᵀ Im H) f, (2.44) Im Hᵀ Im H f = γ (the same) f."""
    M, K, C, _ = system(lumped=3.0)
    H = receptance(np.linspace(40.0, 200.0, 7), M, K, C)[:, :, :3]
    R, J = H.real, H.imag
    RR, JJ = R.transpose(0, 2, 1) @ R, J.transpose(0, 2, 1) @ J
    for indicator, left, right in (
        (extended_asher, RR, np.broadcast_to(np.eye(3), RR.shape)),
        (mmif, RR, RR + JJ),
        (nash, JJ, RR + JJ),
    ):
        values, forces = indicator(H)
        off = left @ forces - right @ forces * values[:, None, :]
        assert np.abs(off).max(axis=(1, 2)) == pytest.approx(
            np.zeros(7), abs=1e-10 * float(np.abs(left).max())
        )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("accelerance", [False, True])
def test_normal_modes_at_light_damping(method: str, accelerance: bool) -> None:
    M, K, C, phi = system()
    f = natural(M, K)
    # alpha is not normalised: with as many exciters as modes its minima are very narrow, and need
    # fine lines
    lines = np.linspace(0.6 * f[0], 1.15 * f[-1], 12_000 if method == "extended-asher" else 3000)
    H = receptance(lines, M, K, C)
    if accelerance:
        H = -((2 * np.pi * lines[:, None, None]) ** 2) * H
    found = appropriate(lines, H, method)
    assert found.frequency == pytest.approx(f, rel=1e-5)
    assert min(mac(a, b) for a, b in zip(found.shapes, phi, strict=True)) > 0.999
    assert np.all(found.purity > 0.999)
    # a pure mode is driven by the force pattern M phi
    assert min(mac(a, M @ b) for a, b in zip(found.forces, phi, strict=True)) > 0.99


@pytest.mark.parametrize("method", ["modified-asher", "traill-nash", "mmif", "nash"])
def test_close_pair_is_separated(method: str) -> None:
    M, K, C, phi = system(close=0.01)
    f = natural(M, K)
    lines = np.linspace(0.7 * f[1], 1.3 * f[2], 3001)
    found = appropriate(lines, receptance(lines, M, K, C), method)
    assert found.frequency == pytest.approx(f[1:3], rel=1e-4)
    assert min(mac(a, b) for a, b in zip(found.shapes, phi[1:3], strict=True)) > 0.999


def test_one_exciter_cannot_separate_the_close_pair_but_two_can() -> None:
    M, K, C, phi = system(close=0.01)
    f = natural(M, K)
    lines = np.linspace(0.9 * f[1], 1.1 * f[2], 2001)
    H = receptance(lines, M, K, C)
    alone = appropriate(lines, H[:, :, [0]], threshold=0.9)
    both = appropriate(lines, H[:, :, [0, 2]])
    assert both.frequency == pytest.approx(f[1:3], rel=2e-3)
    assert min(mac(a, b) for a, b in zip(both.shapes, phi[1:3], strict=True)) > 0.98
    worst = [max((mac(a, b) for a in alone.shapes), default=0.0) for b in phi[1:3]]
    assert min(worst) < 0.98


def test_degradation_with_non_proportional_damping() -> None:
    """Worst MAC falls gracefully as one dashpot grows: printed with pytest -s."""
    table = []
    for lumped in (0.0, 20.0, 100.0, 400.0):
        M, K, C, phi = system(lumped=lumped)
        f = natural(M, K)
        lines = np.linspace(0.6 * f[0], 1.15 * f[-1], 3000)
        H = receptance(lines, M, K, C)
        # fewer exciters than modes: full appropriation could undo any damping
        found = appropriate(lines, H[:, :, [0, 2]], "mmif", threshold=0.5)
        table.append([max((mac(a, b) for a in found.shapes), default=0.0) for b in phi])
    worst = [min(row) for row in table]
    print("\nworst MAC by dashpot:", np.round(worst, 4))
    assert worst[0] > 0.99
    assert worst[0] > worst[1] > worst[2] > worst[3]


@given(st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_curves_keep_their_bounds_and_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    H = rng.standard_normal((4, 7, 3)) + 1j * rng.standard_normal((4, 7, 3))
    beta, forces = mmif(H)
    gamma, _ = nash(H)
    assert np.all((beta >= 0.0) & (beta <= 1.0))
    assert gamma[:, ::-1] == pytest.approx(1.0 - beta, abs=1e-9)
    # no force does better than the first eigenvector
    f = rng.standard_normal(3)
    x = H @ f
    cost = np.sum(x.real**2, axis=1) / np.sum(np.abs(x) ** 2, axis=1)
    assert np.all(cost >= beta[:, 0] - 1e-9)
    best = np.einsum("fij,fj->fi", H, forces[:, :, 0])
    assert np.sum(best.real**2, axis=1) / np.sum(np.abs(best) ** 2, axis=1) == pytest.approx(
        beta[:, 0], abs=1e-9
    )


def test_square_eigenproblems_are_what_they_say() -> None:
    M, K, C, _ = system()
    H = receptance(np.array([40.0, 90.0, 111.0]), M, K, C)
    values, forces = modified_asher(H)
    assert H.real @ forces == pytest.approx(forces * values[:, None, :], abs=1e-12)
    mu, g = traill_nash(H)
    assert H.real @ g == pytest.approx((H.imag @ g) * mu[:, None, :], rel=1e-6, abs=1e-12)
    determinant = asher(H)[0][:, 0]
    assert np.sign(determinant) == pytest.approx(np.sign(np.linalg.det(H.real)))
    assert np.abs(determinant) ** N == pytest.approx(np.abs(np.linalg.det(H.real)), rel=1e-6)


def test_principal_forces_cure_surplus_exciters() -> None:
    # two modes in the band, five exciters: Im H is singular but for rounding and residuals
    M, K, C, phi = system()
    f = natural(M, K)
    lines = np.linspace(0.8 * f[0], 0.5 * (f[1] + f[2]), 2000)
    rng = np.random.default_rng(0)
    H = receptance(lines, M, K, C)
    H = H * (1.0 + 0.002 * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)))
    V = principal_forces(H, count=2)
    assert pytest.approx(np.eye(2), abs=1e-12) == V.T @ V
    found = appropriate(lines, H, "traill-nash", principal=V)
    near = [int(np.argmin(np.abs(found.frequency - g))) for g in f[:2]]
    assert found.frequency[near] == pytest.approx(f[:2], rel=1e-3)
    assert min(mac(found.shapes[k], p) for k, p in zip(near, phi[:2], strict=True)) > 0.999


def test_exciter_places_are_the_best_of_all() -> None:
    from itertools import combinations

    _, _, _, phi = system()
    places = exciter_places(phi[:3], 3)
    every = {
        c: np.linalg.svd(phi[:3][:, c], compute_uv=False)[-1] for c in combinations(range(N), 3)
    }
    assert places.columns == max(every, key=lambda c: every[c])
    assert places.purity == pytest.approx(np.ones(3))
    # the forces drive one mode each
    assert places.forces @ phi[:3, list(places.columns)].T == pytest.approx(
        np.diag(np.diag(places.forces @ phi[:3, list(places.columns)].T)), abs=1e-12
    )
    # a node of the mode is never chosen for a single exciter
    shapes = np.array([[0.0, 1.0, 0.4]])
    assert exciter_places(shapes, 1).columns == (1,)
    assert exciter_places(shapes, 1, candidates=(0, 2)).columns == (2,)
    with pytest.raises(RecordingError, match="cannot be placed"):
        exciter_places(shapes, 4)


def test_messages() -> None:
    H = np.ones((5, 3, 2), dtype=complex)
    for method in SQUARE:
        with pytest.raises(RecordingError, match="square"):
            appropriate(np.arange(1.0, 6.0), H, method)
    with pytest.raises(RecordingError, match="mmif"):
        appropriate(np.arange(1.0, 6.0), H, "dorfman")
