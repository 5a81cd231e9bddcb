"""The view of a structure: two axes where two are enough, else an isometric one that keeps lengths
and shows z upwards."""

import numpy as np
import pytest

from cvxupdate.report.views import view_of


def moving(axes):
    return np.array([a in axes for a in "xyz"])


@pytest.mark.parametrize(
    ("extent", "motion", "axes"),
    [
        ((2.0, 1.0, 0.0), "xy", ("x", "y")),
        ((2.0, 0.0, 1.0), "x", ("x", "z")),
        ((0.0, 3.0, 1.0), "yz", ("y", "z")),
        ((1.0, 0.0, 0.0), "z", ("x", "z")),
        ((0.0, 0.0, 4.0), "x", ("x", "z")),
        ((0.0, 1.0, 0.0), "x", ("y", "x")),
    ],
)
def test_flat_views(extent, motion, axes):
    xyz = np.random.default_rng(0).random((9, 3)) * extent
    view = view_of(xyz, moving(motion))
    assert view.axes == axes and not view.aside
    assert np.allclose(view.project(xyz), xyz[:, ["xyz".index(a) for a in axes]])


def test_motion_along_a_line_is_drawn_across_it():
    view = view_of(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), moving("x"))
    assert view.aside and view.axes == ("x",)


@pytest.mark.parametrize(
    ("extent", "motion"),
    [
        ((2.0, 1.0, 0.0), "z"),
        ((1.0, 1.0, 4.0), ""),
        ((5.0, 0.5, 0.5), "xyz"),
        ((0.0, 2.0, 3.0), "x"),
        ((1.0, 0.0, 0.0), "yz"),
    ],
)
def test_isometric_views(extent, motion):
    xyz = np.random.default_rng(1).random((30, 3)) * extent
    view = view_of(xyz, moving(motion))
    assert view.axes == () and np.allclose(view.matrix @ view.matrix.T, np.eye(2))  # orthographic
    up = view.project(np.array([0.0, 0.0, 1.0]))
    assert up[0] == pytest.approx(0.0, abs=1e-12) and up[1] > 0.5
    for axis in np.eye(3):
        assert np.linalg.norm(view.project(axis)) > 0.2, "an axis is seen end on"
