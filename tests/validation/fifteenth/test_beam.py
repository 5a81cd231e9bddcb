"""The fifteenth laboratory's beam element."""

from __future__ import annotations

import numpy as np
import pytest

from validation.fifteenth.beam import matrices

LENGTH, EA, GJ, EI, KGA, RHO_A = 0.8, 4e7, 900.0, 1500.0, 3e5, 2.3


def test_a_tip_load_bends_and_shears_as_theory_says() -> None:
    """P (L³/3EI + L/κGA) of one element that is clamped (exact for end loads)."""
    stiff, mass = (EA, GJ, EI, EI, KGA), (RHO_A, 1e-3, 5e-4, 5e-4)
    K, M, _ = matrices(LENGTH, stiff, mass)
    for along in (1, 2):
        P = np.zeros(6)
        P[along] = 1.0
        tip = np.linalg.solve(K[6:, 6:], P)
        assert tip[along] == pytest.approx(LENGTH**3 / (3.0 * EI) + LENGTH / KGA, rel=1e-9)
        moved = np.zeros(12)
        moved[[along, 6 + along]] = 1.0
        assert moved @ M @ moved == pytest.approx(RHO_A * LENGTH, rel=1e-9)
    assert np.allclose(K, K.T) and np.linalg.eigvalsh(K)[:6] == pytest.approx(0.0, abs=1e-3)
