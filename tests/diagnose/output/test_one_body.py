"""A body between two nodes that two findings say."""

from __future__ import annotations

from types import SimpleNamespace

from cvxupdate.diagnose.output.one_body import one_body_lines
from cvxupdate.fe.build import build_model
from cvxupdate.physics.place import Place
from tests.cases.effects import problem
from tests.cases.elements import lines


def found(physics, place, **figures):
    return SimpleNamespace(physics=physics, place=place, parameters=figures)


def test_mass_and_middle_of_both(tmp_path) -> None:
    """0.55 kg at two fifths of an element are 1.44 times that on it and less at both ends."""
    text = lines(
        "beam2d",
        [(0.2 * i, 0.0, 0.0) for i in range(4)],
        [(1, 2), (2, 3), (3, 4)],
        ["x", "z", "ry"],
    )
    model = build_model(problem(tmp_path, text))
    own = model.total_mass() / 3.0
    heavier = found("mass_change", Place(elements=(2,)), factor=1.0 + 0.79 / own)
    lighter = found("added_mass", Place(nodes=(3,)), m=-0.24)
    (line,) = one_body_lines([heavier, lighter], model)
    assert "one body of 0.550 kg on that element, 144 mm from node 3 (200 mm long)" in line
    elsewhere = found("added_mass", Place(nodes=(1,)), m=-0.24)
    assert one_body_lines([heavier, elsewhere], model) == [], "no end of that element"
    gone = found("added_mass", Place(nodes=(3,)), m=-0.7)
    assert one_body_lines([heavier, gone], model) == [], "its middle would be beyond"
    many = found("mass_change", Place(elements=(1, 2)), factor=2.0)
    assert one_body_lines([many, lighter], model) == one_body_lines([lighter], model) == []
