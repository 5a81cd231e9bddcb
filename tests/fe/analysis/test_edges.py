"""Points of an edge: rigid motions of its ends are those of its points, its own coordinates vanish
at both ends, and slopes are those of the deflections."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.fe.analysis.edges import Edge

START, END = np.array([0.2, -0.1, 0.4]), np.array([0.5, 0.3, 0.1])


def edge(turns: bool = True, ruled: bool = False) -> Edge:
    return Edge(3, 7, START, END, turns, ruled, ruled)


@pytest.mark.parametrize("ruled", [False, True])
def test_rigid_motions_are_followed(ruled: bool) -> None:
    rng = np.random.default_rng(1)
    shift, turn = rng.normal(size=3), rng.normal(size=3)

    def moved(x: np.ndarray) -> np.ndarray:
        return np.concatenate([shift + np.cross(turn, x), turn])

    ends = np.concatenate([moved(START), moved(END)])
    for t in (0.1, 0.5, 0.83):
        there = edge(ruled=ruled).followed(t) @ ends
        np.testing.assert_allclose(there, moved(START + t * (END - START)), atol=1e-12)


def test_a_truss_follows_its_translations_only() -> None:
    out = edge(turns=False).followed(0.25)
    np.testing.assert_allclose(out[:3, :3], 0.75 * np.eye(3))
    assert not out[3:].any() and not out[:, 3:6].any()
    assert len(edge(turns=False).names) < len(edge().names)


def test_its_own_coordinates_vanish_at_both_ends() -> None:
    """But for slopes of an edge that is held straight; of others the ends' rotations are."""
    slopes = np.array([name.startswith("slope") for name, _ in edge().names])
    for e, ends in ((edge(), 6), (edge(ruled=True), 3)):
        moves = slopes & (ends == 3)
        for t in (0.0, 1.0):
            np.testing.assert_allclose(e.further(t)[:ends], 0.0, atol=1e-12)
            np.testing.assert_allclose(e.further(t)[:, ~moves], 0.0, atol=1e-12)
        middle = np.abs(e.further(0.37))
        np.testing.assert_array_equal(middle.max(axis=0) > 0.0, moves | ~slopes)
        assert middle.shape[1] == len(e.names)


def test_rotations_across_are_the_slopes_of_deflections() -> None:
    """Hermite's cubic and the bubbles without shear: r = e × du/ds, by differences."""
    e, h = edge(), 1e-6
    along, _, _, length = e.axes
    bends = [k for k, (name, _) in enumerate(e.names) if name.startswith("bend")]
    across = np.eye(3) - np.outer(along, along)
    for part, columns in ((e.followed, slice(None)), (e.further, bends)):
        rate = (part(0.4 + h) - part(0.4 - h))[:3, columns] / (2.0 * h * length)
        wanted = np.cross(along, (across @ rate).T).T
        np.testing.assert_allclose(across @ part(0.4)[3:, columns], wanted, atol=1e-7)
