"""The inverse of what a fit has of its unknowns, where divide and conquer does not converge."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.fit import inverted


def test_no_matrix_ends_a_diagnosis(monkeypatch: pytest.MonkeyPatch) -> None:
    """The laboratory's 44024: finite and well conditioned, "Eigenvalues did not converge"."""
    A = np.random.default_rng(2).normal(size=(9, 5))
    H = A.T @ A

    def stuck(_: np.ndarray) -> None:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    usual = inverted(H)
    monkeypatch.setattr(np.linalg, "eigh", stuck)
    assert inverted(H) == pytest.approx(usual, rel=1e-9)
    assert usual == pytest.approx(np.linalg.inv(H), rel=1e-9)
