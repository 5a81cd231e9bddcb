"""Modes of today that the reference has, told by what was measured in both states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.same import as_before
from cvxupdate.recordings.types import ModeTable
from tests.cases.structures import PORTAL, TRUTH, measured, portal, structure

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")


def states() -> tuple[object, ModeTable, ModeTable]:
    """A portal, its modes 1 to 5 with the highest taken for mode 7 by hand, and the same modes
    again, moved by a few per cent, in another order, with one that was not there."""
    m = structure(portal(), PORTAL)[1]
    before = measured(m, TRUTH, [1, 2, 3, 4, 5], channels=CHANNELS)
    before = replace(before, pairs=np.array([1, 2, 3, 4, 7]))
    order = [3, 0, 4, 2]
    f = np.append(before.frequency[order] * [0.97, 1.01, 0.96, 1.0], 0.9 * before.frequency[1])
    q, _ = np.linalg.qr(before.shapes.T, mode="complete")
    today = replace(
        before,
        frequency=f,
        frequency_std=1e-3 * f,
        damping=np.full(5, np.nan),
        damping_std=np.full(5, np.nan),
        shapes=np.vstack([-2.0 * before.shapes[order], q[:, 5]]),
        pairs=np.zeros(5, dtype=np.int64),
    )
    return m, before, today


def test_modes_go_with_those_of_the_reference_and_what_is_new_stays_open():
    m, before, today = states()
    (found,) = as_before(m, [today], [before])
    assert found.pairs.tolist() == [4, 1, 7, 3, 0]


def test_pairs_of_the_file_stay_and_without_shapes_nothing_is_known():
    m, before, today = states()
    named = replace(today, pairs=np.array([0, 0, 0, 0, 3]))
    (found,) = as_before(m, [named], [before])
    assert found.pairs.tolist() == [4, 1, 7, 0, 3]
    bare = replace(today, shapes=None, shape_std=None, channels=())
    assert as_before(m, [bare], [before])[0].pairs.tolist() == [0] * 5


def test_what_is_held_out_is_paired_as_ever_and_no_mode_serves_twice():
    m, before, today = states()
    held = replace(today, origin=replace(today.origin, use="hold-out"))
    again = replace(today, frequency=1.05 * today.frequency)  # not the same modes measured twice
    found = as_before(m, [held, today, again], [before])
    assert [t.pairs.tolist() for t in found] == [[0] * 5, [4, 1, 7, 3, 0], [0] * 5]
