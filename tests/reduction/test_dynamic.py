"""Condensation at a frequency: exact there, and by its series forms."""

import numpy as np
import pytest

from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction import (
    dynamic,
    expand_each,
    guyan,
    gysin,
    irs,
    kidder,
    partition,
    petersmann,
    reduced_modes,
)

MASTERS = np.array([38, 4, 10, 16, 22, 28])


def stiffness(s, f):
    return s.K.toarray() - (2 * np.pi * f) ** 2 * s.M.toarray()


@pytest.mark.parametrize("f", [3.0, 37.7, 411.0, 2222.0])
def test_dynamic_reduction_is_exact_at_its_frequency(beam, f):
    """The reduced receptance at the masters is the full one, and forced motion expands exactly."""
    split = partition(beam.K, beam.M, MASTERS)
    T = dynamic(split, f)
    H = np.linalg.inv(stiffness(beam, f))
    Z = T.reduce(beam.K) - (2 * np.pi * f) ** 2 * T.reduce(beam.M)
    at = H[np.ix_(MASTERS, MASTERS)]
    assert np.allclose(np.linalg.inv(Z), at, rtol=0, atol=1e-8 * np.abs(at).max())
    whole = H[:, MASTERS]
    assert np.allclose(T.expand(at), whole, rtol=0, atol=1e-7 * np.abs(whole).max())
    assert T.frequency == f


def test_each_mode_expands_exactly_at_its_own_frequency(beam):
    split = partition(beam.K, beam.M, MASTERS)
    kept, f = beam.phi[:, :6], beam.frequency[:6]
    for method in (dynamic, gysin):
        out = expand_each(lambda x, m=method: m(split, x), kept[MASTERS], f)
        assert np.allclose(out, kept, atol=1e-6 * np.abs(kept).max())


def test_zero_frequency_is_guyan(beam):
    split = partition(beam.K, beam.M, MASTERS)
    static = guyan(split).matrix
    assert np.array_equal(dynamic(split, 0.0).matrix, static)
    assert np.allclose(kidder(split, 50.0, terms=0).matrix, static)
    assert np.allclose(petersmann(split, 0.0, 3).matrix, static)


def test_kidder_converges_geometrically_and_refuses_to_diverge(beam):
    split = partition(beam.K, beam.M, MASTERS)
    limit = np.sqrt(split.slave_modes(1)[0][0]) / (2 * np.pi)
    f = 0.5 * limit
    exact = dynamic(split, f).matrix
    errors = np.array([np.linalg.norm(kidder(split, f, k).matrix - exact) for k in range(1, 9)])
    assert np.allclose(errors[4:] / errors[3:-1], 0.25, rtol=0.1)  # (ω/ω_s1)² = 1/4 per term
    with pytest.raises(InputError, match="diverges"):
        kidder(split, 1.01 * limit, 3)


def test_irs_is_kidders_first_order_at_each_guyan_frequency(beam):
    """2.4.5 says that the series up to ω² "is identical to IRS": true for every Guyan mode at its
    own frequency."""
    split = partition(beam.K, beam.M, MASTERS)
    f, shapes = reduced_modes(guyan(split), beam.K, beam.M)
    improved = irs(split)
    for r in range(4):
        at = shapes[MASTERS, r]
        first = kidder(split, f[r], 1) if f[r] < 700 else None
        if first is not None:
            assert np.allclose(
                improved.expand(at), first.expand(at), atol=1e-8 * np.abs(shapes).max()
            )


def test_petersmann_converges_and_the_static_part_helps(beam):
    split = partition(beam.K, beam.M, MASTERS)
    f = 1.3 * np.sqrt(split.slave_modes(1)[0][0]) / (2 * np.pi)  # where Kidder's series fails
    exact = dynamic(split, f).matrix

    def error(modes: int, static: bool) -> float:
        wrong = petersmann(split, f, modes, static).matrix - exact
        return float(
            np.sqrt(np.trace(wrong.T @ (beam.M @ wrong)))
        )  # modes are orthogonal in M, so here it is monotone

    kept = [2, 6, 12, 24, beam.size - 6]
    plain, better = [error(k, False) for k in kept], [error(k, True) for k in kept]
    assert np.all(np.diff(plain) < 0) and np.all(np.diff(better) < 0)
    assert all(b < a for a, b in zip(plain[:-1], better[:-1], strict=True))
    assert max(plain[-1], better[-1]) < 1e-8 * np.sqrt(np.trace(exact.T @ (beam.M @ exact)))


def test_gysin_is_the_pseudo_inverse_of_all_rows(chain):
    masters = np.array([3, 9, 20])
    slaves = np.setdiff1d(np.arange(chain.size), masters)
    split = partition(chain.K, chain.M, masters)
    for f in (5.0, 31.0):
        Z = stiffness(chain, f)
        T = gysin(split, f)
        assert np.allclose(
            T.matrix[slaves], -np.linalg.pinv(Z[:, slaves]) @ Z[:, masters], atol=1e-8
        )
        assert np.linalg.norm(Z @ T.matrix) <= np.linalg.norm(Z @ dynamic(split, f).matrix)


def test_complex_stiffness_condenses_exactly(chain):
    """Hysteretic damping: K(1 + iη), not proportional."""
    masters = np.array([3, 9, 20])
    K = chain.K.toarray() * (1 + 0.02j) + 1j * np.diag(np.linspace(0, 3e3, chain.size))
    split = partition(K, chain.M, masters)
    f = 17.0
    T = dynamic(split, f)
    H = np.linalg.inv(K - (2 * np.pi * f) ** 2 * chain.M.toarray())
    Z = T.reduce(K) - (2 * np.pi * f) ** 2 * T.reduce(chain.M)
    assert np.allclose(np.linalg.inv(Z), H[np.ix_(masters, masters)])
    assert np.allclose(T.expand(H[np.ix_(masters, masters)]), H[:, masters])
    slaves = np.setdiff1d(np.arange(chain.size), masters)
    D = K - (2 * np.pi * f) ** 2 * chain.M.toarray()
    assert np.allclose(
        gysin(split, f).matrix[slaves], -np.linalg.pinv(D[:, slaves]) @ D[:, masters]
    )


def test_a_slave_resonance_is_refused(beam):
    split = partition(beam.K, beam.M, np.array([10]))
    value, _ = split.slave_modes(2)
    f = float(np.sqrt(value[1]) / (2 * np.pi))
    with pytest.raises(InputError, match="natural frequency of the slaves"):
        petersmann(split, f, 4)
    with pytest.raises(InputError, match="not negative"):
        dynamic(split, -1.0)
    # A chain of two with the first held: the slave resonates at exactly 1 rad/s, its dynamic
    # stiffness is exactly zero.
    two = np.array([[2.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(ModelError, match="natural frequency of the slaves"):
        dynamic(partition(two, np.eye(2), np.array([0])), 1 / (2 * np.pi))


def test_slave_modes_by_lanczos_agree_with_dense(beam_maker):
    big = beam_maker(elements=200)
    split = partition(big.K, big.M, np.array([50, 199, 399]))
    value, shape = split.slave_modes(6)
    K, M = split.K_ss.toarray(), split.M_ss.toarray()
    from scipy.linalg import eigh

    exact = eigh(K, M, eigvals_only=True)[:6]
    assert np.allclose(value, exact, rtol=1e-6)
    assert np.allclose(shape.T @ M @ shape, np.eye(6), atol=1e-8)
