"""Sizes as a technician writes them."""

from __future__ import annotations

import pytest

from cvxupdate.physics.units import number, quantity


@pytest.mark.parametrize(
    ("value", "unit", "wanted"),
    [
        (3490.0, "N/m", "3.49 kN/m"),
        (2.1e6, "N/m", "2.10 MN/m"),
        (812.0, "N/m", "812 N/m"),
        (999.9, "N/m", "1.00 kN/m"),
        (4.2e10, "N·m/rad", "42.0 GN·m/rad"),
        (1.21, "kg", "1.21 kg"),
        (0.0348, "kg", "34.8 g"),
        (-0.0348, "kg", "−34.8 g"),
        (1234.0, "kg", "1230 kg"),
        (0.0037, "s", "3.70 ms"),
        (2e-6, "s", "2.00 µs"),
        (-1830.0, "N", "−1.83 kN"),
        (0.0377, "N·s/m", "0.0377 N·s/m"),
        (0.0, "N/m", "0 N/m"),
        (0.012, "", "0.0120"),
        (3e-9, "s", "0.00300 µs"),
    ],
)
def test_sizes_have_the_prefix_that_suits_them(value: float, unit: str, wanted: str) -> None:
    assert quantity(value, unit) == wanted


def test_numbers_are_written_out() -> None:
    assert [number(v) for v in (0.0, 1.0, 9.996, 12345.0, 0.000123)] == [
        "0",
        "1.00",
        "10.0",
        "12300",
        "0.000123",
    ]
