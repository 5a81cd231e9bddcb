"""Families of element matrices on the page of `run`."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from cvxupdate.report.family_parts import MOST_FAMILIES, family_parts


def family(change: float) -> dict[str, Any]:
    return {
        "name": "all.K",
        "matrix": "K",
        "element": 3,
        "says": "all.K: changed.",
        "least": 0.9,
        "most": 1.25,
        "spread": change * np.array([[0.5, -1.0], [-1.0, 0.0]]),
        "dofs": ("1 z", "2 z"),
        "quantities": ({"name": "κGA", "before": None, "after": 2.5e6, "unit": "N"},),
    }


def test_a_family_has_numbers_and_a_figure_of_its_change() -> None:
    parts = family_parts(SimpleNamespace(families=(family(0.2),)))  # type: ignore[arg-type]
    row = parts[0]["rows"][0]
    assert row["before"] == "unbounded" and row["after"].startswith("2.5")
    assert parts[0]["eigenvalues"] == "0.900 to 1.25" and parts[0]["largest"] == "0.200"
    assert "<svg" in parts[0]["figure"] and "element 3" in parts[0]["figure"]
    assert "−1.00" in parts[0]["figure"] and "−0.00" not in parts[0]["figure"]


def test_one_eigenvalue_is_said_once() -> None:
    alike = SimpleNamespace(families=({**family(0.2), "least": 1.25},))
    assert family_parts(alike)[0]["eigenvalues"] == "1.25"  # type: ignore[arg-type]


def test_nothing_is_drawn_of_nothing_and_of_many_only_some() -> None:
    many = SimpleNamespace(families=(family(0.0),) * 20)
    parts = family_parts(many)  # type: ignore[arg-type]
    assert len(parts) == MOST_FAMILIES and parts[0]["figure"] is None
