"""Figures of a page: the same input the same bytes, labels that can be read as text."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cvxupdate.report.svg import draw, draw_panels


def labels(svg: str) -> list[str]:
    return [t.strip() for t in re.findall(r"<text[^>]*>([^<]*)</text>", svg)]


@pytest.mark.parametrize("ends", [(1e-4, 1e3), (20.0, 60.0), (0.003, 0.02)])
def test_logarithmic_axes_have_labels_in_plain_text(ends: tuple[float, float]) -> None:
    """Whole decades, or less than one, where matplotlib labels what lies between."""
    svg = draw("a", "says", 4.0, 3.0, lambda ax: ax.loglog(ends, ends))
    powers = [t for t in labels(svg) if "10" in t]
    assert len(powers) >= 2 and all(re.fullmatch(r"(\d×)?10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", t) for t in powers)
    assert "mathdefault" not in svg


def test_minor_ticks_are_drawn_and_nothing_overlaps() -> None:
    """They are left out of the layout alone; panels stand beside one another."""

    def paint(axes: list) -> None:
        for ax in axes:
            ax.semilogy(np.arange(5.0), 10.0 ** np.arange(5.0))

    svg = draw_panels("b", "says", 6.0, 3.0, 1, 2, paint)
    assert svg == draw_panels("b", "says", 6.0, 3.0, 1, 2, paint)
    assert svg.count("<use") > 2 * 4 * 8  # eight between the powers of ten
    places = [float(x) for x in re.findall(r'<text[^>]*x="([\d.]+)"[^>]*>10⁰', svg)]
    assert len(places) == 2 and places[1] - places[0] > 2.5 * 72
