"""Numbers in print: their digits, units and signs."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cvxupdate.report.numbers import (
    decimals,
    number,
    power,
    prefix_of,
    seconds,
    short,
    signed,
    typeset,
    unit_text,
    with_deviation,
)

TABLE = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")


def read(text):
    """The number that a printed text means."""
    return float(text.replace("·10", "e").translate(TABLE))


@given(st.floats(-1e300, 1e300).filter(lambda x: x == 0 or abs(x) > 1e-300), st.integers(2, 8))
def test_a_printed_number_means_the_number(value, digits):
    assert read(number(value, digits)) == pytest.approx(
        value, rel=0.51 * 10.0 ** (1 - digits) if digits < 5 or abs(value) < 1e4 else 1e-4, abs=0
    )


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e5))
def test_value_and_deviation_are_cut_at_the_deviations_second_digit(value, deviation):
    shown, spread = (read(t) for t in with_deviation(value, deviation).split(" ± "))
    assert spread == pytest.approx(deviation, rel=0.051)
    assert abs(shown - value) <= 0.051 * deviation + 5e-5 * abs(value)


@pytest.mark.parametrize(
    ("given_", "text"),
    [
        ((1.0781, 0.00429), "1.0781 ± 0.0043"),
        ((1984.2, 258.4), "1980 ± 260"),
        ((-0.5, 0.1), "−0.50 ± 0.10"),
        ((3.0, None), "3.0000"),
        ((3.0, math.inf), "3.0000"),
        ((2.0, 0.0), "2.0000 ± 0"),
        ((0.9998, 0.0996), "1.000 ± 0.100"),
    ],
)
def test_deviations(given_, text):
    assert with_deviation(*given_) == text


def test_small_things():
    assert number(None) == number(math.nan) == number(math.inf) == "–" and number(0.0) == "0"
    assert number(-0.0123) == "−0.01230" and number(123456.0) == "1.235·10⁵"
    assert (
        short(0.75) == "0.75"
        and short(20.0) == "20"
        and short(5000.0) == "5000"
        and short(1e7) == "1.0000·10⁷"
    )
    assert power(4.33e-10) == "4.3·10⁻¹⁰" and signed(-0.544) == "−0.54" and signed(0.0) == "+0.00"
    assert (
        unit_text("kg/m^3") == "kg/m³"
        and unit_text("1") == ""
        and unit_text("N*m/rad") == "N·m/rad"
    )
    assert (
        prefix_of("Pa", 206e9, None) == (1e9, "GPa")
        and prefix_of("N/m", 0.0, 1984.0) == (1e3, "kN/m")
        and prefix_of("m", 1e4) == (1.0, "m")
    )
    assert [seconds(t) for t in (2e-4, 0.02, 3.5, 600.0)] == [
        "200 µs",
        "20.0 ms",
        "3.50 s",
        "10.0 min",
    ]
    assert decimals([29.6, 182.0]) == 1 and decimals([60.125, 1.0]) == 3 and decimals([5.0]) == 0
    assert (
        typeset("only 4.8e-09 of it; e12.k and 1e3x stay")
        == "only 4.8·10⁻⁹ of it; e12.k and 1e3x stay"
    )
