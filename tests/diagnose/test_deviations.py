"""Deviations of unknowns in whatever units."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.fit import inverted


def test_units_do_not_matter():
    """Columns thirteen decades apart, as those of a stiffness factor and of a heavy fixture's mass:
    a pseudo-inverse of the plain matrix takes the lighter one's deviation for nothing."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(30, 5))
    d = np.array([1e-7, 1e-3, 1.0, 1e3, 1e6])
    wanted = np.linalg.inv(A.T @ A) / np.outer(d, d)
    assert inverted((A * d).T @ (A * d)) == pytest.approx(wanted, rel=1e-8)
    lightest = np.linalg.pinv((A * d).T @ (A * d))[0, 0]
    assert lightest < 1e-6 * wanted[0, 0]


def test_what_nothing_tells_has_a_large_deviation_and_not_none():
    A = np.random.default_rng(4).normal(size=(30, 3))
    twice = np.column_stack([A, A[:, 2], np.zeros(30)])  # two alike, one that is not heard
    found = np.sqrt(np.diag(inverted(twice.T @ twice)))
    apart = np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    assert found[:2] == pytest.approx(apart[:2], rel=1e-6)
    assert np.all(found[2:] > 1e5) and np.all(np.isfinite(found))
