"""The figures of `identify`: the stabilisation diagram before its spectrum, synthesised over
measured responses, MAC of the set with itself, damping over frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.report.frf_figures import UNITS
from cvxupdate.report.matrix import ROWS, matrix
from cvxupdate.report.numbers import number
from cvxupdate.report.svg import AFTER, BEFORE, HELD, INK, QUIET, draw, draw_panels

if TYPE_CHECKING:
    from cvxupdate.commands.identified import Fitted, ModeSetResult

Real = NDArray[Any]
LINES = 1500
PANELS = 6
STILL = 1e-12
"""Part of the largest response at a place below which a force does not move it."""
BAR = 0.004
"""Height of the tick that marks a mode, in the axis."""


def diagram(name: str, s: ModeSetResult) -> str | None:
    """Poles of every order over frequency, stable ones filled, the spectrum behind; the modes that
    were kept are marked."""
    d = s.diagram
    if d is None:
        return indicator(name, s)

    def paint(ax: Any) -> None:
        _spectrum(ax, s)
        ax.plot(
            d.frequency[~d.stable],
            d.order[~d.stable],
            "o",
            mfc="none",
            mec=QUIET,
            mew=0.5,
            ms=2.2,
            ls="",
            label="found in this order only",
            zorder=3,
        )
        ax.plot(
            d.frequency[d.stable],
            d.order[d.stable],
            "o",
            color=AFTER,
            mew=0,
            ms=3,
            ls="",
            label="stable",
            zorder=4,
        )
        _kept(ax, s)
        ax.set(
            xlabel="frequency (Hz)",
            ylabel="order of the model",
            xlim=s.band,
            ylim=(0, 1.04 * float(d.order.max(initial=4))),
        )
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, handletextpad=0.2)

    says = "Stabilisation diagram: poles of each model order over frequency, the spectrum behind"
    return draw(name, says, 7.6, 4.2, paint)


def indicator(name: str, s: ModeSetResult) -> str | None:
    """The spectrum alone with the modes, where a method has no diagram."""
    if not s.spectrum_lines.size:
        return None

    def paint(ax: Any) -> None:
        _spectrum(ax, s)
        _kept(ax, s)
        ax.set(xlabel="frequency (Hz)", xlim=s.band)
        ax.set_yticks([])
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, handletextpad=0.2)

    return draw(name, "Spectrum with the modes that were found", 7.6, 3.2, paint)


def _kept(ax: Any, s: ModeSetResult) -> None:
    for k, f in enumerate(s.frequency):
        ax.axvline(f, color=HELD, lw=0.9, zorder=2, label="modes" if k == 0 else None)


def _spectrum(ax: Any, s: ModeSetResult) -> None:
    """On an axis of its own: its scale is logarithmic and says nothing beside the orders."""
    behind = ax.twinx()
    step = max(1, -(-s.spectrum_lines.size // LINES))
    for k, curve in enumerate(s.spectrum):
        y = np.asarray(curve)
        # peaks must survive the thinning: the largest of every few lines
        n = y.size // step * step
        shown = y[:n].reshape(-1, step).max(axis=1)
        x = s.spectrum_lines[:n:step]
        good = shown > 0.0
        behind.plot(x[good], shown[good], color=BEFORE, lw=1.0 if k == 0 else 0.6, zorder=1)
    behind.set_yscale("log")
    behind.set_yticks([])
    behind.minorticks_off()
    behind.grid(False)
    ax.set_zorder(behind.get_zorder() + 1)


def synthesised(name: str, fit: Fitted) -> str | None:
    """Moduli of a few responses, measured and synthesised from the modes."""
    chosen = _chosen(fit)
    if not chosen:
        return None
    step = max(1, -(-fit.frequency.size // LINES))
    f = fit.frequency[::step]

    def paint(axes: list[Any]) -> None:
        for ax, (i, j) in zip(axes, chosen, strict=True):
            x = np.abs(fit.measured[::step, i, j])
            ax.plot(f, x, color=INK, lw=3.0, alpha=0.3, label="measured")
            ax.plot(
                f, np.abs(fit.fitted[::step, i, j]), color=AFTER, lw=1.0, label="from the modes"
            )
            ax.set_yscale("log")
            good = x[x > 0.0]
            if good.size:
                ax.set_ylim(0.2 * float(np.quantile(good, 0.01)), 4.0 * float(good.max()))
            ax.set_title(f"{fit.responses[i]} / {fit.references[j]}", fontsize=9, loc="left")
            ax.set(ylabel=UNITS.get(fit.quantity, ""), xlim=(float(f[0]), float(f[-1])))
            ax.grid(False, which="minor")
        axes[len(chosen) - 1].set_xlabel("frequency (Hz)")
        axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.13), ncols=2, borderaxespad=0.0)

    return draw_panels(
        name,
        "Frequency responses synthesised from the modes over the measured ones",
        7.6,
        1.8 * len(chosen) + 0.4,
        len(chosen),
        1,
        paint,
    )


def _chosen(fit: Fitted) -> list[tuple[int, int]]:
    """Drive points first, then others spread over the set; none that its force does not move."""
    size = np.max(np.abs(fit.measured), axis=0, initial=0.0)
    moves = size > STILL * np.max(size, axis=1, keepdims=True)
    every = [(int(i), int(j)) for j, i in np.argwhere(moves.T)]
    drive = [(i, j) for i, j in every if fit.responses[i] == fit.references[j]][: PANELS // 2]
    rest = [e for e in every if e not in drive]
    room = min(PANELS - len(drive), len(rest))
    picked = {round(k) for k in np.linspace(0, len(rest) - 1, room)} if room else set()
    return [*drive, *(rest[k] for k in sorted(picked))]


def auto_mac(name: str, s: ModeSetResult) -> str | None:
    """MAC of the modes with one another."""
    if len(s.modes) < 2 or len(s.labels) < 2:
        return None
    names = [number(m.frequency, 4) for m in s.modes][:ROWS]
    return matrix(
        name,
        "MAC of the identified modes with one another",
        np.asarray(s.auto_mac),
        names,
        names,
        ("mode (Hz)", "mode (Hz)"),
    )


def damping(name: str, s: ModeSetResult) -> str | None:
    """Damping of every mode with two deviations, and the law that it follows, where there is
    one."""
    known = [m for m in s.modes if np.isfinite(m.damping)]
    if len(known) < 2:
        return None

    def paint(ax: Any) -> None:
        f = np.array([m.frequency for m in known])
        z = 100.0 * np.array([m.damping for m in known])
        sd = 200.0 * np.array([m.damping_std for m in known])
        ax.errorbar(f, z, yerr=np.where(np.isfinite(sd), sd, 0.0), fmt="o", color=AFTER, ms=4, lw=1)
        law = s.laws
        if law is not None and law.verdict != "none":
            x = np.linspace(f.min(), f.max(), 200)
            power = {"constant decay rate": -1.0, "constant ratio": 0.0}.get(law.verdict, 1.0)
            level = float(np.median(z / f**power))
            ax.plot(x, level * x**power, color=INK, lw=0.9, label=law.verdict)
            ax.legend(loc="upper right")
        ax.set(xlabel="frequency (Hz)", ylabel="damping (% of critical)")
        ax.set_ylim(bottom=0.0)

    return draw(name, "Damping of each mode over frequency, with two deviations", 4.7, 3.2, paint)
