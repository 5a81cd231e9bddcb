"""Figures of `plan`: places on the structure, the mode indicator, the noise that lines bear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report.structure import WIDTH, _bare, _height, drawable, label_points, skeleton
from cvxupdate.report.svg import AFTER, BEFORE, HELD, PAPER, QUIET, draw
from cvxupdate.report.views import view_of

if TYPE_CHECKING:
    from cvxupdate.commands.planned import Planned

NAMED = 30
"""Places that carry their name."""


def places(name: str, found: Planned) -> str | None:
    """Sensors and exciters on the structure."""
    geometry = found.geometry
    if geometry is None or not drawable(geometry):
        return None
    at = {int(n): k for k, n in enumerate(geometry.node_ids)}
    view = view_of(geometry.xyz, np.any(geometry.moves, axis=0))
    flat = view.project(geometry.xyz)

    def points(labels: tuple[str, ...]) -> list[tuple[Any, str]]:
        known = [(at[int(v[1:].partition(".")[0])], v) for v in labels]
        return [(flat[k], v) for k, v in known]

    sensors, exciters = points(found.sensors[0].labels), points(found.exciters.labels)

    def paint(ax: Any) -> None:
        skeleton(ax, geometry, view)
        xy = np.array([p for p, _ in sensors])
        ax.scatter(
            xy[:, 0],
            xy[:, 1],
            s=34,
            facecolors=PAPER,
            edgecolors=AFTER,
            linewidths=1.6,
            zorder=5,
            label="sensor",
        )
        xy = np.array([p for p, _ in exciters])
        ax.scatter(xy[:, 0], xy[:, 1], s=70, marker="^", color=HELD, zorder=6, label="exciter")
        label_points(ax, [*exciters, *sensors][:NAMED], geometry, view)
        ax.legend(loc="best")
        _bare(ax, view)

    return draw(
        name,
        "Places of sensors and exciters on the structure",
        WIDTH,
        _height(view, geometry),
        paint,
    )


def indicator(name: str, found: Planned) -> str | None:
    """The multivariate mode indicator over frequency."""
    shown = found.indicator

    def paint(ax: Any) -> None:
        for f in found.frequencies:
            ax.axvline(f, color=QUIET, lw=0.7)
        for k, curve in enumerate(shown.curves):
            ax.plot(shown.frequency, curve, color=(AFTER, BEFORE, HELD)[k % 3], lw=1.2)
        ax.set(xlabel="frequency (Hz)", ylabel="MMIF", ylim=(0.0, 1.05))

    return draw(name, "Multivariate mode indicator over frequency", 9.0, 3.0, paint)


def bearable(name: str, found: Planned) -> str | None:
    """The noise that each line bears by the characteristic log function, with the chosen lines."""
    f, noise = (np.array(v) for v in found.log_function)
    if not len(f):
        return None

    def paint(ax: Any) -> None:
        ax.semilogy(f, 100.0 * noise, color=AFTER, lw=1.2)
        ax.axhline(100.0 * found.noise, color=QUIET, lw=0.9, ls="--")
        for x in found.lines[0].lines if found.lines else ():
            ax.axvline(x, color=HELD, lw=0.6, alpha=0.7)
        ax.set(xlabel="frequency (Hz)", ylabel="noise borne (%)")

    return draw(name, "Noise that is borne at each frequency", 9.0, 3.0, paint)
