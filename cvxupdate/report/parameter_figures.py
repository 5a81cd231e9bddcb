"""The figure of the updated parameters: values and intervals between their bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cvxupdate.report.figures import WIDTH, shortened
from cvxupdate.report.numbers import prefix_of, short
from cvxupdate.report.svg import AFTER, BEFORE, GRID, HELD, QUIET, draw

if TYPE_CHECKING:
    from cvxupdate.update.result import ParameterResult

INTERVALS = 16
"""Parameters in a figure at most."""
INTERVAL = 2.0
"""Half-width of the intervals that are drawn, in standard deviations."""


def parameters(found: Sequence[ParameterResult], moved: bool) -> str | None:
    """Each parameter between its bounds: value before, value after with ± 2 standard deviations."""
    shown = strongest(found, INTERVALS)
    if not shown:
        return None

    def paint(ax: Any) -> None:
        for row, q in enumerate(shown):
            _parameter(ax, row, q, moved)
        ax.set_yticks(range(len(shown)), [shortened(q.name) for q in shown])
        ax.set(xlim=(-0.07, 1.1), ylim=(len(shown) - 0.35, -0.5))
        ax.set_xticks([])
        ax.grid(False)
        ax.tick_params(axis="y", length=0)
        for side in ("left", "bottom"):
            ax.spines[side].set_visible(False)

    return draw(
        "parameters",
        "Each parameter between its bounds: before, and after with plus or minus two "
        "standard deviations",
        WIDTH,
        0.25 + 0.44 * len(shown),
        paint,
    )


def _parameter(ax: Any, row: int, q: ParameterResult, moved: bool) -> None:
    """One row: the bounds as the ends of a bar, the value before hollow, the value after full."""
    low, high = _window(q)
    bounded = q.lower is not None and q.upper is not None

    def at(value: float) -> float:
        return (value - low) / (high - low)

    ax.plot(
        [0, 1],
        [row, row],
        color=GRID,
        lw=6,
        solid_capstyle="butt",
        zorder=1,
        ls="-" if bounded else (0, (0.6, 0.6)),
    )
    if bounded:
        ax.plot([0, 1], [row, row], "|", color=QUIET, ms=10, mew=1.2, zorder=2)
    ax.plot([at(q.before)], [row], "o", mfc="none", mec=BEFORE, mew=1.3, ms=7, zorder=4)
    if moved:
        if q.standard_deviation is not None:
            reach = INTERVAL * q.standard_deviation
            a, b = max(at(q.after - reach), -0.04), min(at(q.after + reach), 1.04)
            ax.plot([a, b], [row, row], color=AFTER, lw=2.2, solid_capstyle="butt", zorder=3)
        colour = HELD if q.at_bound else AFTER
        ax.plot([at(q.after)], [row], "o", color=colour, mew=0, ms=6, zorder=5)
    factor, unit = prefix_of(q.unit, low, high)
    ends = [short(v / factor, 3) for v in (low, high)]
    for x, text in ((0, ends[0]), (1, f"{ends[1]} {unit}".strip())):
        ax.annotate(
            text,
            (x, row),
            (0, -8),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=9,
            color=QUIET,
        )


def strongest(found: Sequence[ParameterResult], most: int) -> list[ParameterResult]:
    """At most ``most`` parameters, those that moved furthest, in their own order."""
    if len(found) <= most:
        return list(found)
    kept = sorted(range(len(found)), key=lambda k: -abs(found[k].p))[:most]
    return [found[k] for k in sorted(kept)]


def _window(q: ParameterResult) -> tuple[float, float]:
    """What the figure spans: the bounds, or, where one is missing, the values with a margin."""
    reach = INTERVAL * (q.standard_deviation or 0.0)
    values = (q.before, q.after - reach, q.after + reach)
    margin = 0.15 * ((max(values) - min(values)) or abs(q.before) or 1.0)
    low = q.lower if q.lower is not None else min(values) - margin
    high = q.upper if q.upper is not None else max(values) + margin
    low, high = min(low, high), max(low, high)
    return (low, high) if high > low else (low - margin, high + margin)
