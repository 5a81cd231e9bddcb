"""The page on the methods of the thesis: as the package is, and every method with a way in and a
test."""

import pytest

from docs.methods import PAGE, cited, methods, page, reached

CORE = [
    "2.1",
    "2.2",
    "2.3",
    "2.4",
    "2.5",
    "2.6",
    "2.7",
    "2.8",
    "2.9",
    "2.10",
    "2.12",
    "2.13",
    "2.14",
    "2.15",
    "2.16",
    "2.17",
    "2.21",
    "2.22",
    "2.23",
    "2.25",
    "2.29",
    "2.32",
    "2.34",
    "2.37",
    "2.43",
    "2.49",
    "2.51",
    "2.53",
    "2.55",
    "2.56",
    "2.57",
    "2.64",
    "2.69",
    "2.70",
    "2.71",
    "2.72",
    "2.75",
    "2.77",
    "2.80",
    "2.83",
    "2.85",
    "2.86",
    "2.88",
    "2.90",
    "2.91",
    "2.92",
    "2.97",
    "2.100",
    "2.101",
    "2.103",
    "2.107",
    "2.111",
    "2.113",
    "2.115",
    "2.121",
    "2.123",
    "2.124",
    "3.9",
    "3.16",
    "3.37",
    "3.43",
    "3.44",
    "3.47",
    "3.48",
    "3.50",
    "4.3",
    "4.7",
    "4.11",
    "4.18",
    "4.23",
    "5.6",
    "5.12",
    "5.15",
    "5.32",
    "6.5",
    "6.8",
    "6.13",
    "6.21",
]
"""The equations of chapters 2 to 6 that are methods of their own; the others lead up to them."""


@pytest.mark.slow
def test_the_page_is_that_of_the_package() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run python -m docs.methods"


def test_every_method_has_a_way_in() -> None:
    assert [m.code for m in methods() if not m.way] == []


def test_every_method_has_a_test() -> None:
    assert [m.code for m in methods() if not m.tests] == []


@pytest.mark.parametrize("number", CORE)
def test_every_numbered_method_is_there(number: str) -> None:
    assert any(number in m.cites for m in methods())


def test_brackets_are_read_as_they_are_written() -> None:
    text = "One (Baruch 1978; 2.76), two (2.17 to 2.19), three (3.5–3.6; as printed), 5 Hz (2 m)."
    assert cited(text) == ["2.76", "2.17", "2.18", "2.19", "3.5", "3.6"]
    assert cited("a chain (of 2.5 kg), bounds (0.2 to 2.5)") == []


def test_what_nothing_leads_to_is_not_reached() -> None:
    assert ("cvxupdate.study", "run") in reached()
    assert ("cvxupdate.recordings.realise.indicators", "complexity_area") not in reached()
