"""Places in words."""

from __future__ import annotations

from cvxupdate.physics import told
from cvxupdate.physics.place import at, numbered, where
from tests.cases.places import PLACES


def test_numbers_in_a_row_are_a_range() -> None:
    assert numbered([12, 3, 4, 5, 9, 10]) == "3 to 5, 9, 10 and 12"
    assert numbered(range(1, 41, 2)).endswith("and 8 more")


def test_places_as_things_and_as_answers() -> None:
    assert [where(p) for p in PLACES] == [
        "node 5 (x)",
        "nodes 2 and 3 (x)",
        "nodes 2, 3 and 9",
        "element 4",
        "elements 3 to 6 and 12",
        "group 'bar'",
        "groups 'a', 'b' and 'c'",
        "the joint of element 6 at node 7",
        "the whole structure",
    ]
    assert [at(p) for p in PLACES] == [
        "at node 5 (x)",
        "between nodes 2 and 3 (x)",
        "at nodes 2, 3 and 9",
        "in element 4",
        "in elements 3 to 6 and 12",
        "in group 'bar'",
        "in groups 'a', 'b' and 'c'",
        "at the joint of element 6 at node 7",
        "in the whole structure",
    ]
    assert told("added_mass", PLACES[0]).title == "an added mass at node 5 (x)"
