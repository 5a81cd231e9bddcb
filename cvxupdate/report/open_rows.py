"""Combinations of parameters that the recordings leave open, for a page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import number, signed

if TYPE_CHECKING:
    from cvxupdate.update.result import Updated


def open_rows(updated: Updated, most: int) -> list[dict[str, Any]]:
    """The first ``most``: the sentence, the deviation, the combination."""
    return [
        {
            "says": c["says"],
            "deviation": number(c["standard_deviation"], 3),
            "combination": ", ".join(
                f"{signed(v)} {name}" for name, v in c["coefficients"].items()
            ),
        }
        for c in updated.undetermined[:most]
    ]
