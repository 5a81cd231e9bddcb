"""Complex modes in the space of real ones, against those of the whole matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eig, eigh

from cvxupdate.diagnose.modes.dashpots import RealModes
from cvxupdate.physics.effect import ModelChange
from cvxupdate.physics.growth import at_once


def test_a_strong_dashpot_in_all_orders(lab):
    chain = lab()
    lam, phi = eigh(chain.K, chain.M)
    own, c = np.array([0.012, 0.004, 0.02, 0.007]), 100.0
    real = RealModes(np.sqrt(lam), phi, own)
    change = ModelChange(lambda: None, at_once((2,), "C", np.ones((1, 1))))  # type: ignore[arg-type]
    found = real.with_damping(c * real.damping(change), 4)
    C = chain.M @ phi @ np.diag(2.0 * own * np.sqrt(lam)) @ phi.T @ chain.M
    C[2, 2] += c
    zero, one = np.zeros((4, 4)), np.eye(4)
    s = eig(np.block([[zero, one], [-chain.K, -C]]), np.block([[one, zero], [zero, chain.M]]))[0]
    s = s[s.imag > 0.0]
    s = s[np.argsort(np.abs(s))]
    assert np.sort(np.sqrt(lam) * (1.0 + found.shift)) == pytest.approx(np.abs(s), rel=1e-9)
    assert np.sort(found.zeta) == pytest.approx(np.sort(-s.real / np.abs(s)), rel=1e-8)
    assert found.zeta.max() > 0.1 and np.abs(found.shift).max() > 5e-3


def test_none_leaves_modes_as_they_are(lab):
    chain = lab()
    lam, phi = eigh(chain.K, chain.M)
    own = np.array([0.012, 0.004, 0.02, 0.007])
    found = RealModes(np.sqrt(lam), phi, own).with_damping(np.zeros((4, 4)), 3)
    assert found.zeta == pytest.approx(own[:3], rel=1e-9)
    assert np.abs(found.shift).max() < 1e-12 and np.abs(found.turned).max() < 1e-9
