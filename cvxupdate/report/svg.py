"""Matplotlib figures as inline SVG: text stays text, colours follow the page (light, dark, print),
the same input gives the same bytes."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Callable, Sequence
from typing import Any

# Matplotlib wants colours; these stand for the page's own and are replaced by CSS variables below.
INK, QUIET, GRID, BEFORE, AFTER, HELD, BAND, PAPER = (
    "#010a01",
    "#020a02",
    "#030a03",
    "#040a04",
    "#050a05",
    "#060a06",
    "#070a07",
    "#080a08",
)
VARIABLES = {
    INK: "ink",
    QUIET: "quiet",
    GRID: "line",
    BEFORE: "before",
    AFTER: "after",
    HELD: "held",
    BAND: "band",
    PAPER: "paper",
}

RC = {
    "svg.fonttype": "none",
    "svg.hashsalt": "cvxupdate",
    "font.family": "sans-serif",
    "font.size": 10.0,
    "axes.titlesize": 10.0,
    "axes.labelsize": 10.0,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "legend.fontsize": 9.5,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": QUIET,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.unicode_minus": True,
    "mathtext.default": "regular",
    "lines.linewidth": 1.4,
    "path.simplify": True,
}


def draw(name: str, says: str, width: float, height: float, paint: Callable[[Any], None]) -> str:
    """An SVG element of ``width`` × ``height`` inches; ``paint(axes)`` draws it.

    ``name`` makes the ids in it unique on the page, ``says`` is read out to those who cannot see
    it.
    """
    return draw_panels(name, says, width, height, 1, 1, lambda axes: paint(axes[0]))


def draw_panels(
    name: str,
    says: str,
    width: float,
    height: float,
    rows: int,
    columns: int,
    paint: Callable[[list[Any]], None],
    heights: Sequence[float] | None = None,
) -> str:
    """As `draw`, with ``rows`` × ``columns`` panels: ``paint(axes)`` gets their list, row by
    row; ``heights`` are those of the rows, relative to one another."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(RC):
        figure = Figure(figsize=(width, height), layout="constrained")
        paint(list(figure.subplots(rows, columns, squeeze=False, height_ratios=heights).flat))
        buffer = io.StringIO()
        figure.savefig(
            buffer,
            format="svg",
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    return inline(buffer.getvalue(), name, says)


def inline(svg: str, name: str, says: str) -> str:
    """A stand-alone SVG file made fit for a page: no prologue, own ids, colours and font of the
    page."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'(xlink:href="|url\()#', rf"\g<1>#{name}-", svg)
    svg = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", svg)
    for colour, variable in VARIABLES.items():
        svg = svg.replace(colour, f"var(--{variable})")
    head, rest = svg.split(">", 1)
    head = re.sub(r' (width|height|version)="[^"]*"', "", head)
    return f'{head} role="img" aria-label="{html.escape(says, quote=True)}">{rest}'.strip()
