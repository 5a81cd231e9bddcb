"""Families of element matrices on the page of `run`: what changed, the nearest physical element,
and the change entry by entry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report.matrix import matrix
from cvxupdate.report.numbers import number

if TYPE_CHECKING:
    from cvxupdate.update.result import Updated

MOST_FAMILIES = 6
"""Families that are drawn; result.json holds them all."""


def family_parts(updated: Updated) -> list[dict[str, Any]]:
    """A sentence, the numbers of the nearest physical element and a figure for each family."""
    return [_part(i, f) for i, f in enumerate(updated.families[:MOST_FAMILIES])]


def _part(place: int, f: dict[str, Any]) -> dict[str, Any]:
    change = np.asarray(f["spread"])
    largest = float(np.abs(change).max(initial=0.0))
    says = (
        f"Change of each entry of {f['matrix']} of element {f['element']}, of the root of the two "
        "diagonal entries in its row and column."
    )
    picture = None
    if largest > 0.0:
        dofs = list(f["dofs"])
        picture = matrix(f"family{place}", says, change / largest, dofs, dofs, ("", ""))
    return {
        "name": f["name"],
        "says": f["says"],
        "rows": [
            {
                "name": q["name"],
                "before": _value(q["before"]),
                "after": _value(q["after"]),
                "unit": q["unit"],
            }
            for q in f["quantities"]
        ],
        "eigenvalues": " to ".join(dict.fromkeys(number(f[k], 3) for k in ("least", "most"))),
        "largest": number(largest, 3),
        "figure": Markup(picture) if picture else None,
    }


def _value(value: float | None) -> str:
    return "unbounded" if value is None else number(value, 5)
