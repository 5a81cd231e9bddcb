"""Pole placement, symmetric assignment, error matrices with damping and deviations: the laws that
each promises."""

import numpy as np
import pytest
import scipy.linalg as la

import cvxupdate.direct as d
from cvxupdate.errors import InputError

N = 7


def chain(k, m):
    """A grounded chain with consistent mass: unequal everywhere, banded."""
    K = np.diag(np.append(k[:-1] + k[1:], k[-1])) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    M = np.diag(m) + 0.04 * (np.eye(len(m), k=1) + np.eye(len(m), k=-1))
    return K, M


@pytest.fixture(scope="module")
def case():
    """(K_A, M_A, own modes, own eigenvalues, K_X, measured modes, eigenvalues): one mass, two
    stiffnesses wrong."""
    rng = np.random.default_rng(11)
    k, m = rng.uniform(0.8, 2.6, N), rng.uniform(0.6, 1.7, N)
    K, M = chain(k, m)
    wrong = k.copy()
    wrong[2] *= 0.9
    wrong[5] *= 1.07
    KX, _ = chain(wrong, m)
    own_values, own = la.eigh(K, M)
    values, vectors = la.eigh(KX, M)
    vectors = vectors * np.sign(np.einsum("ij,ij->j", own, M @ vectors))
    return K, M, own, own_values, KX, vectors, values


def test_pole_placement_moves_what_is_asked_and_nothing_else(case):
    K, M, own, own_values, _, _, values = case
    made = d.pole_placement(K, M, own[:, [0, 2]], own_values[[0, 2]], values[[0, 2]])
    now, shapes = la.eigh(made.K, M)
    wanted = own_values.copy()
    wanted[[0, 2]] = values[[0, 2]]
    assert now == pytest.approx(np.sort(wanted), rel=1e-12)
    assert np.abs(shapes.T @ M @ own) == pytest.approx(np.eye(N), abs=1e-9)
    assert np.array_equal(made.K, made.K.T) and np.array_equal(made.M, M)


def test_no_symmetric_change_places_the_poles_with_less(case):
    """Hoffman and Wielandt: the change is as small as the distance of the eigenvalues, and any
    other matrix with that spectrum is farther."""
    K, M, own, own_values, _, _, values = case
    made = d.pole_placement(K, M, own[:, :2], own_values[:2], values[:2])
    root = np.real(la.inv(la.sqrtm(M)))
    size = np.linalg.norm(root @ (made.K - K) @ root)
    assert size == pytest.approx(np.linalg.norm(values[:2] - own_values[:2]), rel=1e-9)
    rng = np.random.default_rng(3)
    spectrum = np.append(values[:2], own_values[2:])
    for turn in (1e-3, 0.05, 1.0):
        skew = rng.normal(size=(N, N)) * turn
        Q = la.expm(skew - skew.T)
        basis = la.sqrtm(M).real @ own @ Q
        other = basis @ np.diag(spectrum) @ basis.T
        assert np.linalg.norm(other - root @ K @ root) > size


def test_one_actuator_places_poles_too(case):
    K, M, own, own_values, _, _, values = case
    b = np.linspace(1.0, 0.2, N) ** 2
    g = d.single_input(M, own[:, [1, 3, 4]], own_values[[1, 3, 4]], values[[1, 3, 4]], b)
    wanted = own_values.copy()
    wanted[[1, 3, 4]] = values[[1, 3, 4]]
    own_control = d.modal_control(K, M, own[:, [1, 3, 4]], own_values[[1, 3, 4]], values[[1, 3, 4]])
    for stiff in (K + np.outer(b, g), own_control.K):
        now = la.eigvals(stiff, M)
        assert np.abs(now.imag).max() < 1e-9
        assert np.sort(now.real) == pytest.approx(np.sort(wanted), rel=1e-9)


def test_an_actuator_on_a_node_drives_nothing(case):
    _, M, own, own_values, *_ = case
    b = M @ own[:, 0]  # orthogonal to every other mode
    with pytest.raises(InputError, match="node of a mode"):
        d.single_input(M, own[:, [1]], own_values[[1]], own_values[[1]] * 1.1, b)


@pytest.mark.parametrize("zeta", [0.0, 0.03])
@pytest.mark.parametrize("method", ["inman_minas", "zimmerman_widengren"])
def test_symmetric_assignment_of_real_modes(case, method, zeta):
    K, M, _, _, _, vectors, values = case
    Phi, rates = vectors[:, :3], np.sqrt(values[:3]) * (-zeta + 1j * np.sqrt(1 - zeta**2))
    made = getattr(d, method)(K, M, np.zeros_like(K), Phi.astype(complex), rates)
    assert d.reproduced(made, Phi, rates) < 1e-10
    for A in (made.K, made.C):
        assert np.abs(A - A.T).max() < 1e-10 * np.abs(made.K).max()
    if zeta == 0.0:
        assert np.abs(made.C).max() < 1e-10


def test_least_rank_is_the_number_of_modes(case):
    K, M, _, _, KX, vectors, values = case
    rates = 1j * np.sqrt(values)
    made = d.zimmerman_widengren(K, M, np.zeros_like(K), vectors[:, :2].astype(complex), rates[:2])
    assert np.linalg.matrix_rank(made.K - K, tol=1e-10) == 2
    # two springs are wrong: rank two is the whole error, so two modes find all of it
    assert np.abs(made.K - KX).max() < 1e-8


def test_the_symmetric_iteration_ends_nearest_to_where_it_began(case):
    """Of symmetric assignments it is the nearest to Minas and Inman's: what is between the two is
    orthogonal to every difference of symmetric assignments."""
    K, M, _, _, _, vectors, values = case
    Phi, rates = vectors[:, :2], 1j * np.sqrt(values[:2])
    C = np.zeros_like(K)
    first = d.minas_inman(K, M, C, Phi.astype(complex), rates)
    made = d.inman_minas(K, M, C, Phi.astype(complex), rates)
    free = la.null_space(Phi.T)
    rng = np.random.default_rng(2)
    for _ in range(5):
        S = rng.normal(size=(free.shape[1], free.shape[1]))
        other = free @ (S + S.T) @ free.T  # leaves the modes and the symmetry alone
        assert abs(np.sum((first.K - made.K) * other)) < 1e-9 * np.linalg.norm(other)


def test_complex_modes_are_assigned_symmetrically(case):
    """Modes of a structure with a dashpot, which no proportional damping has."""
    K, M, _, _, KX, *_ = case
    C = np.zeros((N, N))
    C[1, 1], C[np.ix_([3, 4], [3, 4])] = 0.2, 0.1 * np.array([[1, -1], [-1, 1]])
    state = np.block([[np.zeros((N, N)), np.eye(N)], [-la.solve(M, KX), -la.solve(M, C)]])
    s, X = la.eig(state)
    keep = np.flatnonzero(s.imag > 0)[np.argsort(s.imag[s.imag > 0])][:2]
    Phi, rates = X[:N, keep], s[keep]
    made = d.inman_minas(K, M, np.zeros_like(K), Phi, rates)
    assert d.reproduced(made, Phi, rates) < 1e-9
    assert np.abs(made.C - made.C.T).max() < 1e-9 and np.abs(made.K - made.K.T).max() < 1e-9


def test_shapes_that_no_symmetric_matrix_has_are_refused(case):
    K, M, _, _, _, vectors, values = case
    skew = vectors[:, :2] @ np.array([[1.0, 0.4], [0.0, 1.0]])  # not orthogonal in the mass
    rates = 1j * np.sqrt(values[:2])
    for method in (d.inman_minas, d.zimmerman_widengren):
        with pytest.raises(InputError, match="no symmetric"):
            method(K, M, np.zeros_like(K), skew.astype(complex), rates)


def damped(K, M, dK, D):
    """Complex modes of K + dK + i D, Φᵀ M Φ = I."""
    values, X = la.eig(K + dK + 1j * D, M)
    X = X / np.sqrt(np.einsum("ij,ij->j", X, M @ X))
    return values, X


def test_he_ewins_separates_stiffness_from_damping_to_first_order(case):
    K, M, *_ = case
    e = np.zeros(N)
    e[[3, 4]] = 1.0, -1.0
    left = []
    for size in (0.02, 0.01):
        dK, D = size * np.outer(e, e), 0.5 * size * np.diag([0, 1.0, 0, 0, 0, 0, 0])
        values, X = damped(K, M, dK, D)
        got_K, got_D = d.he_ewins(K, X, values)
        left.append((np.linalg.norm(got_K - dK), np.linalg.norm(got_D - D)))
        assert np.argmax(np.diag(got_D)) == 1 and np.abs(got_D - got_D.T).max() == 0.0
    assert left[1][0] < 0.3 * left[0][0] and left[1][1] < 0.3 * left[0][1]


def test_he_ewins_of_an_undamped_structure_finds_no_damping(case):
    K, _, _, _, KX, vectors, values = case
    dK, D = d.he_ewins(K, vectors.astype(complex), values.astype(complex))
    assert np.all(D == 0.0)
    assert dK == pytest.approx(d.sidhu_ewins(K, la.inv(KX)), abs=1e-9)


def noisy(rng, vectors, values, M, noise):
    """Modes with noise in shapes, and the deviations that went in."""
    std = noise * np.abs(vectors).max(axis=0)[None, :] * np.ones_like(vectors)
    Phi = vectors + std * rng.normal(size=vectors.shape)
    value_std = 0.2 * noise * values
    return Phi, values + value_std * rng.normal(size=len(values)), std, value_std


def test_the_deviation_of_the_error_matrix_is_that_of_its_scatter(case):
    """Nothing is wrong: every entry in its own deviation scatters by one."""
    K, M, own, own_values, *_ = case
    rng = np.random.default_rng(8)
    z = []
    for _ in range(600):
        Phi, values, std, value_std = noisy(rng, own[:, :4], own_values[:4], M, 1e-3)
        F = [d.flexibility(*pair) for pair in ((own[:, :4], own_values[:4]), (Phi, values))]
        z.append(K @ (F[0] - F[1]) @ K / d.error_deviation(K, Phi, values, std, value_std))
    assert np.std(z, axis=0) == pytest.approx(np.ones((N, N)), abs=0.12)


def test_deviations_of_eigenvalues_go_through_the_derivative_of_the_error_matrix():
    """Exact shapes: the entry's deviation is |∂(K F K)/∂λ_r| σ_r, of independent modes the root of
    the squares; the derivatives by complex step."""
    K, M = chain(np.array([9.0, 6.0, 8.0, 5.0, 7.0]), np.array([2.0, 1.5, 1.0, 1.7, 0.8]))
    values, Phi = (a[..., :3] for a in la.eigh(K, M))
    std = np.array([0.03, 0.05, 0.2])
    squares = np.zeros(K.shape)
    for r in range(3):
        moved = values.astype(complex)
        moved[r] += 1e-30j
        squares += (std[r] * np.imag(K @ (Phi / moved) @ Phi.T @ K) / 1e-30) ** 2
    found = d.error_deviation(K, Phi, values, np.zeros(Phi.shape), std)
    assert found == pytest.approx(np.sqrt(squares), rel=1e-9, abs=1e-12)


def test_weights_find_a_change_below_the_scatter_of_stiffer_places(case):
    """A soft spring changes by less than noise makes of a stiff one: the largest entry of the error
    matrix stands at the stiff one, the largest in deviations at the soft one."""
    k = np.array([1.0, 1.2, 0.9, 1.1, 200.0, 1.3, 0.8])
    m = np.array([1.0, 1.3, 0.8, 1.1, 0.9, 1.2, 0.7])
    K, M = chain(k, m)
    changed = k.copy()
    changed[1] *= 0.9
    KX, _ = chain(changed, m)
    own_values, own = la.eigh(K, M)
    values, vectors = la.eigh(KX, M)
    vectors = vectors * np.sign(np.einsum("ij,ij->j", own, M @ vectors))
    rng = np.random.default_rng(4)
    hits = [0, 0]
    for _ in range(20):
        Phi, lam, std, value_std = noisy(rng, vectors[:, :4], values[:4], M, 2e-3)
        dK, z = d.park_lee(K, own[:, :4], own_values[:4], Phi, lam, std, value_std)
        plain = d.sidhu_ewins(K, d.flexibility(Phi, lam), d.flexibility(own[:, :4], own_values[:4]))
        for i, A in enumerate((plain, z)):
            place = np.unravel_index(np.argmax(np.abs(A)), A.shape)
            hits[i] += set(place) <= {0, 1}
        assert np.all(dK[K == 0.0] == 0.0) and np.array_equal(dK, dK.T)
    assert hits[1] >= 18 and hits[0] <= 4


def test_certain_modes_are_not_weighted(case):
    K, _, own, own_values, _, vectors, values = case
    nothing = np.zeros_like(vectors), np.zeros_like(values)
    dK, _ = d.park_lee(K, own, own_values, vectors, values, *nothing)
    plain = d.sidhu_ewins(K, d.flexibility(vectors, values), d.flexibility(own, own_values))
    assert dK == pytest.approx(np.where(K != 0.0, plain, 0.0), abs=1e-12)


def test_the_change_stands_where_it_was_made(case):
    K, M, *_ = case
    change = np.zeros((N, N))
    change[2, 2] = 0.3
    made = d.DirectUpdate("one entry", M, K + change)
    assert d.change_by_dof(made, K, M) == pytest.approx(np.eye(N)[2])
    assert np.all(d.change_by_dof(d.DirectUpdate("none", M, K), K, M) == 0.0)
