"""The figures of `correlate` that need no structure: 45° lines, matrices and bars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.figures import shortened
from cvxupdate.report.matrix import ROWS, WIDTH, matrix
from cvxupdate.report.numbers import fixed, number
from cvxupdate.report.svg import AFTER, BAND, HELD, INK, QUIET, draw, draw_panels

if TYPE_CHECKING:
    from cvxupdate.correlate.result import ModePair, SensorReport, ShapeComparison

Real = NDArray[Any]


def frequencies(modes: Sequence[ModePair]) -> str | None:
    """Model frequency against measured frequency with the 45° line."""
    if not modes:
        return None

    def paint(ax: Any) -> None:
        top = 1.04 * max(max(m.measured, m.model) for m in modes)
        low = min(0.96 * min(min(m.measured, m.model) for m in modes), top / 2)
        low = 0.0 if low < 0.25 * top else low
        ax.plot([low, top], [low, top], color=QUIET, lw=0.9, zorder=1)
        for use, marker, colour, label in (
            ("fit", "o", AFTER, "to fit"),
            ("hold-out", "D", HELD, "held out"),
        ):
            mine = [m for m in modes if m.use == use]
            if mine:
                ax.plot(
                    [m.measured for m in mine],
                    [m.model for m in mine],
                    marker,
                    color=colour,
                    mew=0,
                    ms=5.5,
                    ls="",
                    label=label,
                    zorder=3,
                )
        ax.set(
            xlim=(low, top),
            ylim=(low, top),
            xlabel="measured frequency (Hz)",
            ylabel="model frequency (Hz)",
            aspect="equal",
        )
        if len({m.use for m in modes}) > 1:
            ax.legend(loc="upper left", handletextpad=0.2, borderaxespad=0.2)

    return draw(
        "frequencies",
        "Model frequency against measured frequency; the closer to the 45 degree line the better",
        WIDTH,
        4.4,
        paint,
    )


def errors(modes: Sequence[ModePair]) -> str | None:
    """Signed frequency error of every pair; the measured ± one standard deviation behind it where
    it is known."""
    shown = list(modes)[:ROWS]
    if not shown:
        return None

    def paint(ax: Any) -> None:
        y = list(range(len(shown)))
        sd = [100 * (m.standard_deviation or 0.0) / m.measured for m in shown]
        if any(sd):
            ax.barh(
                y,
                [2 * s for s in sd],
                left=[-s for s in sd],
                height=0.9,
                color=BAND,
                label="measured ± 1 standard deviation",
                zorder=1,
            )
            ax.legend(
                loc="lower left",
                bbox_to_anchor=(0.0, 1.0),
                handlelength=1.0,
                handletextpad=0.4,
                borderaxespad=0.1,
            )
        ax.barh(
            y,
            [m.error_percent for m in shown],
            height=0.6,
            color=[AFTER if m.use == "fit" else HELD for m in shown],
            zorder=2,
        )
        ax.axvline(0.0, color=INK, lw=0.8, zorder=3)
        ax.set_yticks(y, [f"{m.measured:.5g} Hz" for m in shown])
        ax.set(ylim=(len(shown) - 0.4, -0.6), xlabel="(model − measured) / measured (%)")
        ax.grid(False, axis="y")
        ax.tick_params(axis="y", length=0)

    return draw(
        "errors",
        "Frequency error in per cent of each measured mode",
        WIDTH,
        0.75 + 0.235 * len(shown),
        paint,
    )


def shape_lines(name: str, found: ShapeComparison) -> str | None:
    """Measured against model motion at every sensor for each paired mode, with the 45° line
    (section 2.2)."""
    c = found.correlation
    count = min(c.shapes_model.shape[1], 9)
    if not count:
        return None
    columns = min(count, 3)
    rows = -(-count // columns)

    def paint(axes: list[Any]) -> None:
        for k, ax in enumerate(axes):
            ax.set_visible(k < count)
            if k >= count:
                continue
            a, x = np.real(c.shapes_model[:, k]), np.real(c.shapes_measured[:, k])
            top = 1.08 * float(np.nanmax(np.abs(np.concatenate([a, x]))))
            ax.plot([-top, top], [-top, top], color=QUIET, lw=0.8, zorder=1)
            ax.plot(x, a, "o", color=AFTER, ms=3.0, mew=0, ls="", zorder=3)
            ax.set(xlim=(-top, top), ylim=(-top, top), aspect="equal")
            ax.set_title(
                f"mode {found.measured_number[k]}, MAC {fixed(float(c.pairing.mac[k]), 2)}",
                fontsize=8.5,
            )
            ax.set_xticks([])
            ax.set_yticks([])
            if k % columns == 0:
                ax.set_ylabel("model", fontsize=8.5)
            if k + columns >= count:
                ax.set_xlabel("measured", fontsize=8.5)

    says = (
        "Model against measured motion at every sensor, mode by mode; a perfect shape lies on "
        "the 45 degree line"
    )
    return draw_panels(name, says, WIDTH, 1.68 * rows + 0.1, rows, columns, paint)


def comac_bars(name: str, found: ShapeComparison) -> str | None:
    """COMAC of every sensor, the worst first."""
    values = np.asarray(found.correlation.comac)
    order = [
        int(i)
        for i in np.argsort(np.where(np.isfinite(values), values, 2.0))
        if np.isfinite(values[i])
    ][: ROWS // 2]
    if not order:
        return None
    return _bars(
        name,
        "Coordinate MAC of the sensors, the worst first",
        [found.labels[i] for i in order],
        [float(values[i]) for i in order],
        "COMAC",
        AFTER,
    )


def group_bars(name: str, names: Sequence[str], fraction: Real, change: Real) -> str | None:
    """The fraction of the imbalance that each group explains, with the change of stiffness that
    would explain it."""
    order = [int(i) for i in np.argsort(-fraction, kind="stable")][: ROWS // 2]
    if not order or not np.any(fraction > 0.0):
        return None
    notes = [
        f"{100 * change[i]:+.0f} %".replace("-", "−") if fraction[i] > 0.005 else "" for i in order
    ]
    return _bars(
        name,
        "Fraction of the force imbalance that each group explains",
        [shortened(names[i]) for i in order],
        [float(fraction[i]) for i in order],
        "fraction of the imbalance explained",
        HELD,
        notes,
    )


def visibility(name: str, found: SensorReport) -> str | None:
    """MAC of the model's modes with one another as the sensors see them: off the diagonal it should
    be pale."""
    if len(found.labels) < 2 or len(found.frequency) < 2:
        return None
    names = [number(float(f), 3) for f in found.frequency]
    return matrix(
        name,
        "MAC of the model's modes with one another at the sensors",
        np.asarray(found.alike),
        names,
        names,
        ("model mode (Hz)", "model mode (Hz)"),
    )


def _bars(
    name: str,
    says: str,
    names: Sequence[str],
    values: Sequence[float],
    label: str,
    colour: str,
    notes: Sequence[str] = (),
) -> str:
    def paint(ax: Any) -> None:
        y = range(len(values))
        ax.barh(y, values, height=0.62, color=colour, zorder=2)
        for row, note in enumerate(notes):
            ax.annotate(
                note,
                (values[row], row),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8.5,
                color=INK,
            )
        ax.set_yticks(y, list(names))
        ax.set(xlim=(0.0, 1.0 if not notes else max(1.15 * max(values), 0.05)), xlabel=label)
        ax.invert_yaxis()
        ax.grid(False, axis="y")
        ax.tick_params(axis="y", length=0)

    return draw(name, says, WIDTH, 0.7 + 0.235 * len(values), paint)
