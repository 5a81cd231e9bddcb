"""Matplotlib figures as inline SVG: text stays text, colours follow the page (light, dark, print),
the same input gives the same bytes."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Callable, Sequence
from functools import partial
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

POINTS = 72  # a unit of an SVG file, to the inch
METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}
MINOR_LABELS = 10.0  # of the ends of a logarithmic axis: above, matplotlib labels no minor tick
SUPERIOR = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context(RC):
        figure = Figure(figsize=(width, height), dpi=POINTS, layout="constrained")
        canvas = FigureCanvasSVG(figure)
        paint(list(figure.subplots(rows, columns, squeeze=False, height_ratios=heights).flat))
        _laid_out(figure)
        buffer = io.StringIO()
        canvas.print_svg(buffer, metadata=METADATA)
    return inline(buffer.getvalue(), name, says)


def over_frequency(axes: list[Any]) -> None:
    """Panels of curves over one frequency axis: its name under the last, the legend above the
    first."""
    axes[-1].set_xlabel("frequency (Hz)")
    axes[0].legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.13),
        ncols=3,
        handlelength=1.2,
        handletextpad=0.4,
        columnspacing=1.0,
        borderaxespad=0.0,
    )


def _laid_out(figure: Any) -> None:
    """The figure with its panels in place, and with powers of ten as plain text.

    `savefig` would draw everything once for the layout and once for the file, and three quarters of
    the layout's time go into the minor ticks of logarithmic axes, which have no labels above a
    decade; the parser of mathematical text takes a sixth of the rest.
    """
    from matplotlib.ticker import FuncFormatter, LogFormatter, NullLocator

    unlabelled = []
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        major, minor = axis.get_major_formatter(), axis.get_minor_formatter()
        if not isinstance(major, LogFormatter):
            continue
        low, high = sorted(axis.get_view_interval())
        major.set_locs(axis.get_majorticklocs())
        axis.set_major_formatter(FuncFormatter(partial(_plain, major)))
        if low > 0.0 and high > MINOR_LABELS * low:
            unlabelled.append((axis, axis.get_minor_locator()))
            axis.set_minor_locator(NullLocator())
        elif isinstance(minor, LogFormatter):
            minor.set_locs(axis.get_minorticklocs())
            axis.set_minor_formatter(FuncFormatter(partial(_plain, minor)))
    figure.get_layout_engine().execute(figure)
    figure.set_layout_engine("none")
    for axis, locator in unlabelled:
        axis.set_minor_locator(locator)


def _plain(formatter: Callable[..., str], value: float, at: int | None) -> str:
    """The label of a tick with its power of ten in superior figures."""
    text = formatter(value, at)
    found = re.fullmatch(r"\$\\mathdefault\{(.*)\}\$", text)
    if found is None:
        return text
    text = found[1].replace(r"\times", "×").replace(" ", "")
    return re.sub(r"\^\{(-?\d+)\}", lambda m: m[1].translate(SUPERIOR), text)


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
