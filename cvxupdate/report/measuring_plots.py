"""Figures of `identify` and `plan` for programs: matplotlib figures, drawn without pyplot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report.plots import COLOURS, MEASURED, PANELS, RATIO, blank, structure_figure

if TYPE_CHECKING:
    from cvxupdate.commands.identified import Fitted, ModeSetResult
    from cvxupdate.commands.planned import Planned
    from cvxupdate.correlate.result import Geometry

KEPT = "#5a7d2a"


def stabilisation_figure(s: ModeSetResult) -> Any:
    """Poles of every order over frequency, stable ones filled; a line at every mode that was
    kept."""
    figure, (ax,) = blank(7.0, 4.0)
    d = s.diagram
    if d is not None:
        for chosen, face, name in (
            (~d.stable, "none", "found in this order only"),
            (d.stable, COLOURS["after"], "stable"),
        ):
            ax.plot(
                d.frequency[chosen],
                d.order[chosen],
                "o",
                ls="",
                ms=2.5,
                mec=COLOURS["after"],
                mfc=face,
                mew=0.5,
                label=name,
            )
    for k, f in enumerate(s.frequency):
        ax.axvline(f, color=KEPT, lw=0.9, label="modes" if k == 0 else None)
    ax.set(xlabel="frequency (Hz)", ylabel="order of the model", xlim=s.band)
    ax.legend(fontsize="small", ncols=3)
    return figure


def synthesis_figure(fit: Fitted) -> Any:
    """Measured frequency responses and those of the modes; the first six."""
    pairs = [(i, j) for j in range(len(fit.references)) for i in range(len(fit.responses))][:PANELS]
    figure, axes = blank(7.0, 0.8 + 1.9 * len(pairs), len(pairs), sharex=True)
    for ax, (i, j) in zip(axes, pairs, strict=True):
        for curves, colour, name in (
            (fit.measured, MEASURED, "measured"),
            (fit.fitted, COLOURS["after"], "from the modes"),
        ):
            ax.semilogy(fit.frequency, np.abs(curves[:, i, j]), lw=1.1, color=colour, label=name)
        ax.set_title(f"{fit.responses[i]} / {fit.references[j]}", fontsize="small", loc="left")
        ax.set_ylabel(RATIO.get(fit.quantity, ""))
    axes[0].legend(fontsize="small", ncols=2)
    axes[-1].set_xlabel("frequency (Hz)")
    return figure


def places_figure(shown: Geometry, sensors: Sequence[str], exciters: Sequence[str]) -> Any:
    """Sensors and exciters ("n4.z") on the structure."""
    figure = structure_figure(shown)
    (ax,) = figure.axes
    xyz = np.asarray(shown.xyz)
    flat = [k for k in range(3) if np.ptp(xyz[:, k]) == 0.0]
    keep = [k for k in range(3) if not flat or k != flat[0]]
    at = {int(n): k for k, n in enumerate(shown.node_ids)}
    for labels, mark, colour, name in (
        (sensors, "o", COLOURS["after"], "sensor"),
        (exciters, "^", COLOURS["before"], "exciter"),
    ):
        rows = [at[int(label[1:].partition(".")[0])] for label in labels]
        ax.plot(
            *xyz[rows][:, keep].T, mark, ls="", ms=9, mfc="none", mew=1.6, color=colour, label=name
        )
    ax.legend(fontsize="small")
    return figure


def indicator_figure(found: Planned) -> Any:
    """The multivariate mode indicator over frequency, with a line at every mode."""
    figure, (ax,) = blank(7.0, 3.0)
    for f in found.frequencies:
        ax.axvline(f, color="#999999", lw=0.7)
    for k, curve in enumerate(found.indicator.curves):
        ax.plot(found.indicator.frequency, curve, lw=1.2, label=f"curve {k + 1}")
    ax.set(xlabel="frequency (Hz)", ylabel="MMIF", ylim=(0.0, 1.05))
    ax.legend(fontsize="small")
    return figure
