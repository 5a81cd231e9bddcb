"""A matrix of values between −1 and 1 as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.numbers import fixed
from cvxupdate.report.svg import AFTER, BAND, HELD, INK, PAPER, draw

Real = NDArray[Any]
WIDTH = 4.7
ROWS = 48
"""Modes, sensors or groups in a figure at most."""
CELLS = 14
"""Rows or columns of a matrix up to which its numbers are written into it."""


def matrix(
    name: str,
    says: str,
    values: Real,
    rows: Sequence[str],
    columns: Sequence[str],
    labels: tuple[str, str],
    paired: Sequence[tuple[int, int]] = (),
) -> str | None:
    """A matrix of values between −1 and 1 as shaded cells, the larger the darker, negative ones in
    another colour; ``paired`` cells are framed."""
    if not values.size:
        return None
    v = np.asarray(values)[:ROWS, :ROWS]

    def paint(ax: Any) -> None:
        n, m = v.shape
        _cells(ax, v)
        for i, j in paired:
            if i < n and j < m:
                ax.plot(
                    [j - 0.5, j + 0.5, j + 0.5, j - 0.5, j - 0.5],
                    [i - 0.5, i - 0.5, i + 0.5, i + 0.5, i - 0.5],
                    color=HELD,
                    lw=1.5,
                    zorder=3,
                )
        ax.set_xticks(range(m), list(columns)[:m], rotation=90 if m > 6 else 0)
        ax.set_yticks(range(n), list(rows)[:n])
        ax.set(xlim=(-0.5, m - 0.5), ylim=(n - 0.5, -0.5), ylabel=labels[0], xlabel=labels[1])
        ax.grid(False)
        ax.tick_params(length=0, labelsize=8.5)
        for side in ("left", "bottom"):
            ax.spines[side].set_visible(False)

    return draw(name, says, WIDTH, float(np.clip(1.1 + 0.36 * v.shape[0], 1.8, 5.5)), paint)


def _cells(ax: Any, v: Real) -> None:
    """The entries as shaded cells, with their numbers where there are few."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgba

    n, m = v.shape
    cells = [
        [(j - 0.5, i - 0.5), (j + 0.5, i - 0.5), (j + 0.5, i + 0.5), (j - 0.5, i + 0.5)]
        for i in range(n)
        for j in range(m)
    ]
    shade = [
        to_rgba(HELD if x < 0.0 else AFTER, min(abs(float(x)), 1.0) if np.isfinite(x) else 0.0)
        for x in v.reshape(-1)
    ]
    ax.add_collection(
        PolyCollection(cells, facecolors=shade, edgecolors=BAND, linewidths=0.4, zorder=1)
    )
    if max(n, m) > CELLS:
        return
    for i in range(n):
        for j in range(m):
            ax.text(
                j,
                i,
                fixed(round(float(v[i, j]), 2) + 0.0, 2),  # no minus before 0.00
                ha="center",
                va="center",
                fontsize=8.5 if max(n, m) < 9 else 7,
                color=PAPER if abs(v[i, j]) > 0.55 else INK,
                zorder=4,
            ).set_in_layout(False)
