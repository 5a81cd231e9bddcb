"""Natural frequencies and shapes in a diagnosis: measured, of the model before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

from markupsafe import Markup

from cvxupdate.report.moving import moving_pair
from cvxupdate.report.numbers import fixed, number, signed

if TYPE_CHECKING:
    from cvxupdate.diagnose.shown import Beside, ModeBeside

MOST_ROWS = 40
DRAWN = 6
"""Shapes that move on the page: each is a picture of every element in twelve phases."""


def mode_rows(beside: Beside | None) -> list[dict[str, str]]:
    """The table of natural frequencies as text; a dash where nothing is known."""
    modes = beside.modes[:MOST_ROWS] if beside is not None else ()
    return [
        {
            "number": str(k),
            "use": "held out" if m.use == "hold-out" else "fitted",
            "measured": number(m.measured, 5),
            "before": number(m.before, 5),
            "before_error": _error(m.before, m.measured),
            "after": number(m.after, 5),
            "after_error": _error(m.after, m.measured),
            "mac_before": fixed(m.mac_before, 3),
            "mac_after": fixed(m.mac_after, 3),
        }
        for k, m in enumerate(modes, start=1)
    ]


def _error(model: float | None, measured: float | None) -> str:
    if model is None or measured is None:
        return ""
    return f"{signed(100.0 * (model - measured) / measured)} %"


def moving_modes(beside: Beside | None) -> list[tuple[str, Markup]]:
    """(caption, picture) of the first modes: the model before and after, and what was measured."""
    if beside is None or beside.geometry is None:
        return []
    out: list[tuple[str, Markup]] = []
    for k, m in enumerate(beside.modes, start=1):
        drawn = moving_pair(
            beside.geometry, m.shape_before, m.shape_after, m.motion, f"Mode {k}, moving"
        )
        if drawn is not None:
            out.append((f"Mode {k}: {_frequencies(m)}", Markup(drawn)))
        if len(out) == DRAWN:
            break
    return out


def _frequencies(m: ModeBeside) -> str:
    parts = (("measured", m.measured), ("before", m.before), ("after", m.after))
    return ", ".join(f"{word} {number(f)} Hz" for word, f in parts if f is not None)
