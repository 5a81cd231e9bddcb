"""How elements are divided: children fill the parent, meet each other, and keep its axes."""

from itertools import pairwise

import numpy as np
import pytest

from cvxupdate.registry import ELEMENTS
from cvxupdate.spec import division
from cvxupdate.spec.division import Division

SQUARE = np.array([[0.0, 0.0], [2.0, 0.1], [1.8, 1.5], [-0.2, 1.1]])


def area(points: np.ndarray) -> float:
    x, y = points.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


def divided(nodes: int, parts: int) -> Division:
    found = division.surface(nodes, parts)
    assert found is not None
    return found


@pytest.mark.parametrize("parts", [1, 2, 3, 4])
@pytest.mark.parametrize("nodes", [3, 4])
def test_a_sheet(nodes: int, parts: int) -> None:
    """n² children of one sense of rotation and, of a triangle, of one size, that fill the parent;
    its own nodes are the first points."""
    found, corners = divided(nodes, parts), SQUARE[:nodes]
    assert len(found.children) == parts**2
    assert np.array_equal(found.weights[:nodes], np.eye(nodes))
    assert np.allclose(found.weights.sum(axis=1), 1.0)
    points = found.weights @ corners
    areas = np.array([area(points[list(child)]) for child in found.children])
    assert np.all(areas > 0.0)
    assert areas.sum() == pytest.approx(area(corners), rel=1e-12)
    if nodes == 3:
        assert np.allclose(areas, area(corners) / parts**2)
    assert len(np.unique(np.round(points, 9), axis=0)) == len(points)


def test_children_keep_the_axes_of_a_quadrilateral() -> None:
    """From the first node to the second as the parent, so Dx stays where it was."""
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]])
    found = divided(4, 3)
    for child in found.children:
        a, b, _, d = (found.weights @ corners)[list(child)]
        assert np.allclose(b - a, [1.0, 0.0])
        assert np.allclose(d - a, [0.0, 2.0 / 3.0])


@pytest.mark.parametrize("nodes", [3, 4])
def test_neighbours_agree_on_the_points_they_share(nodes: int) -> None:
    """Whichever way round, from whichever corner."""
    found = divided(nodes, 4)
    here, there = [7, 9, 4, 2][:nodes], [9, 7, 21, 30][:nodes]
    keys = [{found.key(p, ids) for p in range(len(found.weights))} for ids in (here, there)]
    assert len(keys[0] & keys[1]) == 5


def test_a_line() -> None:
    found = division.line(2, 3)
    assert found is not None
    points = found.weights @ np.array([[0.0], [3.0]])
    ends = [points[list(child)].ravel() for child in found.children]
    assert np.allclose(ends, list(pairwise(range(4))))
    assert division.line(1, 2) is None


@pytest.mark.parametrize("kind", ELEMENTS.members(), ids=lambda k: k.name)
def test_what_has_an_outline_can_be_divided(kind: type) -> None:
    counts = {"line": (2,), "rectangle": (4,), "surface": (3, 4)}.get(kind.text.outline, ())
    if kind.name in ("gyroscopic", "exact_beam"):  # nothing is gained: a disc, and no mesh error
        counts = ()
    for count in counts:
        assert len(kind.text.divide(count, 2).children) == 2 ** (1 if count == 2 else 2)
    if kind.text.outline == "solid":
        assert len(kind.text.divide(kind.nodes, 2).children) == 8
    elif not counts:
        assert kind.text.divide(2, 2) is None
