"""Many starts on the page of `run`."""

from types import SimpleNamespace
from typing import Any

from cvxupdate.report.starts_parts import MOST, starts_parts


def minimum(objective: float, starts: list[int], **more: Any) -> dict[str, Any]:
    return {
        "objective": objective,
        "starts": starts,
        "ridge": None,
        "on_bounds": 2,
        "fit": {"frequency_error_percent_mean": 0.1634, "mac_mean": 0.9312},
        "differs": [],
    } | more


def parts(count: int, *minima: dict[str, Any]) -> dict[str, Any]:
    report = {"count": count, "minima": list(minima)}
    return starts_parts(SimpleNamespace(starts=report))  # type: ignore[arg-type]


def test_each_minimum_has_a_row() -> None:
    other = {"name": "y1.stiffness", "lowest": -0.716, "here": 1.69}
    found = parts(5, minimum(0.2267, [0, 1, 4]), minimum(4.68, [2], ridge=31.4, differs=[other]))
    assert found["says"] == "5 starts led to 2 minima; 1 start led to no model that is a structure."
    first, second = found["rows"]
    assert first["starts"] == "3 (60 %)" and first["ridge"] == "–" == first["differs"]
    assert (first["error"], first["mac"], first["bounds"]) == ("0.16", "0.931", "2")
    assert second["ridge"] == "31.4"
    assert second["differs"] == "y1.stiffness 1.69 instead of −0.716"
    assert found["mac"] and found["more"] == 0


def test_few_of_many_and_nothing_of_none() -> None:
    assert parts(MOST + 3, *(minimum(k, [k]) for k in range(1, MOST + 4)))["more"] == 3
    assert starts_parts(SimpleNamespace(starts={})) == {}  # type: ignore[arg-type]
    frequencies = minimum(1.0, [0], fit={"frequency_error_percent_mean": 0.1})
    assert not parts(1, frequencies)["mac"]
