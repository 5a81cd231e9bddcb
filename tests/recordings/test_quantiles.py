"""Quantiles by scipy.special against scipy.stats."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from cvxupdate.recordings import quantiles as q


@pytest.mark.parametrize("p", [0.5, 0.05, 1e-3, 1e-9, 1e-30])
@pytest.mark.parametrize("freedoms", [1, 3, 40, 1000])
def test_they_are_those_of_scipy_stats(p: float, freedoms: int) -> None:
    assert q.normal_above(p) == pytest.approx(stats.norm.isf(p), rel=1e-10, abs=1e-12)
    assert q.student_above(p, freedoms) == pytest.approx(
        stats.t.isf(p, freedoms), rel=1e-6, abs=1e-9
    )
    assert q.chi_square_above(p, freedoms) == pytest.approx(stats.chi2.isf(p, freedoms), rel=1e-9)
    assert q.gamma_above(p, freedoms) == pytest.approx(stats.gamma.isf(p, freedoms), rel=1e-9)
    found = q.fisher_two_above(p, freedoms)
    assert stats.f.sf(found, 2, freedoms) == pytest.approx(p, rel=1e-9)


def test_binomial_and_kurtosis() -> None:
    for count, draws in ((0, 4), (3, 3), (40, 60), (300, 400)):
        wanted = stats.binom.sf(count - 1, draws, 0.4473)
        assert q.binomial_reaches(count, draws, 0.4473) == pytest.approx(wanted, rel=1e-9)
    x = np.random.default_rng(1).standard_t(5, 400)
    assert q.excess_kurtosis(x) == pytest.approx(stats.kurtosis(x))
    assert q.excess_kurtosis(np.full(9, 2.5)) == 0.0
