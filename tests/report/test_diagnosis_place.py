"""The name of a finding stands over its mark."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.report.diagnosis_place import EDGE, LETTER, name_offset

SHEET = np.array([[0.0, 0.0], [0.6, 0.0], [0.6, 0.4], [0.0, 0.4]])
SIZE = (5.0, 4.0)


def test_a_name_is_over_its_mark_where_there_is_room() -> None:
    """Right of the middle too, where it ended at the mark, far from it in a narrow font."""
    for x in (0.3, 0.35, 0.25):
        assert name_offset(SHEET, x, 20, SIZE) == pytest.approx(0.0, abs=1e-9)


def test_a_name_at_the_rim_is_moved_no_further_than_it_needs() -> None:
    left, right = (name_offset(SHEET, x, 30, SIZE) for x in (0.0, 0.6))
    assert left == pytest.approx(-right) and left > 0.0
    scale = 72.0 * SIZE[0] / (0.6 * 1.24)
    mark = 36.0 * SIZE[0] - 0.3 * scale
    assert mark + left - 0.5 * LETTER * 30 == pytest.approx(EDGE)
