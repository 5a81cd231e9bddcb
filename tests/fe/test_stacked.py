"""Stacks of symmetric eigenproblems."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.fe.stacked import eigh


def stack() -> np.ndarray:
    X = np.random.default_rng(3).standard_normal((4, 12, 5))
    return X @ X.transpose(0, 2, 1)  # of rank five


def test_where_divide_and_conquer_fails_each_is_solved_by_itself(monkeypatch) -> None:
    """On the mass that a softer column adds to 72 modes of a portal, the diagnosis ended in
    "Eigenvalues did not converge"."""
    A = stack()
    values, _ = eigh(A)

    def fails(_: np.ndarray) -> None:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr(np.linalg, "eigh", fails)
    again, V = eigh(A)
    np.testing.assert_allclose(again, values, atol=1e-12)
    np.testing.assert_allclose((V * again[:, None]) @ V.transpose(0, 2, 1), A, atol=1e-12)
    one, _ = eigh(A[0])
    np.testing.assert_allclose(one, values[0], atol=1e-12)


def test_what_is_not_finite_is_refused() -> None:
    A = stack()
    A[1, 2, 3] = A[1, 3, 2] = np.nan
    with pytest.raises(np.linalg.LinAlgError):
        eigh(A)
