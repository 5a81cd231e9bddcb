"""Figures for programs: each a matplotlib figure that the caller shows, changes or saves. They are
drawn without pyplot, so that nothing opens a window or stays in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError

if TYPE_CHECKING:
    from cvxupdate.correlate.result import FrfComparison, Geometry

Real = NDArray[Any]
PANELS = 6
CURVES = 8
ROWS = 40
MEASURED = "#222222"
COLOURS = {"before": "#b3560f", "after": "#1560a8", "model": "#1560a8"}
MARKS = {"before": "o", "after": ".", "model": "o"}
RATIO = {"displacement": "m/N", "velocity": "m/s/N", "acceleration": "m/s²/N"}


def blank(width: float, height: float, rows: int = 1, **keys: Any) -> tuple[Any, list[Any]]:
    """A figure in inches and its axes, one below the other; ``keys`` of `Figure.subplots`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, 1, squeeze=False, **keys).flat)


def frf_figure(f: Real, curves: Real, pairs: Sequence[tuple[str, str]], unit: str) -> Any:
    """Moduli and phases of frequency responses (lines, curves); the first eight."""
    figure, (top, low) = blank(7.0, 5.0, 2, sharex=True)
    for k, (o, i) in enumerate(pairs[:CURVES]):
        top.semilogy(f, np.abs(curves[:, k]), lw=1.0, label=f"{o} / {i}")
        low.plot(f, np.degrees(np.angle(curves[:, k])), lw=1.0)
    top.set_ylabel(f"modulus ({unit})")
    low.set(xlabel="frequency (Hz)", ylabel="phase (°)", yticks=(-180, -90, 0, 90, 180))
    top.legend(fontsize="small")
    if len(pairs) > CURVES:
        top.set_title(f"the first {CURVES} of {len(pairs)}", fontsize="small", loc="left")
    return figure


def time_figure(t: Real, data: Real, names: Sequence[str]) -> Any:
    """Channels over time, one below the other; the first eight."""
    shown = names[:CURVES]
    figure, axes = blank(7.0, 1.0 + 1.3 * len(shown), len(shown), sharex=True)
    for k, (ax, name) in enumerate(zip(axes, shown, strict=True)):
        ax.plot(t, data[:, k], lw=0.7, color=MEASURED)
        ax.set_title(name, fontsize="small", loc="left")
    axes[-1].set_xlabel("time (s)")
    return figure


def overlay_figure(
    found: FrfComparison, models: Mapping[str, Real], response: str = "", reference: str = ""
) -> Any:
    """Measured frequency responses with those of models (lines, responses, references) by name.

    Raises
    ------
    InputError
        When no response is called so.
    """
    pairs = [
        (i, j)
        for j, force in enumerate(found.references)
        for i, place in enumerate(found.responses)
        if (not response or place == response) and (not reference or force == reference)
    ]
    if not pairs:
        raise InputError(
            f"there is no response {response or '(any)'} to {reference or '(any)'}. Responses: "
            f"{', '.join(found.responses)}; references: {', '.join(found.references)}."
        )
    pairs = pairs[:PANELS]
    figure, axes = blank(7.0, 0.8 + 1.9 * len(pairs), len(pairs), sharex=True)
    for ax, (i, j) in zip(axes, pairs, strict=True):
        ax.semilogy(
            found.frequency,
            np.abs(found.measured[:, i, j]),
            lw=1.4,
            color=MEASURED,
            label="measured",
        )
        for name, H in models.items():
            ax.semilogy(
                found.frequency, np.abs(H[:, i, j]), lw=1.0, color=COLOURS.get(name), label=name
            )
        ax.set_title(f"{found.responses[i]} / {found.references[j]}", fontsize="small", loc="left")
        ax.set_ylabel(RATIO.get(found.quantity, ""))
    axes[0].legend(fontsize="small", ncols=3)
    axes[-1].set_xlabel("frequency (Hz)")
    return figure


def frequency_figure(measured: Sequence[float], models: Mapping[str, Sequence[float]]) -> Any:
    """Natural frequencies of models over the measured ones, with the line of equality."""
    figure, (ax,) = blank(4.8, 4.6)
    top = 1.05 * max(max(measured), *(max(values) for values in models.values()))
    ax.plot([0.0, top], [0.0, top], color="#999999", lw=0.8)
    for name, values in models.items():
        ax.plot(
            measured,
            values,
            MARKS.get(name, "o"),
            color=COLOURS.get(name),
            label=name,
            mfc="none" if MARKS.get(name) == "o" else None,
        )
    ax.set(
        xlabel="measured frequency (Hz)",
        ylabel="model frequency (Hz)",
        aspect="equal",
        xlim=(0.0, top),
        ylim=(0.0, top),
    )
    ax.legend()
    return figure


def mac_figure(mac: Real, model: Real, measured: Real) -> Any:
    """MAC (model, measured), with the frequencies of both."""
    rows, columns = mac.shape
    figure, (ax,) = blank(1.6 + 0.45 * columns, 1.4 + 0.4 * rows)
    shown = ax.imshow(mac, vmin=0.0, vmax=1.0, cmap="Blues", origin="lower", aspect="auto")
    ax.set(xlabel="measured (Hz)", ylabel="model (Hz)")
    ax.set_xticks(range(columns), [f"{f:.4g}" for f in measured], rotation=60)
    ax.set_yticks(range(rows), [f"{f:.4g}" for f in model])
    for i in range(rows):
        for j in range(columns):
            if mac[i, j] >= 0.1:
                colour = "white" if mac[i, j] > 0.6 else "black"
                ax.text(
                    j,
                    i,
                    f"{mac[i, j]:.2f}",
                    ha="center",
                    va="center",
                    fontsize="x-small",
                    color=colour,
                )
    figure.colorbar(shown, label="MAC")
    return figure


def parameter_figure(parameters: Sequence[tuple[str, float, float | None]]) -> Any:
    """Relative changes (name, p, deviation) with two standard deviations; the forty largest.

    Raises
    ------
    InputError
        When there is none.
    """
    if not parameters:
        raise InputError("there are no parameters to draw.")
    shown = sorted(parameters, key=lambda q: -abs(q[1]))[:ROWS][::-1]
    figure, (ax,) = blank(6.0, 1.2 + 0.25 * len(shown))
    at = np.arange(len(shown))
    ax.axvline(0.0, color="#999999", lw=0.8)
    ax.barh(at, [100.0 * p for _, p, _ in shown], color=COLOURS["after"], height=0.6)
    bars = [(k, p, s) for k, (_, p, s) in enumerate(shown) if s is not None]
    if bars:
        ax.errorbar(
            [100.0 * p for _, p, _ in bars],
            [k for k, _, _ in bars],
            fmt="none",
            xerr=[200.0 * s for _, _, s in bars],
            ecolor=MEASURED,
            lw=0.9,
            capsize=2,
        )
    ax.set_yticks(at, [name for name, _, _ in shown], fontsize="small")
    ax.set_xlabel("change (%), with 2 standard deviations")
    return figure


def structure_figure(shown: Geometry) -> Any:
    """Nodes and elements in space, or in their plane where they lie in one."""
    xyz = np.asarray(shown.xyz)
    flat = [k for k in range(3) if np.ptp(xyz[:, k]) == 0.0]
    solid = not flat
    keep = [0, 1, 2] if solid else [k for k in range(3) if k != flat[0]]
    figure, (ax,) = blank(6.0, 4.6, subplot_kw={"projection": "3d"} if solid else {})
    for part in shown.parts:
        nodes = [*part.nodes, part.nodes[0]] if len(part.nodes) > 2 else list(part.nodes)
        ax.plot(*xyz[nodes][:, keep].T, "-", lw=0.9, color=COLOURS["after"])
    fixed = ~np.asarray(shown.moves).any(axis=1)
    for where, mark, name in ((~fixed, ".", "nodes"), (fixed, "s", "held")):
        if where.any():
            ax.plot(*xyz[where][:, keep].T, mark, color=MEASURED, ms=4, ls="", label=name)
    names = [("x", "y", "z")[k] for k in keep]
    ax.set(**{f"{axis}label": f"{n} (m)" for axis, n in zip("xyz", names, strict=False)})
    if solid:
        ax.set_box_aspect(np.maximum(np.ptp(xyz, axis=0), 0.05 * np.ptp(xyz, axis=0).max()))
    else:
        ax.set_aspect("equal")
    ax.legend(fontsize="small")
    return figure
