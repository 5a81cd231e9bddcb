"""The figure of the fit before and after a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cvxupdate.report.diagnosis_places import WIDTH
from cvxupdate.report.numbers import number
from cvxupdate.report.svg import AFTER, BEFORE, HELD, INK, QUIET, draw

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis

Stage = tuple[str, str, str]
"""Its key in ``fit``, what the legend says, its colour."""
STAGES: tuple[Stage, ...] = (
    ("before", "as modelled", BEFORE),
    ("nuisance", "with the usual scatter", QUIET),
    ("after", "with what was found", AFTER),
)


def fit_bars(found: Diagnosis, held_out_word: str = "held out") -> str | None:
    """Error before, with the usual scatter allowed, and after, on what was fitted and on what was
    not."""
    groups = [
        (name, found.fit[key])
        for key, name in (("fit", "fitted"), ("hold_out", held_out_word))
        if found.fit.get(key, {}).get("before") is not None
    ]
    if not groups:
        return None
    stages = [
        s
        for s in STAGES
        if any(v.get(s[0]) is not None for _, v in groups)
        and not (
            s[0] == "after"
            and not found.findings
            and any(v.get("nuisance") is not None for _, v in groups)
        )
    ]

    def paint(ax: Any) -> None:
        step = 1.0 / (len(stages) + 0.8)
        top = max(float(v.get(key) or 0.0) for _, v in groups for key, _, _ in stages)
        for row, (_, v) in enumerate(groups):
            _bars(ax, stages, v, row, step)
            noise = v.get("noise")
            if noise is not None:
                ax.plot(
                    [noise, noise],
                    [row - 0.48, row + 0.48],
                    color=HELD,
                    lw=1.2,
                    ls=":",
                    label="noise alone" if row == 0 else None,
                    zorder=3,
                )
        ax.set_yticks(range(len(groups)), [name for name, _ in groups])
        ax.set(
            xlim=(0.0, 1.2 * top if top > 0 else 1.0),
            ylim=(len(groups) - 0.4, -0.6),
            xlabel="error (0: perfect)",
        )
        ax.grid(False, axis="y")
        ax.tick_params(axis="y", length=0)
        _legend(ax, stages)

    return draw(
        "fit",
        "Error of the model before and after, on fitted and on held-out recordings",
        WIDTH,
        1.3 + 0.75 * len(groups),
        paint,
    )


def _bars(ax: Any, stages: Sequence[Stage], values: dict[str, Any], row: int, step: float) -> None:
    for k, (key, label, colour) in enumerate(stages):
        value = values.get(key)
        if value is None:
            continue
        y = row + (k - (len(stages) - 1) / 2) * step
        ax.barh(
            [y],
            [value],
            height=0.85 * step,
            color=colour,
            label=label if row == 0 else None,
            zorder=2,
        )
        ax.annotate(
            number(value, 2),
            (value, y),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=9,
            color=INK,
        )


def _legend(ax: Any, stages: Sequence[Stage]) -> None:
    handles = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    order = [label for _, label, _ in stages if label in handles] + [
        label for label in ("noise alone",) if label in handles
    ]
    ax.legend(
        [handles[label] for label in order],
        order,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=2,
        handlelength=1.0,
        handletextpad=0.4,
        columnspacing=1.2,
        borderaxespad=0.1,
    )
