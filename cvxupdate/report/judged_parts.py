"""What stands beside a good fit on the page of `run`: bounds, shapes that were lost, correlations
of the parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report.matrix import ROWS, matrix
from cvxupdate.report.numbers import fixed

if TYPE_CHECKING:
    from cvxupdate.update.result import Updated


def judged_parts(updated: Updated) -> dict[str, Any]:
    """The counts, the pairs of parameters that are closest, and the figure of all; empty where
    nothing was judged."""
    j, c = updated.judgement, updated.correlations
    if j is None or not updated.parameters:
        return {}
    picture = None
    if c is not None and c.matrix:
        # the names label the columns too, so few fit
        picture = matrix(
            "correlations",
            "Size of the correlation of each two parameters at the solution.",
            np.abs(np.array(c.matrix)),
            c.parameters,
            c.parameters,
            ("", ""),
        )
    return {
        "bounds": f"{j.on_bounds} of {j.parameters}",
        "lost": [
            f"{m['measured']:.5g} Hz ({fixed(_number(m['mac_before']), 3)} → "
            f"{fixed(_number(m['mac_after']), 3)})"
            for m in j.shapes_lost
        ],
        "shapes": any(m.mac_after is not None for m in updated.modes),
        "pairs": [
            {"first": a, "second": b, "correlation": fixed(r, 3)}
            for a, b, r in (() if c is None else c.strongest)
        ],
        "figure": Markup(picture) if picture else None,
        "more": 0 if c is None else max(0, len(c.parameters) - ROWS),
    }


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")
