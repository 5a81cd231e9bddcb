"""Frequency responses on the page of `run`: measured, model before, model after."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report.numbers import number
from cvxupdate.report.svg import AFTER, BEFORE, HELD, INK, draw_panels, over_frequency

if TYPE_CHECKING:
    from cvxupdate.correlate.overlay import FrfOverlay
    from cvxupdate.update.result import Updated

WIDTH = 4.7
UNITS = {"displacement": "m/N", "velocity": "m/s/N", "acceleration": "m/s²/N"}


def overlay_parts(updated: Updated, moved: bool) -> list[dict[str, Any]]:
    """For each recording: a figure of its responses, and what it shows in words. Not ``moved``:
    the model as it came alone."""
    out: list[dict[str, Any]] = []
    names = dict.fromkeys((o.recording, o.use) for o in updated.overlays)
    for place, (name, use) in enumerate(names):
        some = [o for o in updated.overlays if (o.recording, o.use) == (name, use)]
        kept = "held out: never fitted" if use == "hold-out" else "fitted"
        marks = ", at the lines marked below" if any(o.fitted for o in some) else ""
        says = f"{name} ({kept}{marks})."
        out.append({"says": says, "figure": Markup(_figure(f"overlay{place}", says, some, moved))})
    return out


def _figure(name: str, says: str, some: list[FrfOverlay], moved: bool) -> str:
    def paint(axes: list[Any]) -> None:
        for k, (ax, o) in enumerate(zip(axes, some, strict=True)):
            _panel(ax, o, moved)
            if k < len(some) - 1:
                ax.tick_params(labelbottom=False)
        over_frequency(axes)

    words = f"Measured frequency responses and the model's before and after. {says}"
    return draw_panels(name, words, WIDTH, 0.5 + 2.3 * len(some), len(some), 1, paint)


def _panel(ax: Any, o: FrfOverlay, moved: bool) -> None:
    f = o.frequency
    ax.plot(f, o.before, color=BEFORE, lw=1.3, label="model before", zorder=2)
    ax.plot(f, o.measured, color=INK, lw=3.2, alpha=0.3, label="measured", zorder=3)
    if moved:
        colour = HELD if o.use == "hold-out" else AFTER
        ax.plot(f, o.after, color=colour, lw=1.1, label="model after", zorder=4)
    positive = o.measured[np.isfinite(o.measured) & (o.measured > 0.0)]
    ax.set_yscale("log")
    if positive.size:
        top = max(float(positive.max()), float(np.quantile(o.before[np.isfinite(o.before)], 0.99)))
        ax.set_ylim(0.3 * float(np.quantile(positive, 0.01)), 3.0 * top)
    inside = [x for x in o.fitted if f[0] <= x <= f[-1]]
    if inside:
        marks = {"transform": ax.get_xaxis_transform(), "clip_on": False}
        ax.plot(inside, np.zeros(len(inside)), "^", color=INK, ms=4.0, mew=0, zorder=5, **marks)
    went = f"{number(o.error_before, 3)}" + (f" → {number(o.error_after, 2)}" if moved else "")
    ax.set_title(f"{o.response} / {o.reference}, error {went}", fontsize=9, loc="left")
    ax.set(xlim=(float(f[0]), float(f[-1])), ylabel=UNITS.get(o.quantity, ""))
    ax.grid(False, which="minor")
