"""Units by name: closed-form factors, and algebra that must hold for any pair of units."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.units import is_unit, parse_unit, scale_to_si

NAMES = [
    "m",
    "mm",
    "in",
    "ft",
    "s",
    "ms",
    "kg",
    "N",
    "kN",
    "lbf",
    "kip",
    "g",
    "V",
    "mV",
    "Pa",
    "psi",
    "rad",
    "ustrain",
]


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("g", 9.80665),
        ("in", 0.0254),
        ("in/s", 0.0254),
        ("kip", 4448.2216152605),
        ("lbf", 4.4482216152605),
        ("lb", 4.4482216152605),
        ("mm/s^2", 1e-3),
        ("m/s2", 1.0),
        ("m/s²", 1.0),
        ("[ m/s² / N ]", 1.0),
        ("g/N", 9.80665),
        ("µm", 1e-6),
        ("um", 1e-6),
        ("in/s^2/lbf", 0.0254 / 4.4482216152605),
        ("100 mV/g", 0.1 / 9.80665),
        ("kN*m", 1e3),
        ("Nm", 1.0),
        ("Newtons", 1.0),
        ("με", 1e-6),
        ("(mm/s^2)/kN", 1e-6),
        ("s^-2", 1.0),
        ("mg", 9.80665e-3),
        ("kgf", 9.80665),
        ("", 1.0),
        ("NONE", 1.0),
    ],
)
def test_factors_are_the_exact_conversions(text: str, factor: float) -> None:
    assert parse_unit(text).factor == pytest.approx(factor, rel=1e-14)


@given(st.sampled_from(NAMES), st.sampled_from(NAMES), st.integers(-3, 3))
def test_products_quotients_and_powers_are_those_of_the_factors(a: str, b: str, n: int) -> None:
    ua, ub = parse_unit(a), parse_unit(b)
    assert parse_unit(f"{a}*{b}").factor == pytest.approx(ua.factor * ub.factor)
    assert parse_unit(f"{a}/({b}*{a})").factor == pytest.approx(1.0 / ub.factor)
    assert parse_unit(f"{a}^{n}").factor == pytest.approx(ua.factor**n)
    assert parse_unit(f"{a}^{n}").dimension == tuple(n * d for d in ua.dimension)


@given(st.text(max_size=30))
def test_any_text_is_a_unit_or_a_recording_error(text: str) -> None:
    assert is_unit(text) in (True, False)


@pytest.mark.parametrize(
    "text", ["/0", "m/0", "1e-400", "1e400", "1e-320 m", f"/({'mm^9*' * 13}m)"]
)
def test_a_factor_without_a_size_is_refused(text: str) -> None:
    """Zero, and what rounds to zero or overflows, wherever it stands."""
    with pytest.raises(RecordingError, match="factor"):
        parse_unit(text)


def test_a_sensitivity_turns_volts_into_the_quantity() -> None:
    assert scale_to_si("acceleration", "V", "z", "100 mV/g") == pytest.approx(9.80665 / 0.1)
    assert scale_to_si("acceleration", "mV", "z", "100 mV/g") == pytest.approx(9.80665 / 100.0)
    assert scale_to_si("acceleration", "V", "z", 0.01) == pytest.approx(100.0)
    assert scale_to_si("force", "lbf", "x", sign=-1) == pytest.approx(-4.4482216152605)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("acceleration", "mm"), "does not measure acceleration"),
        (("acceleration", "V"), "sensitivity"),
        (("force", "newtn"), "newton"),
        (("displacement", "m", "rx"), "rotation"),
        (("force", "N", "x", 0.0), "non-zero"),
        (("force", "m/"), ""),
    ],
)
def test_a_wrong_unit_says_what_is_wrong(arguments: tuple[object, ...], words: str) -> None:
    if arguments[1] == "m/":
        with pytest.raises(RecordingError):
            scale_to_si(*arguments)  # type: ignore[arg-type]
        return
    with pytest.raises(RecordingError, match=words):
        scale_to_si(*arguments)  # type: ignore[arg-type]


def test_a_ratio_may_name_the_response_alone() -> None:
    assert scale_to_si("acceleration", "g/N", "x", per="force") == scale_to_si(
        "acceleration", "g", "x", per="force"
    )
    with pytest.raises(RecordingError):
        scale_to_si("acceleration", "mm/N", "x", per="force")
