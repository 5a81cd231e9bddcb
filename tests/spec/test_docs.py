"""The page of the grammar says what the models say."""

from __future__ import annotations

import re
from pathlib import Path

from cvxupdate.registry import ELEMENTS
from cvxupdate.spec import check_problem, schema
from cvxupdate.spec.describe import described, fill
from tests.cases.outside import String

PAGE = Path(__file__).parents[2] / "docs" / "problem-files.md"


def test_the_tables_are_those_of_the_models() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert fill(page) == page, "run: python -m cvxupdate.spec.describe docs/problem-files.md"
    assert described(page) == set(schema()["$defs"]) | {"ProblemFile"}


def test_every_link_has_its_heading() -> None:
    page = PAGE.read_text(encoding="utf-8")
    headings = {
        h.strip().lower().replace(" ", "-") for h in re.findall(r"^#+ (.*)$", page, re.MULTILINE)
    }
    assert set(re.findall(r"\]\(#([\w-]+)\)", page)) <= headings


def test_the_table_of_properties_is_that_of_the_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    table = page[page.index("| type | `of` |") :].split("\n<!-- end -->")[0].splitlines()[2:]
    said = {
        kind: set(line.split("|")[2].split())
        for line in table
        for kind in line.split("|")[1].replace(" ", "").split(",")
    }
    assert said == {kind.name: set(kind.text.changes) for kind in ELEMENTS.members()}


def test_what_is_registered_is_described_without_a_word_in_the_page() -> None:
    """A part that the page does not know gets a section of its own, heading and all; taken out, the
    section goes."""
    page = PAGE.read_text(encoding="utf-8")
    ELEMENTS.register(String)
    try:
        more = fill(page)
        assert "### StringRow" in more and "| taut_string | stiffness mass tension" in more
        assert described(more) == set(schema()["$defs"]) | {"ProblemFile"}
        assert fill(more) == more
    finally:
        ELEMENTS.unregister(String)
    assert fill(more) == page


def test_the_smallest_file_of_the_page_holds(tmp_path: Path) -> None:
    blocks = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    path = tmp_path / "smallest.toml"
    path.write_text(blocks[0])
    assert check_problem(path) == ()
