"""Explained fractions to first order are those of the plain formula."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.responses.columns import columns_of, sums_of
from cvxupdate.diagnose.responses.first_order import first_order, linearised
from cvxupdate.diagnose.screen.projection import Projection


def test_shares_are_those_of_the_plain_formula(scene):
    *_, point, candidates = scene
    left = Projection.of(linearised(point))
    total = left.residual @ left.residual
    assert sums_of(candidates)
    columns = columns_of(point, candidates)
    for score, J in zip(first_order(point, candidates), columns, strict=True):
        Jp = left.freed(J)
        best = np.linalg.lstsq(Jp, left.residual, rcond=None)[0]
        free = np.linalg.norm(Jp, axis=0) > 1e-6 * np.linalg.norm(J, axis=0)
        if not np.all(free):
            continue
        if score.effect.sign > 0 and best[0] < 0.0:
            assert score.fraction == 0.0
            continue
        rest = left.residual - Jp @ best
        assert score.fraction == pytest.approx(1.0 - rest @ rest / total, abs=1e-9), (
            score.effect.name
        )
