"""Tables of the modes in responses: what of their shapes is kept."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.modes.identified import Identified, driven, heard
from cvxupdate.recordings.types import Channel, ModeTable, Origin

CHANNELS = tuple(Channel(n, "x", "displacement") for n in (1, 2, 3, 4))


def table(shapes, std) -> ModeTable:
    count = len(shapes)
    return ModeTable(
        Origin("", "by hand"),
        np.arange(1.0, count + 1.0),
        np.full(count, 0.01),
        np.full(count, 0.01),
        np.full(count, 0.001),
        CHANNELS,
        np.array(shapes),
        np.array(std),
        np.zeros(count, dtype=np.int64),
    )


def test_entries_that_are_noise_beside_all_that_is_known_of_a_shape_are_left_out():
    weak = [1.0, 0.03, -0.02, 0.3], [1.1, 0.0, 0.003, 0.5]
    loud = [1.0, 0.4, -0.1, 0.05], [0.0, 0.02, 0.2, 0.1]
    found = heard(table([weak[0], loud[0]], [weak[1], loud[1]]))
    np.testing.assert_allclose(found.shapes[0], [np.nan, 1.0, -0.02 / 0.03, np.nan])
    np.testing.assert_allclose(found.shape_std[0], [np.nan, 0.0, 0.1, np.nan])
    np.testing.assert_allclose(found.shapes[1], loud[0])
    np.testing.assert_allclose(found.shape_std[1], loud[1])


def test_a_shape_of_which_nothing_is_known_stays_as_it_is():
    unknown = [1.0, 0.5, -0.2, 0.3], [0.6, 0.4, 0.3, 0.3]
    found = heard(table([unknown[0]], [unknown[1]]))
    np.testing.assert_allclose(found.shapes[0], unknown[0])
    np.testing.assert_allclose(found.shape_std[0], unknown[1])


def test_a_shaker_stands_at_a_place_or_two():
    """And brings its mass; a hammer goes from place to place."""

    def at(*nodes: int) -> Identified:
        drives = tuple(Channel(n, "x", "force") for n in nodes)
        return Identified(table([[1.0, 0.5, 0.2, 0.1]], [[0.0, 0.1, 0.1, 0.1]]), drives, np.ones(1))

    assert driven([at(2), at(2, 3)]) == ("n2.x", "n3.x")
    assert driven([at(2), at(3), at(4)]) == () == driven([])
