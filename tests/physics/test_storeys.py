"""Between what a brace or a damper of a frame may hang."""

from __future__ import annotations

from pathlib import Path

from cvxupdate.fe.build import build_model
from cvxupdate.physics.hysteresis import Hysteresis
from cvxupdate.physics.storeys import storeys
from cvxupdate.physics.viscous_damper import ViscousDamper
from tests.cases.effects import context_of, problem
from tests.cases.elements import lines

PLANE = ["x", "z", "ry"]


def frame(folder: Path):
    """Two storeys, columns of two elements each: corners 3, 5 on the left and 8, 10 on the right
    (nodes 1 and 6 at the feet), beams of two elements with 11 and 12 in the middle."""
    points = [(x, 0.0, 0.5 * i) for x in (0.0, 2.0) for i in range(5)]
    points += [(1.0, 0.0, 1.0), (1.0, 0.0, 2.0)]
    up = [(i, i + 1) for i in (1, 2, 3, 4, 6, 7, 8, 9)]
    text = lines("beam2d", points, [*up, (3, 11), (11, 8), (5, 12), (12, 10)], PLANE)
    spec = problem(folder, text)
    return spec, build_model(spec)


def test_neighbouring_corners_across_their_member(tmp_path) -> None:
    _, model = frame(tmp_path)
    nodes = model.node_ids[model.dof_node]
    found = {(frozenset(nodes[[a, b]].tolist()), kind) for a, b, kind in storeys(model)}
    assert found == {
        (frozenset((3, 5)), "x"),
        (frozenset((8, 10)), "x"),
        (frozenset((3, 8)), "z"),
        (frozenset((5, 10)), "z"),
    }


def test_dampers_and_laws_may_stand_there(tmp_path) -> None:
    """Each once, though the members are of several elements."""
    spec, model = frame(tmp_path)
    context = context_of(spec, model)
    for kind in (ViscousDamper(), Hysteresis()):
        places = [e.place for e in kind.candidates(context) if len(e.place.nodes) == 2]
        across = [(set(p.nodes), p.dof) for p in places]
        assert across.count(({3, 5}, "x")) == 1 and ({3, 8}, "x") not in across
        assert all(p.dof in ("x", "z") for p in places)
