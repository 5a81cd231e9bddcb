"""Minima are told apart by ridges, straight ways and bent ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.update.basins import basins, starts_notes, starts_report
from cvxupdate.update.starts import StartEnd
from tests.cases.structures import PORTAL, portal, structure

MODEL = structure(portal(), PORTAL)[1]
BOUNDED = tuple(replace(q, lower=-2.0, upper=2.0) for q in MODEL.parameters[:2])


def double_well(p: np.ndarray) -> float:
    return float((p[0] ** 2 - 1.0) ** 2 + 0.1)


def ring(p: np.ndarray) -> float:
    """A valley along the unit circle, closed at its lower half."""
    return float(0.1 + 0.05 * (np.hypot(*p) - 1.0) ** 2 + max(0.0, -p[1]))


def end(number: int, *p: float, objective: float | None = None) -> StartEnd:
    value = double_well(np.array(p)) if objective is None else objective
    return StartEnd(number, value, p, "converged", 3, 0.1)


def test_minima_are_different_where_a_ridge_stands_between_them() -> None:
    found = basins([end(0, -1.0), end(1, 1.0), end(2, 1.001), end(3, -0.999)], double_well)
    assert sorted(b.starts for b in found) == [(0, 3), (1, 2)]
    assert found[0].ridge is None and found[1].ridge == 1.1  # at the middle
    valley = basins([end(0, -1.0, objective=0.1), end(1, 1.0, objective=0.1001)], lambda p: 0.1)
    assert [b.starts for b in valley] == [(0, 1)]  # a flat valley is one minimum
    assert basins([end(0, 0.0, objective=np.inf)], double_well) == ()


def test_a_bent_valley_is_one_where_the_loop_finds_the_way_round() -> None:
    ends = [end(k, x, y, objective=0.1) for k, (x, y) in enumerate([(-0.8, 0.6), (0.8, 0.6)])]

    def down(p: np.ndarray) -> np.ndarray:
        return p / np.hypot(*p)

    assert len(basins(ends, ring)) == 2
    assert [b.starts for b in basins(ends, ring, down)] == [(0, 1)]
    closed = [end(k, x, 0.0, objective=0.1) for k, x in enumerate((-1.0, 1.0))]
    assert len(basins(closed, ring, lambda p: p)) == 2  # a descent that stays on the ridge
    assert len(basins(closed, double_well, lambda p: np.array([1.0, 0.0]))) == 2


def test_exact_recordings_have_one_minimum_whatever_rounding_leaves() -> None:
    ends = [end(0, 0.2, objective=1e-10), end(1, 0.2, objective=1e-8), end(2, 0.2, objective=1e-4)]
    assert [b.starts for b in basins(ends, lambda p: 0.0)] == [(0, 1), (2,)]


def test_the_report_says_in_what_minima_differ() -> None:
    ends = [end(0, -1.0, 2.0), end(1, 1.0, 2.0), end(2, 1.0, 2.0, objective=0.2)]
    minima = basins(ends, double_well)
    report = starts_report(ends, minima, BOUNDED, lambda p: {"mac_mean": float(p[1])})
    first, second = report["minima"][:2]
    assert first["on_bounds"] == 1 and first["fit"] == {"mac_mean": 2.0}
    assert second["differs"] == [{"name": BOUNDED[0].name, "lowest": -1.0, "here": 1.0}]
    assert second["ridge"] == 1.1 and sum(b["share"] for b in report["minima"]) == 1.0
    assert "of 3 different ones; the next lowest is 0.1" in starts_notes(report)[0]
    assert starts_notes({}) == ()
    assert "None of the starts" in starts_notes(starts_report(ends, (), BOUNDED, dict))[0]
