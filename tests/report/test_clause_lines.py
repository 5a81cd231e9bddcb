"""Clauses on a page."""

from cvxupdate.report.clause_lines import NAMED, clause_lines

FLOOR = [f"e{i}.K, mode 1: at least 0.001 of the nominal element" for i in range(1, 31)]


def test_what_holds_of_many_stands_in_one_line() -> None:
    lines = clause_lines(["total mass: as weighed", *FLOOR, "a.E above b.E"], 20)
    assert lines[0] == "total mass: as weighed" and lines[2] == "a.E above b.E"
    assert lines[1].startswith("at least 0.001 of the nominal element: e1.K, mode 1; e2.K, mode 1;")
    assert lines[1].endswith(f"and {30 - NAMED} more") and len(lines) == 3


def test_few_keep_their_names_and_many_lines_are_counted() -> None:
    few = [*FLOOR[:2], "e1.M: mass kept"]
    assert clause_lines(few, 20) == few
    assert clause_lines([f"clause {i}" for i in range(9)], 4)[-1] == "and 5 more"
    assert clause_lines([], 4) == []
