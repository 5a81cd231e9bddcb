"""The page on the methods of the thesis: as the package is, and every method with a way in and a
test."""

import pytest

from docs.methods import PAGE, methods, page, reached

PENDING = {
    # (2.29) alone is a step of (2.24 to 2.29), which `identify --normal crossings` goes
    "recordings.realise.frf.normal_frf",
}
"""Methods of no command, each with its reason; none is added here."""


def test_the_page_is_that_of_the_package() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run python -m docs.methods"


def test_every_method_has_a_way_in() -> None:
    assert {m.code for m in methods() if not m.way} == PENDING


def test_every_method_has_a_test() -> None:
    assert [m.code for m in methods() if not m.tests] == []


@pytest.mark.parametrize("number", ["2.4", "2.29", "2.43", "2.49", "2.76", "2.107", "3.43", "4.7"])
def test_equations_across_the_chapters_are_there(number: str) -> None:
    assert any(number in m.cites for m in methods())


def test_what_nothing_leads_to_is_not_reached() -> None:
    assert ("cvxupdate.study", "run") in reached()
    assert ("cvxupdate.recordings.realise.frf", "normal_frf") not in reached()
