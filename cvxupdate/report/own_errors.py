"""The error of each recording by itself, as rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import fixed, number
from cvxupdate.report.words import METRICS

if TYPE_CHECKING:
    from cvxupdate.correlate.own_errors import OwnError

MOST = 300
"""Rows at most; result.json holds them all."""


def own_rows(errors: Sequence[OwnError]) -> list[dict[str, Any]]:
    """Recording, metric, its value before and after; ``held`` marks what was held out."""
    out = []
    for e in errors[:MOST]:
        name, unit = METRICS.get(e.metric, (e.metric, ""))
        before, after = (
            f"{fixed(v)} %" if unit == "%" else number(v, 3) for v in (e.before, e.after)
        )
        held = e.use != "fit"
        out.append(
            {
                "recording": e.recording + (", held out" if held else ""),
                "metric": name,
                "before": before,
                "after": after,
                "held": held,
            }
        )
    return out
