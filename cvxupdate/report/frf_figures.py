"""The figures of `correlate` on frequency responses: overlays and FDAC."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.numbers import fixed
from cvxupdate.report.svg import AFTER, BAND, HELD, INK, draw, draw_panels, over_frequency

if TYPE_CHECKING:
    from cvxupdate.correlate.result import FrfComparison

Real = NDArray[Any]
WIDTH = 4.7
LINES = 1500
"""Points of a curve at most."""
OVERLAYS = 6
"""Frequency responses drawn at most for a recording."""
DEVIATIONS = 2.0
"""Half-width of the variance bands."""
LEVELS = (0.3, 0.5, 0.7, 0.8, 0.9, 0.95)
"""Contours of the FDAC map."""
UNITS = {"displacement": "m/N", "velocity": "m/s/N", "acceleration": "m/s²/N"}


def overlays(name: str, found: FrfComparison) -> str | None:
    """Measured and model FRF moduli over frequency, with ± 2 standard deviations of the measured
    ones."""
    entries = chosen(found)
    if not entries:
        return None
    step = max(1, -(-len(found.frequency) // LINES))

    def paint(axes: list[Any]) -> None:
        f = found.frequency[::step]
        for ax, (i, j) in zip(axes, entries, strict=True):
            _overlay(ax, found, f, slice(None, None, step), i, j)
        over_frequency(axes)

    return draw_panels(
        name,
        "Measured and model frequency responses",
        7.6,
        1.9 * len(entries) + 0.4,
        len(entries),
        1,
        paint,
    )


def _overlay(ax: Any, found: FrfComparison, f: Real, lines: slice, i: int, j: int) -> None:
    """Response ``i`` to reference ``j``: measured with its variance, and the model's."""
    x, a = np.abs(found.measured[lines, i, j]), np.abs(found.model[lines, i, j])
    positive = x[np.isfinite(x) & (x > 0)]
    if found.variance is not None:
        sd = DEVIATIONS * np.sqrt(np.maximum(found.variance[lines, i, j], 0.0))
        low = np.maximum(x - sd, 1e-3 * np.maximum(x, 1e-300))
        label = "measured ± 2 standard deviations"
        ax.fill_between(f, low, x + sd, color=BAND, lw=0, label=label, zorder=1)
    drawn, modelled = (np.where(y > 0.0, y, np.nan) for y in (x, a))  # nothing has no logarithm
    ax.plot(f, drawn, color=INK, lw=3.0, alpha=0.3, label="measured", zorder=2)
    ax.plot(f, modelled, color=AFTER, lw=1.1, label="model", zorder=3)
    if np.any(x > 0.0) or np.any(a > 0.0):
        ax.set_yscale("log")
    if positive.size:
        ax.set_ylim(
            0.3 * float(np.quantile(positive, 0.01)),
            5.0 * max(float(positive.max()), float(np.quantile(a[np.isfinite(a)], 0.99))),
        )
    ax.set_title(
        f"{found.responses[i]} / {found.references[j]}   FRAC "
        f"{fixed(float(found.correlation.frac[i, j]), 2)}, error "
        f"{fixed(float(found.correlation.error[i, j]), 2)}",
        fontsize=9,
        loc="left",
    )
    ax.set_ylabel(UNITS.get(found.quantity, ""))
    ax.grid(False, which="minor")
    ax.set_xlim(float(f[0]), float(f[-1]))


def chosen(found: FrfComparison) -> list[tuple[int, int]]:
    """The responses to draw: drive points first, then the others in order, at most six; none that
    is nothing in both."""
    every = [
        (i, j)
        for j in range(len(found.references))
        for i in range(len(found.responses))
        if np.any(found.measured[:, i, j]) or np.any(found.model[:, i, j])
    ]
    drive = [(i, j) for i, j in every if found.responses[i] == found.references[j]]
    rest = [e for e in every if e not in drive]
    room = OVERLAYS - len(drive[:OVERLAYS])
    spread = (
        sorted({round(k) for k in np.linspace(0, len(rest) - 1, min(room, len(rest)))})
        if rest and room
        else []
    )
    return drive[:OVERLAYS] + [rest[k] for k in spread]


def fdac_map(name: str, found: FrfComparison, reference: int) -> str | None:
    """FDAC over both frequency axes; a ridge beside the 45° line is a shift of frequency. None with
    one response, where it is 1 everywhere."""
    if len(found.responses) < 2:
        return None
    f, v = found.correlation.lines, np.asarray(found.correlation.fdac[:, :, reference])

    def paint(ax: Any) -> None:
        from matplotlib.colors import to_rgba

        ax.contourf(
            f,
            f,
            v,
            levels=[*LEVELS, 1.0001],
            colors=[to_rgba(AFTER, a) for a in (0.1, 0.22, 0.38, 0.55, 0.75, 1.0)],
            zorder=1,
        )
        ax.plot([f[0], f[-1]], [f[0], f[-1]], color=HELD, lw=0.9, zorder=3)
        ends = (float(f[0]), float(f[-1]))
        ax.set(
            xlabel="measured frequency (Hz)",
            ylabel="model frequency (Hz)",
            aspect="equal",
            xlim=ends,
            ylim=ends,
        )
        ax.grid(False)

    return draw(
        name,
        f"FDAC of model and measured responses to {found.references[reference]}",
        WIDTH,
        4.4,
        paint,
    )
