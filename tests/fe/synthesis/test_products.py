"""Products in real arithmetic are products."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.synthesis.products import drawn, times


def test_products_in_real_arithmetic():
    rng = np.random.default_rng(1)
    A, z = rng.normal(size=(4, 6)), rng.normal(size=(6, 5, 2)) + 1j * rng.normal(size=(6, 5, 2))
    np.testing.assert_allclose(times(A, z), np.einsum("ij,jkl->ikl", A, z), rtol=1e-13)
    np.testing.assert_allclose(times(A + 1j, z), np.einsum("ij,jkl->ikl", A + 1j, z), rtol=1e-13)
    np.testing.assert_allclose(
        times(A, z.transpose(0, 2, 1)), np.einsum("ij,jkl->ilk", A, z), rtol=1e-13
    )
    np.testing.assert_allclose(
        drawn(A, np.swapaxes(z, 0, 1)), np.einsum("mr,rpc->mpc", A, z), rtol=1e-13
    )
