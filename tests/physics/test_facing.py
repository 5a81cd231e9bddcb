"""Parts that face each other: where two of them may touch or rub."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.physics.clearance import Clearance
from cvxupdate.physics.facing import facing
from tests.cases.effects import context_of, problem
from tests.cases.elements import lines

PLANE = ["x", "z", "ry"]


def leaves(folder: Path, apart: float, posts: list[tuple[int, int]] | None = None):
    """Two leaves of five nodes, 0.1 m from one to the next, one above the other; ``posts`` join
    them."""
    points = [(0.1 * i, 0.0, z) for z in (0.0, apart) for i in range(5)]
    pairs = [(i, i + 1) for i in (1, 2, 3, 4, 6, 7, 8, 9)] + (posts or [])
    text = lines("beam2d", points, pairs, PLANE)
    spec = problem(folder, text)
    return spec, build_model(spec)


def pairs(model) -> list[tuple[int, int]]:
    return [(int(model.node_ids[a]), int(model.node_ids[b])) for a, b in facing(model)]


@pytest.mark.parametrize("apart", [0.04, 2.0])
def test_bodies_that_nothing_joins_face_each_other_at_any_distance(tmp_path, apart) -> None:
    assert pairs(leaves(tmp_path, apart)[1]) == [(1, 6), (2, 7), (3, 8), (4, 9), (5, 10)]


def test_members_of_one_frame_face_each_other_where_they_are_near(tmp_path) -> None:
    """Nearer than their own next nodes; a frame whose members are far apart has no such places."""
    near = leaves(tmp_path, 0.1, [(1, 6)])[1]
    assert pairs(near) == [(2, 7), (3, 8), (4, 9), (5, 10)]
    assert pairs(leaves(tmp_path, 0.11, [(1, 6)])[1]) == []


def test_a_gap_may_be_between_them(tmp_path) -> None:
    """One-sided either way and two-sided, along and across."""
    spec, model = leaves(tmp_path, 0.04)
    between = [
        e.place for e in Clearance().candidates(context_of(spec, model)) if e.place.nodes == (3, 8)
    ]
    assert [p.dof for p in between] == ["x"] * 3 + ["z"] * 3
