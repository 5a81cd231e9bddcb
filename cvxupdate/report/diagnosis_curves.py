"""The curves of a diagnosis: responses before and after, what remains against noise, modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report.diagnosis_places import WIDTH
from cvxupdate.report.diagnosis_words import label_words
from cvxupdate.report.svg import AFTER, BAND, BEFORE, HELD, INK, draw, draw_panels

if TYPE_CHECKING:
    from cvxupdate.diagnose.shown import Curve, Shown, Spectrum

UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²"}
MODES = 40
"""Modes drawn at most."""
WHOLE = 2.0 * WIDTH
"""Inches of a figure across the page, of one panel or two: its letters are as large as others'."""


def caption(c: Curve) -> str:
    """What the curve is, in words."""
    force = " and ".join(label_words(d) for d in c.driven[:2]) + (
        " and more" if len(c.driven) > 2 else ""
    )
    kept = (
        "a recording that was never fitted"
        if c.use == "hold-out"
        else "a recording that was fitted"
    )
    return (
        f"{c.quantity.capitalize()} {label_words(c.sensor)} under a force {force}, from {kept} "
        f"({c.recording})."
    )


def overlay(shown: Shown | None, after: str = "model after") -> tuple[str, str] | None:
    """(figure, caption) of the curve for the first screen: held out where there is one; modulus,
    and the phase below it. ``after`` names the second model."""
    if shown is None or not shown.curves:
        return None
    first, says = shown.curves[0], caption(shown.curves[0])

    def paint(axes: list[Any]) -> None:
        _curve(axes[0], first, True, after)
        if len(axes) > 1:
            axes[0].set_xlabel("")
            axes[0].tick_params(labelbottom=False)
            _phase(axes[1], first)

    rows = 1 if first.phases is None else 2
    return draw_panels(
        "overlay",
        f"Measured response with the model before and after. {says}",
        WIDTH,
        3.3 if rows == 1 else 4.4,
        rows,
        1,
        paint,
        None if rows == 1 else (3.0, 1.1),
    ), says


def _phase(ax: Any, c: Curve) -> None:
    """The phase of the three, broken where it turns over the edge of ± 180°."""
    if c.phases is None:
        return
    styles = ((BEFORE, 1.2, 1.0, 2), (INK, 3.0, 0.3, 3), (AFTER, 1.1, 1.0, 4))
    for values, (colour, width, alpha, above) in zip(
        (c.phases[1], c.phases[0], c.phases[2]), styles, strict=True
    ):
        turned = np.flatnonzero(np.abs(np.diff(values)) > 180.0) + 1
        x, y = np.insert(c.frequency, turned, np.nan), np.insert(values, turned, np.nan)
        ax.plot(x, y, color=colour, lw=width, alpha=alpha, zorder=above)
    ax.set(
        xlim=(float(c.frequency[0]), float(c.frequency[-1])),
        ylim=(-190.0, 190.0),
        yticks=(-180, 0, 180),
        xlabel="frequency (Hz)",
        ylabel="phase (°)",
    )


def other_curves(shown: Shown | None) -> tuple[str, list[str]] | None:
    """(figure, captions) of the other curves."""
    if shown is None or len(shown.curves) < 2:
        return None
    rest = shown.curves[1:]

    def paint(axes: list[Any]) -> None:
        for k, ax in enumerate(axes):
            ax.set_visible(k < len(rest))
            if k < len(rest):
                _curve(ax, rest[k], False)
                ax.set_title(
                    f"{label_words(rest[k].sensor)[3:]}, "
                    f"{'held out' if rest[k].use == 'hold-out' else 'fitted'}",
                    fontsize=9.5,
                )

    rows = -(-len(rest) // 2)
    columns = min(len(rest), 2)
    return (
        draw_panels(
            "curves",
            "Measured responses with the model before and after",
            WHOLE,
            2.9 * rows,
            rows,
            columns,
            paint,
        ),
        [caption(c) for c in rest],
    )


def _curve(ax: Any, c: Curve, legend: bool, after: str = "model after") -> None:
    floor = 0.2 * float(np.min(c.measured[c.measured > 0], initial=np.inf))
    if np.any(c.noise > 0):
        ax.fill_between(
            c.frequency,
            np.full(len(c.frequency), min(floor, float(c.noise.min()))),
            c.noise,
            color=BAND,
            lw=0,
            zorder=0,
            label="noise",
        )
    ax.plot(c.frequency, c.before, color=BEFORE, lw=1.4, label="model before", zorder=2)
    ax.plot(c.frequency, c.measured, color=INK, lw=3.4, alpha=0.3, label="measured", zorder=3)
    ax.plot(c.frequency, c.after, color=AFTER, lw=1.2, label=after, zorder=4)
    everything = np.concatenate([c.measured, c.before, c.after])
    top = float(everything.max())
    ax.set(
        yscale="log",
        xlim=(float(c.frequency[0]), float(c.frequency[-1])),
        ylim=(max(floor, 1e-6 * top), 1.6 * top),
        xlabel="frequency (Hz)",
        ylabel=f"{UNITS[c.quantity]}{' per N' if c.per_force else '·s'}",
    )
    if legend:
        _legend(ax, ("measured", "model before", after, "noise"))


def _legend(ax: Any, order: Sequence[str]) -> None:
    handles = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    shown = [word for word in order if word in handles]
    ax.legend(
        [handles[word] for word in shown],
        shown,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(shown),
        handlelength=1.2,
        handletextpad=0.4,
        columnspacing=1.0,
        borderaxespad=0.1,
    )


def remains(shown: Shown | None) -> str | None:
    """What remains of all channels against their noise, held out and fitted."""
    if shown is None or not shown.spectra:
        return None
    spectra = shown.spectra

    def one(ax: Any, s: Spectrum, legend: bool) -> None:
        values = np.concatenate([s.before, s.after, s.noise])
        low = max(0.5 * float(values[values > 0].min(initial=1.0)), 1e-6)
        ax.fill_between(
            s.frequency,
            np.full(len(s.frequency), low),
            np.maximum(s.noise, low),
            color=BAND,
            lw=0,
            step="mid",
            label="noise",
            zorder=0,
        )
        ax.step(s.frequency, s.before, where="mid", color=BEFORE, lw=1.4, label="before", zorder=2)
        ax.step(s.frequency, s.after, where="mid", color=AFTER, lw=1.4, label="after", zorder=3)
        ax.set(
            yscale="log",
            xlim=(float(s.frequency[0]), float(s.frequency[-1])),
            ylim=(low, 1.5 * float(values.max())),
            xlabel="frequency (Hz)",
            ylabel="what remains (1: the signal)",
        )
        if len(spectra) > 1:
            ax.set_title("held out" if s.use == "hold-out" else "fitted", fontsize=9.5, loc="right")
        if legend:
            _legend(ax, ("before", "after", "noise"))

    def paint(axes: list[Any]) -> None:
        for k, ax in enumerate(axes):
            one(ax, spectra[k], k == 0)

    return draw_panels(
        "remains",
        "What the model leaves unexplained at each frequency before and after, against the "
        "noise of the recordings",
        WHOLE,
        3.1,
        1,
        len(spectra),
        paint,
    )


def mode_bars(shown: Shown | None) -> str | None:
    """Error of every measured frequency before and after."""
    if shown is None or not shown.modes:
        return None
    modes = sorted(shown.modes, key=lambda m: m.frequency)[:MODES]

    def paint(ax: Any) -> None:
        for k, m in enumerate(modes):
            ax.plot([100 * m.before, 100 * m.after], [k, k], color=BEFORE, lw=0.8, zorder=1)
        y = np.arange(len(modes))
        ax.plot(
            [100 * m.before for m in modes],
            y,
            "o",
            color=BEFORE,
            ms=5.5,
            mew=0,
            ls="",
            label="model before",
            zorder=2,
        )
        for use, colour, word in (
            ("fit", AFTER, "model after"),
            ("hold-out", HELD, "model after, held out"),
        ):
            mine = [(100 * m.after, k) for k, m in enumerate(modes) if m.use == use]
            if mine:
                ax.plot(
                    *zip(*mine, strict=True),
                    "o",
                    color=colour,
                    ms=5.5,
                    mew=0,
                    ls="",
                    label=word,
                    zorder=3,
                )
        ax.axvline(0.0, color=INK, lw=0.9, zorder=0)
        ax.set_yticks(y, [f"{m.frequency:.4g}" for m in modes])
        ax.set(
            ylim=(len(modes) - 0.4, -0.6),
            xlabel="error of the model's frequency (%)",
            ylabel="measured frequency (Hz)",
        )
        ax.grid(False, axis="y")
        _legend(ax, ("model before", "model after", "model after, held out"))

    return draw(
        "modes",
        "Error of each natural frequency before and after",
        WIDTH,
        1.2 + 0.22 * len(modes),
        paint,
    )
