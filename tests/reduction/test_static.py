"""Static condensation and its improvements, against the laws they must obey."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh, subspace_angles

from cvxupdate.errors import ConvergenceError, InputError, ModelError
from cvxupdate.reduction import (
    craig_bampton,
    guyan,
    irs,
    iterated_irs,
    partition,
    reduced_modes,
    serep,
)

MASTERS = np.array([38, 4, 10, 16, 22, 28])  # translations of the cantilever, not in order


def test_guyan_is_the_schur_complement_and_exact_in_statics(beam):
    split = partition(beam.K, beam.M, MASTERS)
    T = guyan(split)
    K = beam.K.toarray()
    assert np.allclose(
        np.linalg.inv(T.reduce(beam.K)), np.linalg.inv(K)[np.ix_(MASTERS, MASTERS)], rtol=1e-8
    )
    force = np.zeros((beam.size, 2))
    force[MASTERS[0], 0], force[MASTERS[3], 1] = 3.0, -2.0
    x = np.linalg.solve(K, force)
    assert np.allclose(T.expand(x[MASTERS]), x, rtol=1e-9, atol=1e-12 * np.abs(x).max())
    assert T.keeps_measured


def test_guyan_expansion_has_the_least_strain_energy(beam):
    T = guyan(partition(beam.K, None, MASTERS))
    rng = np.random.default_rng(0)
    x = T.expand(rng.standard_normal(6))
    least = x @ (beam.K @ x)
    slaves = np.setdiff1d(np.arange(beam.size), MASTERS)
    for _ in range(20):
        y = x.copy()
        y[slaves] += 1e-3 * rng.standard_normal(slaves.size)
        assert y @ (beam.K @ y) > least


def test_guyan_keeps_mass_and_rigid_body_motion(free_beam):
    """A free structure: rigid translation and rotation are static, so they and their mass survive
    exactly."""
    masters = np.array([0, 12, 30, 40])
    value, shapes = eigh(free_beam.K.toarray(), free_beam.M.toarray())
    rigid = shapes[:, :2]
    for make in (guyan, irs):
        T = make(partition(free_beam.K, free_beam.M, masters))
        assert np.allclose(T.expand(rigid[masters]), rigid, atol=1e-8 * np.abs(rigid).max())
        assert np.allclose(
            rigid[masters].T @ T.reduce(free_beam.M) @ rigid[masters], np.eye(2), atol=1e-8
        )
        f, _ = reduced_modes(T, free_beam.K, free_beam.M)
        assert f[1] < 1e-3 * f[2]
    assert value[1] < 1e-3 * value[2]


def test_reduced_frequencies_are_upper_bounds(beam):
    for make in (guyan, irs):
        f, _ = reduced_modes(make(partition(beam.K, beam.M, MASTERS)), beam.K, beam.M)
        assert np.all(f >= beam.frequency[:6] * (1 - 1e-9))


@pytest.mark.parametrize("name", ["beam", "chain"])
def test_irs_beats_guyan_and_iterated_irs_becomes_serep(name, request):
    s = request.getfixturevalue(name)
    masters = MASTERS if name == "beam" else np.array([3, 8, 13, 17, 22, 27])
    split = partition(s.K, s.M, masters)
    error = {}
    for make in (guyan, irs):
        f, _ = reduced_modes(make(split), s.K, s.M)
        error[make.__name__] = np.abs(f[:4] / s.frequency[:4] - 1)
    assert np.all(error["irs"] < 0.5 * error["guyan"])
    T = iterated_irs(split, iterations=3000, tolerance=1e-13)
    f, shapes = reduced_modes(T, s.K, s.M)
    assert np.allclose(f, s.frequency[:6], rtol=1e-10)
    kept = s.phi[:, :6]
    assert np.max(subspace_angles(shapes, kept)) < 1e-7
    exact = serep(kept, masters)
    assert np.linalg.norm(T.matrix - exact.matrix) < 1e-6 * np.linalg.norm(exact.matrix)
    assert np.allclose(T.expand(kept[masters]), kept, atol=1e-7 * np.abs(kept).max())


def test_iterated_irs_says_when_it_has_not_converged_and_can_keep_fewer(beam):
    split = partition(beam.K, beam.M, MASTERS)
    with pytest.raises(ConvergenceError, match="keep fewer modes"):
        iterated_irs(split, iterations=3)
    T = iterated_irs(split, iterations=60, modes=2)
    f, _ = reduced_modes(T, beam.K, beam.M)
    assert np.allclose(f[:2], beam.frequency[:2], rtol=1e-10)


def test_craig_bampton_converges_and_is_exact_with_all_modes(beam):
    split = partition(beam.K, beam.M, MASTERS[:3])
    worst = []
    for modes in (1, 3, 6, 12):
        f, _ = reduced_modes(craig_bampton(split, modes), beam.K, beam.M)
        worst.append(np.max(f[:4] / beam.frequency[:4] - 1))
    assert np.all(np.diff(worst) < 0) and worst[-1] < 1e-4 and min(worst) > -1e-9
    T = craig_bampton(split, beam.size - 3)
    f, _ = reduced_modes(T, beam.K, beam.M)
    assert np.allclose(f, beam.frequency, rtol=1e-8)
    assert T.generalised == beam.size - 3 and T.matrix.shape == (beam.size, beam.size)
    # Fixed-interface: the stiffness does not couple masters with modal coordinates, which are
    # decoupled by K and M.
    reduced = T.reduce(beam.K)
    assert np.allclose(reduced[:3, 3:], 0.0, atol=1e-7 * np.abs(reduced).max())
    assert np.allclose(T.reduce(beam.M)[3:, 3:], np.eye(beam.size - 3), atol=1e-8)


def test_everything_measured_is_the_identity(chain):
    split = partition(chain.K, chain.M, np.arange(chain.size)[::-1])
    for make in (guyan, irs):
        T = make(split)
        assert np.array_equal(T.expand(chain.phi[::-1]), chain.phi)


def test_order_of_masters_is_the_users(chain):
    masters = np.array([25, 2, 14])
    a, b = (guyan(partition(chain.K, chain.M, m)) for m in (masters, np.sort(masters)))
    x = np.array([1.0, -2.0, 3.0])
    assert np.allclose(a.expand(x), b.expand(x[np.argsort(masters)]))
    assert np.allclose(a.expand(x)[masters], x)


def test_a_factorisation_is_made_once(chain, monkeypatch):
    import cvxupdate.reduction.split as module

    calls = []
    real = module.splu
    monkeypatch.setattr(module, "splu", lambda *a, **k: calls.append(1) or real(*a, **k))
    split = partition(chain.K, chain.M, np.array([5, 15, 25]))
    guyan(split), irs(split), iterated_irs(split, modes=1), craig_bampton(split, 3)
    assert len(calls) == 1


def test_mechanisms_and_bad_input_are_named(chain, free_beam):
    with pytest.raises(ModelError, match="mechanism"):
        guyan(partition(free_beam.K, free_beam.M, np.array([5])))
    loose = sparse.block_diag([chain.K, sparse.csc_matrix((1, 1))]).tocsc()
    with pytest.raises(ModelError, match="mechanism"):
        guyan(partition(loose, None, np.array([0])))
    with pytest.raises(InputError, match="more than once"):
        partition(chain.K, chain.M, np.array([1, 1]))
    with pytest.raises(InputError, match="must lie in"):
        partition(chain.K, chain.M, np.array([300]))
    with pytest.raises(InputError, match="mass matrix"):
        irs(partition(chain.K, None, np.array([1])))
    skew = chain.K.toarray()
    skew[0, 1] *= 2
    with pytest.raises(ModelError, match="not symmetric"):
        partition(skew, chain.M, np.array([1]))
    T = guyan(partition(chain.K, chain.M, np.array([1, 2])))
    with pytest.raises(InputError, match="expands 2 rows"):
        T.expand(np.ones(3))
    with pytest.raises(InputError, match="not measured"):
        T.expand(np.array([np.nan, 1.0]))
    with pytest.raises(InputError, match="cannot reduce"):
        T.reduce(np.eye(3))
