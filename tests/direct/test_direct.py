"""Direct methods: assigned modes to 1e-8, equality with the convex program that each one solves,
orders of accuracy, and their known faults."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate import direct as d
from cvxupdate.errors import InputError


def chain(k, m, ground=1.3):
    """A chain on a ground spring with a spring that skips one mass: no symmetry, banded but not
    tridiagonal."""
    n = len(m)
    K = np.zeros((n, n))
    K[0, 0] = ground
    for i in range(n - 1):
        K[np.ix_([i, i + 1], [i, i + 1])] += k[i] * np.array([[1, -1], [-1, 1]])
    K[np.ix_([1, 4], [1, 4])] += 0.4 * np.array([[1, -1], [-1, 1]])
    M = np.diag(m)
    for i in range(n - 1):  # a little consistent mass
        M[np.ix_([i, i + 1], [i, i + 1])] += 0.05 * np.array([[2, 1], [1, 2]])
    return K, M


N, MODES = 8, 3


@pytest.fixture(scope="module")
def pair():
    """(K_A, M_A, K_X, M_X): model and structure, stiffness and mass both wrong."""
    rng = np.random.default_rng(5)
    k, m = rng.uniform(0.8, 2.5, N - 1), rng.uniform(0.6, 1.9, N)
    KA, MA = chain(k, m)
    KX, MX = chain(k * rng.uniform(0.85, 1.2, N - 1), m * rng.uniform(0.9, 1.15, N), 1.1)
    return KA, MA, KX, MX


@pytest.fixture(scope="module")
def measured(pair):
    """The structure's lowest modes, unit modal mass."""
    _, _, KX, MX = pair
    values, vectors = la.eigh(KX, MX)
    return vectors[:, :MODES], values[:MODES]


def has_modes(K, M, Phi, values, tolerance=1e-8):
    """Every assigned mode is an eigenpair: eigenvalue to 1e-8, and the shape in the eigenspace to
    1e-8."""
    found, shapes = la.eig(K, M)
    for phi, value in zip(Phi.T, values, strict=True):
        i = int(np.argmin(np.abs(found - value)))
        assert abs(found[i] - value) <= tolerance * abs(value)
        v, phi = shapes[:, i] / np.linalg.norm(shapes[:, i]), phi / np.linalg.norm(phi)
        assert np.linalg.norm(phi - v * np.vdot(v, phi)) <= 1e-7


def program(KA, MA, W, conditions, terms="KM", weights=(1.0, 1.0)):
    """min Σ ‖W^-½ Δ W^-½‖² over symmetric ΔK, ΔM under linear conditions, by cvxpy: the direct
    method's problem as it is printed."""
    import cvxpy as cp

    K, M = cp.Variable((N, N), symmetric=True), cp.Variable((N, N), symmetric=True)
    root = np.real(la.inv(la.sqrtm(W)))
    cost = 0
    constraints = conditions(K, M)
    for name, X, X0, w in (("K", K, KA, weights[0]), ("M", M, MA, weights[1])):
        if name in terms:
            cost = cost + w * cp.sum_squares(root @ (X - X0) @ root)
        else:
            constraints.append(X0 == X)
    problem = cp.Problem(cp.Minimize(cost), constraints)
    problem.solve(solver=cp.CLARABEL, tol_gap_abs=1e-13, tol_gap_rel=1e-13, tol_feas=1e-13)
    return K.value, M.value


def test_baruch_shapes_are_orthogonal_and_the_nearest(pair, measured):
    _, MA, _, _ = pair
    Phi, _ = measured
    X = d.baruch_shapes(MA, Phi)
    assert np.allclose(X.T @ MA @ X, np.eye(MODES), atol=1e-12)
    root = np.real(la.sqrtm(MA))
    U, _, Vt = la.svd(root @ Phi, full_matrices=False)  # the orthogonal Procrustes solution
    assert np.allclose(root @ X, U @ Vt, atol=1e-12)


def test_baruch_holds_its_modes_and_solves_its_program(pair, measured):
    KA, MA, _, _ = pair
    Phi, values = measured
    update = d.baruch(KA, MA, Phi, values)
    X = d.baruch_shapes(MA, Phi)
    has_modes(update.K, update.M, X, values)
    assert d.reproduced(update, X, values) < 1e-13
    K, _ = program(KA, MA, MA, lambda K, M: [MA @ X * values[None, :] == K @ X], "K")
    assert np.abs(update.K - K).max() <= 1e-6 * np.abs(KA).max()
    printed = (
        KA
        - KA @ X @ X.T @ MA
        - MA @ X @ X.T @ KA
        + MA @ X @ X.T @ KA @ X @ X.T @ MA
        + MA @ X @ np.diag(values) @ X.T @ MA
    )
    assert np.allclose(update.K, printed, atol=1e-12)


def test_shapes_that_are_not_orthogonal_are_refused_when_not_corrected(pair, measured):
    KA, MA, _, _ = pair
    with pytest.raises(InputError, match="not orthogonal in the mass matrix"):
        d.baruch(KA, MA, *measured, correct=False)


def test_berman_nagy_holds_its_modes_and_solves_its_program(pair, measured):
    KA, MA, _, _ = pair
    Phi, values = measured
    update = d.berman_nagy(KA, MA, Phi, values)
    has_modes(update.K, update.M, Phi, values)
    assert np.allclose(Phi.T @ update.M @ Phi, np.eye(MODES), atol=1e-12)
    _, M = program(KA, MA, MA, lambda K, M: [Phi.T @ M @ Phi == np.eye(MODES)], "M")
    assert np.abs(update.M - M).max() <= 1e-6 * np.abs(MA).max()
    K, _ = program(
        KA, update.M, MA, lambda K, M: [K @ Phi == update.M @ Phi * values[None, :]], "K"
    )
    assert np.abs(update.K - K).max() <= 1e-6 * np.abs(KA).max()


@pytest.mark.parametrize("norm", ["mass", "stiffness", "identity"])
@pytest.mark.parametrize("orthogonal", [True, False])
def test_caesar_keeps_the_rigid_body_mass_and_solves_its_program(norm, orthogonal):
    rng = np.random.default_rng(2)
    KA, MA = chain(rng.uniform(1, 2, N - 1), rng.uniform(1, 2, N), ground=0.0)
    KX, MX = chain(rng.uniform(1, 2, N - 1), rng.uniform(1, 2, N), ground=0.0)
    R = np.ones((N, 1))
    MX *= (R.T @ MA @ R) / (R.T @ MX @ R)  # weighed: the structure has the model's mass
    values, vectors = la.eigh(KX, MX)
    Phi, values = vectors[:, 1:3], values[1:3]
    update = d.caesar(KA, MA, Phi, values, R, norm=norm, orthogonal=orthogonal)
    has_modes(update.K, update.M, Phi, values)
    assert pytest.approx(R.T @ MA @ R, rel=1e-10) == R.T @ update.M @ R
    from cvxupdate.direct.caesar import weight

    W = weight(KA, MA, norm)

    def conditions(K, M):
        more = [Phi.T @ M @ R == 0] if orthogonal else []
        return [Phi.T @ M @ Phi == np.eye(2), R.T @ M @ R == R.T @ MA @ R, *more]

    _, M = program(KA, MA, W, conditions, "M")
    assert np.abs(update.M - M).max() <= 1e-6 * np.abs(MA).max()
    more = R if orthogonal else np.zeros((N, 0))
    K, _ = program(
        KA,
        update.M,
        W,
        lambda K, M: [
            K @ Phi == update.M @ Phi * values[None, :],
            *([K @ more == 0] if more.size else []),
        ],
        "K",
    )
    assert np.abs(update.K - K).max() <= 1e-6 * np.abs(KA).max()
    if orthogonal:
        assert np.abs(update.K @ R).max() < 1e-12
        assert d.faults(update, KA, MA, Phi, values).rigid < 1e-12


@pytest.mark.parametrize("weight", [1.0, 0.3, 4.0])
def test_wei_holds_its_modes_and_solves_its_program(pair, measured, weight):
    KA, MA, _, _ = pair
    Phi, values = measured
    update = d.wei(KA, MA, Phi, values, weight)
    has_modes(update.K, update.M, Phi, values)
    assert np.allclose(Phi.T @ update.M @ Phi, np.eye(MODES), atol=1e-12)
    K, M = program(
        KA,
        MA,
        MA,
        lambda K, M: [Phi.T @ M @ Phi == np.eye(MODES), K @ Phi == M @ Phi @ np.diag(values)],
        weights=(weight, 1.0),
    )
    assert np.abs(update.K - K).max() <= 1e-6 * np.abs(KA).max()
    assert np.abs(update.M - M).max() <= 1e-6 * np.abs(MA).max()


@pytest.fixture(scope="module")
def damped(pair):
    """(C_A, K_X, C_X, shapes, rates): non-proportional damping, the model's mass."""
    KA, MA, KX, _ = pair
    CA = 0.02 * KA + 0.03 * MA
    CX = CA.copy()
    CX[2, 2] += 0.15
    CX[np.ix_([4, 5], [4, 5])] += 0.1 * np.array([[1, -1], [-1, 1]])
    state = np.block([[np.zeros((N, N)), np.eye(N)], [-la.solve(MA, KX), -la.solve(MA, CX)]])
    rates, vectors = la.eig(state)
    up = np.flatnonzero(rates.imag > 0)
    up = up[np.argsort(np.abs(rates[up]))][:MODES]
    Phi = vectors[:N, up]
    return CA, KX, CX, Phi / np.abs(Phi).max(axis=0), rates[up]


def has_complex_modes(update, Phi, rates):
    state = np.block(
        [
            [np.zeros((N, N)), np.eye(N)],
            [-la.solve(update.M, update.K), -la.solve(update.M, update.C)],
        ]
    )
    found, vectors = la.eig(state)
    for phi, s in zip(Phi.T, rates, strict=True):
        i = int(np.argmin(np.abs(found - s)))
        assert abs(found[i] - s) <= 1e-8 * abs(s)
        v = vectors[:N, i] / np.linalg.norm(vectors[:N, i])
        assert np.linalg.norm(phi - v * np.vdot(v, phi)) <= 1e-7 * np.linalg.norm(phi)


def test_fuh_chen_holds_complex_modes_and_solves_its_program(pair, damped):
    import cvxpy as cp

    KA, MA, _, _ = pair
    CA, _, _, Phi, rates = damped
    update = d.fuh_chen(KA, MA, CA, Phi, rates, 0.7)
    has_complex_modes(update, Phi, rates)
    assert d.faults(update, KA, MA, Phi, rates).reproduction < 1e-12
    # The equations of motion of symmetric matrices depend on one another; an interior-point solver
    # wants the independent ones only.
    place = [(i, j) for i in range(N) for j in range(i, N)]
    E = np.zeros((len(place), N, N))
    for k, (i, j) in enumerate(place):
        E[k, i, j] = E[k, j, i] = 1.0
    motion = [E @ (Phi * rates), E @ Phi]
    A = np.concatenate(
        [np.concatenate([m.real, m.imag], axis=2).reshape(len(place), -1) for m in motion]
    ).T
    force = (MA @ Phi) * rates**2
    b = -np.concatenate([force.real, force.imag], axis=1).reshape(-1)
    U, sizes, Vt = la.svd(A, full_matrices=False)
    keep = sizes > 1e-10 * sizes[0]
    assert np.linalg.norm(b - U[:, keep] @ (U[:, keep].T @ b)) < 1e-10
    x = cp.Variable(2 * len(place))
    root = np.real(la.inv(la.sqrtm(MA)))
    F = (root @ E @ root).reshape(len(place), -1).T
    x0 = np.array([m[i, j] for m in (CA, KA) for i, j in place])
    n = len(place)
    cost = 0.7 * cp.sum_squares(F @ (x[:n] - x0[:n])) + cp.sum_squares(F @ (x[n:] - x0[n:]))
    right = (U[:, keep].T @ b) / sizes[keep]
    cp.Problem(cp.Minimize(cost), [Vt[keep] @ x == right]).solve(
        solver=cp.CLARABEL, tol_gap_abs=1e-13, tol_gap_rel=1e-13, tol_feas=1e-13
    )
    found = np.array([m[i, j] for m in (update.C, update.K) for i, j in place])
    assert np.abs(found - x.value).max() <= 1e-6 * np.abs(KA).max()


def test_minas_inman_assigns_exactly_and_its_lost_symmetry_is_said(pair, damped):
    KA, MA, _, _ = pair
    CA, _, _, Phi, rates = damped
    update = d.minas_inman(KA, MA, CA, Phi, rates)
    has_complex_modes(update, Phi, rates)
    found = d.faults(update, KA, MA, Phi, rates)
    assert found.reproduction < 1e-10
    assert found.asymmetry > 1e-3
    assert any("not symmetric" in line for line in found.says)


def test_minas_inman_refuses_outputs_that_cannot_tell_the_modes_apart(pair, damped):
    KA, MA, _, _ = pair
    CA, _, _, Phi, rates = damped
    with pytest.raises(InputError, match="cannot distinguish the modes"):
        d.minas_inman(KA, MA, CA, Phi, rates, D0=np.eye(N)[:2], D1=np.zeros((2, N)))


def test_zimmerman_widengren_is_symmetric_and_solves_its_riccati_equation(pair, damped):
    KA, MA, _, _ = pair
    CA, _, _, Phi, rates = damped
    update = d.zimmerman_widengren(KA, MA, CA, Phi, rates)
    has_complex_modes(update, Phi, rates)
    assert np.array_equal(update.K, update.K.T)
    assert np.array_equal(update.C, update.C.T)
    assert np.linalg.matrix_rank(update.K - KA, tol=1e-9) <= 2 * MODES
    Y, _, _, P = d.symmetric_gain(KA, MA, CA, Phi, rates)
    from cvxupdate.direct.fuh_chen import realised

    X, block = realised(Phi, rates)
    a, b = Y.T @ X @ block, Y.T @ X
    terms = P @ (a - a.T) @ P.T, b @ P.T - P @ b.T
    assert np.abs(terms[0] + terms[1]).max() <= 1e-7 * max(np.abs(t).max() for t in terms)


def test_mixing_holds_its_modes(pair, measured):
    KA, MA, KX, MX = pair
    Phi, values = measured
    update = d.caesar_link(KA, MA, Phi, values)
    has_modes(update.K, update.M, Phi, values)
    fill = la.null_space(Phi.T)
    update = d.ross(Phi, values, fill, np.linspace(5, 9, N - MODES))
    has_modes(update.K, update.M, Phi, values)
    all_values, all_shapes = la.eigh(KX, MX)
    update = d.thoren(all_shapes, all_values)
    assert np.allclose(update.K, KX, atol=1e-11)
    assert np.allclose(update.M, MX, atol=1e-11)
    keep = [0, 3, 6]
    small = d.thoren(Phi[keep], values)
    has_modes(small.K, small.M, Phi[keep], values)
    update = d.luk(Phi, values)
    assert d.reproduced(update, Phi, values) < 1e-13
    found = d.faults(update, KA, MA, Phi, values)
    assert found.mass_min < 1e-12
    assert any("lost its definiteness" in line for line in found.says)


def test_caesar_link_equals_the_printed_flexibilities(pair, measured):
    KA, MA, _, _ = pair
    Phi, values = measured
    own_values, own = la.eigh(KA, MA)
    update = d.caesar_link(KA, MA, Phi, values)
    first, first_values = own[:, :MODES], own_values[:MODES]
    assert np.allclose(la.inv(update.M), la.inv(MA) + Phi @ Phi.T - first @ first.T, atol=1e-10)
    assert np.allclose(
        la.inv(update.K),
        la.inv(KA) + Phi / values @ Phi.T - first / first_values @ first.T,
        atol=1e-10,
    )


def test_error_matrices_are_of_first_and_second_order(pair):
    KA, _, KX, _ = pair
    change = KX - KA
    errors = []
    for h in (0.2, 0.1, 0.05):
        X = KA + h * change
        errors.append(
            [np.linalg.norm(f(KA, la.inv(X)) - h * change) for f in (d.sidhu_ewins, d.second_order)]
        )
    rates = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert rates[-1, 0] == pytest.approx(2.0, abs=0.1)
    assert rates[-1, 1] == pytest.approx(3.0, abs=0.15)


def test_gysin_and_lieven_ewins_with_all_modes(pair):
    KA, MA, KX, MX = pair
    va, pa = la.eigh(KA, MA)
    vx, px = la.eigh(KX, MX)
    dK, dM = d.lieven_ewins(pa, va, px, vx)
    assert np.allclose(dK, KX - KA, atol=1e-10)
    assert np.allclose(dM, MX - MA, atol=1e-10)
    dK, dM = d.gysin(KA, MA, pa, va, px, vx)
    assert np.allclose(dK, d.sidhu_ewins(KA, la.inv(KX)), atol=1e-10)
    assert np.allclose(dM, MA @ (la.inv(MA) - la.inv(MX)) @ MA, atol=1e-10)


def test_lost_connectivity_is_said(pair, measured):
    KA, MA, _, _ = pair
    Phi, values = measured
    found = d.faults(d.berman_nagy(KA, MA, Phi, values), KA, MA, Phi, values)
    assert found.new_entries > 20
    assert any("the connectivity is lost" in line for line in found.says)


def test_lost_definiteness_is_said(pair, measured):
    KA, MA, _, _ = pair
    Phi, values = measured
    wrong, values = 12.0 * Phi, 0.1 * values  # shapes at a scale that leaves them too little mass
    update = d.wei(KA, MA, wrong, values, stiffness_weight=50.0)
    found = d.faults(update, KA, MA, wrong, values)
    lowest = la.eigvalsh(update.M)[0]
    assert (found.mass_min <= 0) == (lowest <= 0)
    assert (lowest <= 0) == any(
        "mass matrix has lost its definiteness" in line for line in found.says
    )
    assert lowest < 0


def test_no_change_is_made_when_the_model_is_right(pair):
    KA, MA, _, _ = pair
    values, vectors = la.eigh(KA, MA)
    Phi, values = vectors[:, [0, 2, 5]], values[[0, 2, 5]]
    for update in (
        d.baruch(KA, MA, Phi, values),
        d.berman_nagy(KA, MA, Phi, values),
        d.wei(KA, MA, Phi, values),
        d.caesar(KA, MA, Phi, values),
        d.caesar_link(KA, MA, Phi, values, np.array([0, 2, 5])),
    ):
        assert np.allclose(update.K, KA, atol=1e-11), update.method
        assert np.allclose(update.M, MA, atol=1e-11), update.method


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 5))
def test_every_assignment_holds_for_any_pair_of_structures(seed, modes):
    rng = np.random.default_rng(seed)
    KA, MA = chain(rng.uniform(0.5, 3, N - 1), rng.uniform(0.5, 2, N), rng.uniform(0.3, 2))
    KX, MX = chain(rng.uniform(0.5, 3, N - 1), rng.uniform(0.5, 2, N), rng.uniform(0.3, 2))
    values, vectors = la.eigh(KX, MX)
    Phi, values = vectors[:, :modes], values[:modes]
    for update in (
        d.berman_nagy(KA, MA, Phi, values),
        d.wei(KA, MA, Phi, values),
        d.caesar(KA, MA, Phi, values, norm="identity"),
    ):
        assert d.reproduced(update, Phi, values) < 1e-8, update.method
