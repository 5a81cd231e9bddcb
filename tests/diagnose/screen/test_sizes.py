"""The best of several sizes, of functions whose least is known."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.screen.sizes import BETWEEN, best_size, between


def parabola(at: float, least: float = 1.0):
    return lambda p: least + (p - at) ** 2


COARSE = np.array([-2.0, -1.0, 0.5, 2.0, 4.0])


@pytest.mark.parametrize("at", [-1.7, 0.1, 0.5, 2.9])
def test_each_round_comes_nearer(at: float) -> None:
    """Two rounds leave no more than the spacing of the last: (2/5) · (2/5) of the neighbours'."""
    gaps = []
    for rounds in range(3):
        found = best_size(parabola(at), COARSE, rounds=rounds)
        assert found is not None and found[1] == pytest.approx(1.0 + (found[0] - at) ** 2)
        gaps.append(abs(found[0] - at))
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] <= 3.5 * (2.0 / (BETWEEN + 1)) / (BETWEEN + 1)


def test_none_where_no_size_helps() -> None:
    assert best_size(parabola(0.4), COARSE, limit=1.0) is None
    assert best_size(parabola(0.4), COARSE, limit=1.02) is not None
    assert best_size(parabola(0.4), np.zeros(0)) is None
    assert best_size(lambda p: np.full(len(p), np.inf), COARSE) is None


def test_a_round_that_finds_no_less_is_the_last() -> None:
    calls = []

    def squares(p):
        calls.append(p)
        return np.where(p == 0.5, 1.0, 5.0)

    assert best_size(squares, COARSE, rounds=5) == (0.5, 1.0)
    assert len(calls) == 2


def test_no_size_beyond_the_ends_is_tried() -> None:
    tried = []

    def squares(p):
        tried.extend(p)
        return -p

    found = best_size(squares, COARSE)
    assert found is not None and found[0] == 4.0 and max(tried) == 4.0
    assert min(between(COARSE, 0)) > -2.0 and max(between(COARSE, 4)) < 4.0
    assert len(between(COARSE, 2)) == BETWEEN and np.all(np.diff(between(COARSE, 2)) > 0)
