"""Orders that are kept: the same answers, whatever was factored before."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe import orders
from cvxupdate.fe.factor import OrderedFactor, factored
from tests.cases.elements import build, grid

m = build(grid(np.linspace(0, 0.5, 7), np.linspace(0, 0.3, 5))).matrices()


def test_kept_orders_change_no_answer() -> None:
    rng = np.random.default_rng(1)
    b = rng.standard_normal((m.K.shape[0], 3))
    for shift in (1e5, 4e5, -1e4):
        A = m.K + shift * m.M
        kept, anew = factored(A, again=True), factored(A)
        assert isinstance(kept, OrderedFactor)
        assert np.allclose(A @ kept.solve(b), b, atol=1e-7)
        assert np.allclose(A @ kept.solve(b[:, 0]), b[:, 0], atol=1e-7)
        assert kept.negatives() == anew.negatives()


def test_an_order_depends_on_the_pattern_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """First asked for a matrix that has no factors at all, then after many other patterns: the same
    solution to the last bit."""
    A = sp.csc_array(m.K + 1e5 * m.M)
    b = np.arange(float(A.shape[0]))
    solved = factored(A, again=True).solve(b)
    orders._KNOWN.clear()
    with pytest.raises(ModelError, match="the stiffness is singular"):
        factored(
            sp.csc_array((0.0 * A.data, A.indices, A.indptr), A.shape), "the stiffness", again=True
        )
    for size in range(2, 2 + 2 * orders.KEPT):
        factored(sp.diags_array(np.ones(size)), again=True)
    assert len(orders._KNOWN) == orders.KEPT
    assert np.array_equal(factored(A, again=True).solve(b), solved)
    monkeypatch.setattr(orders, "SMALL", 10)
    assert not isinstance(factored(A, again=True), OrderedFactor)
