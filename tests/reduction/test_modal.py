"""Transformations from mode shapes: SEREP, SEREPa, TAM, hybrid TAM."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction import guyan, hybrid_tam, partition, reduced_modes, serep, serepa, tam

MASTERS = np.array([38, 4, 10, 16, 22, 28])


@pytest.mark.parametrize("modes", [1, 3, 4, 6])
def test_serep_reproduces_the_kept_modes(beam, modes):
    kept = beam.phi[:, :modes]
    T = serep(
        kept * 10.0 ** (-5 * np.arange(modes)), MASTERS
    )  # the scale of the modes must not matter
    assert np.allclose(T.expand(kept[MASTERS]), kept, rtol=0, atol=1e-10 * np.abs(kept).max())
    f, shapes = reduced_modes(T, beam.K, beam.M)
    assert f.size == modes
    assert np.allclose(f, beam.frequency[:modes], rtol=1e-10)
    assert np.allclose(np.abs(np.sum(shapes * (beam.M @ kept), axis=0)), 1.0, atol=1e-10)


def test_any_modes_can_be_kept_not_only_the_lowest(beam):
    chosen = [1, 4, 6]
    f, _ = reduced_modes(serep(beam.phi[:, chosen], MASTERS), beam.K, beam.M)
    assert np.allclose(f, beam.frequency[chosen], rtol=1e-10)


def test_serep_smooths_and_tam_does_not(beam):
    kept = beam.phi[:, :4]
    noisy = (
        kept[MASTERS] + 0.05 * np.random.default_rng(0).standard_normal((6, 4)) * np.abs(kept).max()
    )
    smooth = serep(kept, MASTERS)
    assert not smooth.keeps_measured
    again = smooth.expand(smooth.expand(noisy)[MASTERS])
    assert np.allclose(again, smooth.expand(noisy))  # a projection
    T = tam(kept, MASTERS)
    assert T.keeps_measured and np.array_equal(T.expand(noisy)[MASTERS], noisy)
    slaves = np.setdiff1d(np.arange(beam.size), MASTERS)
    assert np.allclose(T.expand(noisy)[slaves], smooth.expand(noisy)[slaves])
    assert np.allclose(T.expand(kept[MASTERS]), kept, atol=1e-10 * np.abs(kept).max())


def test_serepa_is_serep_and_tam_with_as_many_modes_as_masters(beam):
    kept = beam.phi[:, :6]
    a, b, c = serepa(kept, MASTERS), serep(kept, MASTERS), tam(kept, MASTERS)
    assert np.allclose(a.matrix, b.matrix, atol=1e-8) and np.allclose(a.matrix, c.matrix, atol=1e-8)
    assert a.keeps_measured
    with pytest.raises(InputError, match="as many modes as masters"):
        serepa(beam.phi[:, :5], MASTERS)


@given(st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_hybrid_tam_lies_between_its_parents(beam, seed):
    """TAM on the modes, Guyan on motion orthogonal to them by T₇ᵀMT₇, and so a mixture on
    everything else."""
    rng = np.random.default_rng(seed)
    kept = beam.phi[:, :4] * rng.uniform(0.1, 10, 4)
    static = guyan(partition(beam.K, beam.M, MASTERS))
    modal, T = tam(kept, MASTERS), hybrid_tam(kept, beam.M, static)
    assert T.keeps_measured
    q = rng.standard_normal(4)
    on_modes = kept @ q
    assert np.allclose(T.expand(on_modes[MASTERS]), on_modes, atol=1e-9 * np.abs(on_modes).max())
    W = modal.reduce(beam.M)
    v = rng.standard_normal(6)
    weighted = kept[MASTERS].T @ W
    rest = v - kept[MASTERS] @ np.linalg.solve(weighted @ kept[MASTERS], weighted @ v)
    assert np.allclose(T.expand(rest), static.expand(rest), atol=1e-8 * np.abs(rest).max())
    assert np.allclose(
        T.expand(v), modal.expand(v - rest) + static.expand(rest), atol=1e-8 * np.abs(v).max()
    )


def test_hybrid_projector_is_the_corrected_print_for_mass_normalised_modes(beam):
    kept = beam.phi[:, :4]
    static, modal = guyan(partition(beam.K, beam.M, MASTERS)), tam(kept, MASTERS)
    Q = kept[MASTERS] @ kept[MASTERS].T @ modal.matrix.T @ (beam.M @ modal.matrix)
    assert np.allclose(Q @ Q, Q) and np.linalg.matrix_rank(Q) == 4
    printed = static.matrix + (modal.matrix - static.matrix) @ Q
    assert np.allclose(hybrid_tam(kept, beam.M, static).matrix, printed, atol=1e-9)


def test_the_hybrid_reduced_model_is_more_robust_than_tam(beam):
    """TAM's residual modes (those beyond the kept ones) are poor; the hybrid takes them from Guyan
    (Kammer 1991)."""
    kept = beam.phi[:, :4]
    static = guyan(partition(beam.K, beam.M, MASTERS))
    extra = {}
    for T in (static, tam(kept, MASTERS), hybrid_tam(kept, beam.M, static)):
        f, shapes = reduced_modes(T, beam.K, beam.M)
        extra[T.method] = np.abs(shapes[:, 4] @ (beam.M @ beam.phi[:, 4]))
        if T.method != "Guyan":
            assert np.allclose(f[:4], beam.frequency[:4], rtol=1e-8)
    assert extra["hybrid TAM"] > extra["TAM"]


def test_masters_that_cannot_see_are_refused_with_the_reason(beam):
    blind = beam.phi[:, :3].copy()
    blind[MASTERS, 2] = 2 * blind[MASTERS, 1] - blind[MASTERS, 0]
    for make in (serep, tam):
        with pytest.raises(ModelError, match="cannot distinguish the 3 modes"):
            make(blind, MASTERS)
    with pytest.raises(InputError, match="at most as many modes as masters"):
        serep(beam.phi[:, :7], MASTERS)
    blind[MASTERS, 2] = 0.0
    with pytest.raises(ModelError, match="move or add masters"):
        serep(blind, MASTERS)
