"""The figures of a report, each a pure function of a result that gives an SVG element, or None when
there is nothing to draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import number, power
from cvxupdate.report.svg import AFTER, BAND, BEFORE, HELD, INK, QUIET, draw

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow
    from cvxupdate.update.result import ModeResult, Updated

WIDTH = 4.7
"""Inches; a page as narrow as a telephone then shows the text at its own size."""
ROWS = 48
"""Modes in a figure at most: more cannot be read."""


def frequencies(modes: Sequence[ModeResult], moved: bool) -> str | None:
    """Model frequency against measured frequency, before and after, with the 45° line (figure
    9.8)."""
    if not modes:
        return None

    def paint(ax: Any) -> None:
        top = 1.04 * max(max(m.measured, m.before, m.after) for m in modes)
        low = min(0.96 * min(min(m.measured, m.before, m.after) for m in modes), top / 2)
        low = 0.0 if low < 0.25 * top else low
        ax.plot([low, top], [low, top], color=QUIET, lw=0.9, zorder=1)
        for use, marker in (("fit", "o"), ("hold-out", "D")):
            mine = [m for m in modes if m.use == use]
            if not mine:
                continue
            label = "" if use == "fit" else ", held out"
            x = [m.measured for m in mine]
            ax.plot(
                x,
                [m.before for m in mine],
                marker,
                mfc="none",
                mec=BEFORE,
                mew=1.2,
                ms=6.5,
                ls="",
                label=f"before{label}",
                zorder=2,
            )
            if moved:
                ax.plot(
                    x,
                    [m.after for m in mine],
                    marker,
                    color=AFTER if use == "fit" else HELD,
                    mew=0,
                    ms=4.2,
                    ls="",
                    label=f"after{label}",
                    zorder=3,
                )
        ax.set(
            xlim=(low, top),
            ylim=(low, top),
            xlabel="measured frequency (Hz)",
            ylabel="model frequency (Hz)",
            aspect="equal",
        )
        ax.legend(loc="upper left", handletextpad=0.2, borderaxespad=0.2)

    return draw(
        "frequencies",
        "Model frequency against measured frequency before and after; the closer to the 45 "
        "degree line the better",
        WIDTH,
        4.4,
        paint,
    )


def mode_errors(modes: Sequence[ModeResult], moved: bool, deviations: bool) -> str | None:
    """Signed frequency error of every mode before and after; ``deviations`` adds the measured ±
    standard deviation."""
    shown = list(modes)[:ROWS]
    if not shown:
        return None

    def paint(ax: Any) -> None:
        y = list(range(len(shown)))
        before, after = (
            [100 * (f - m.measured) / m.measured for m, f in zip(shown, fs, strict=True)]
            for fs in ([m.before for m in shown], [m.after for m in shown])
        )
        if deviations:
            sd = [100 * m.standard_deviation / m.measured for m in shown]
            ax.barh(
                y,
                [2 * s for s in sd],
                left=[-s for s in sd],
                height=0.9,
                color=BAND,
                label="measured ± 1 standard deviation",
                zorder=1,
            )
        if moved:
            half = 0.36
            low = [v - half / 2 for v in y]
            ax.barh(low, before, height=half, color=BEFORE, label="before", zorder=2)
            _after_bars(ax, shown, after, half)
        else:
            ax.barh(y, before, height=0.6, color=BEFORE, label="before", zorder=2)
        ax.axvline(0.0, color=INK, lw=0.8, zorder=3)
        ax.set_yticks(y, [f"{m.measured:.5g} Hz" for m in shown])
        ax.set(ylim=(len(shown) - 0.4, -0.6), xlabel="(model − measured) / measured (%)")
        ax.grid(False, axis="y")
        ax.tick_params(axis="y", length=0)
        _legend_above(ax, 2)

    return draw(
        "errors",
        "Frequency error in per cent of each measured mode, before and after the update",
        WIDTH,
        0.95 + 0.235 * len(shown),
        paint,
    )


def _after_bars(ax: Any, shown: Sequence[ModeResult], after: Sequence[float], half: float) -> None:
    """The errors after the update: fitted modes and those held out."""
    for use, colour, label in (
        ("fit", AFTER, "after"),
        ("hold-out", HELD, "after, held out"),
    ):
        mine = [(k + half / 2, after[k]) for k, m in enumerate(shown) if m.use == use]
        if mine:
            ax.barh(
                [v for v, _ in mine],
                [e for _, e in mine],
                height=half,
                color=colour,
                label=label,
                zorder=2,
            )


def convergence(updated: Updated) -> str | None:
    """The objective after each iteration; rejected steps are hollow."""
    lines = [
        (int(h["number"]), float(h["objective"]), bool(h["accepted"])) for h in updated.history
    ]
    first = updated.fit.get("fit", {}).get("objective", {}).get("before")
    path = ([(0, float(first), True)] if first is not None else []) + lines
    if len(path) < 2:
        return None

    def paint(ax: Any) -> None:
        ax.plot([n for n, _, _ in path], [v for _, v, _ in path], color=AFTER, zorder=2)
        for n, v, accepted in path:
            ax.plot(
                [n],
                [v],
                "o",
                color=AFTER,
                mfc=AFTER if accepted else "none",
                mew=1.2,
                ms=5.5,
                zorder=3,
            )
        positive = [v for _, v, _ in path if v > 0]
        if len(positive) == len(path) and max(positive) > 20 * min(positive):
            ax.set_yscale("log")
            ax.grid(False, which="minor")
        ax.set(xlabel="iteration", ylabel="objective (dimensionless)")
        ax.xaxis.get_major_locator().set_params(integer=True)

    return draw("convergence", "The objective after each iteration", WIDTH, 2.6, paint)


def solver_bars(rows: Sequence[SolverRow]) -> str | None:
    """Time of each solver that reached the optimum, on a logarithmic scale, with its largest
    residual beside it."""
    shown = [r for r in rows if r.status == "optimal" and r.seconds > 0]
    if not shown:
        return None

    def paint(ax: Any) -> None:
        y = range(len(shown))
        ms = [1e3 * r.seconds for r in shown]
        low = 10.0 ** math.floor(math.log10(min(ms)) - 0.2)
        ax.barh(y, [v - low for v in ms], left=low, height=0.55, color=AFTER, zorder=2)
        for row, (v, r) in enumerate(zip(ms, shown, strict=True)):
            ax.annotate(
                f"{number(v, 3)} ms, residual {_small(r.certificate.worst)}",
                (v, row),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=9,
                color=INK,
            )
        ax.set_xscale("log")
        ax.set(xlim=(low, 40 * max(ms)), xlabel="time inside the solver (ms)")
        ax.set_yticks(y, [r.solver for r in shown])
        ax.invert_yaxis()
        ax.grid(False, axis="y")
        ax.grid(False, which="minor")
        ax.tick_params(axis="y", length=0)

    return draw(
        "solvers",
        "Time of each solver, and the largest residual of its certificate",
        WIDTH,
        0.75 + 0.32 * len(shown),
        paint,
    )


def shortened(name: str, most: int = 18) -> str:
    """A name that fits beside a figure."""
    return name if len(name) <= most else name[: most // 2] + "…" + name[-(most // 2 - 1) :]


def _small(value: float) -> str:
    return power(value, 1) if value > 0.0 else "0"


def _legend_above(ax: Any, columns: int) -> None:
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        handlelength=1.0,
        handletextpad=0.4,
        columnspacing=1.2,
        borderaxespad=0.1,
    )
