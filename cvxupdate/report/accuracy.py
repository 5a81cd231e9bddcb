"""How accurate recordings of frequency responses must be, as a section of the page of `run`: words
and a figure for each recording (chapter 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from cvxupdate.report.numbers import count, short
from cvxupdate.report.svg import AFTER, BEFORE, HELD, QUIET, draw_panels

if TYPE_CHECKING:
    from cvxupdate.update.result import AccuracyResult, Updated

WIDTH = 4.7
LISTED = 20
"""Best lines that are listed at most."""


def accuracy_sections(updated: Updated) -> list[dict[str, Any]]:
    """For each recording its name, sentences and figure."""
    return [
        {"name": a.recording, "sentences": sentences(a), "figure": Markup(figure(k, a))}
        for k, a in enumerate(updated.accuracy)
    ]


def sentences(a: AccuracyResult) -> list[str]:
    """What the figure says, for someone who has to decide whether to measure again."""
    known = (
        "as the recording states"
        if a.stated
        else "an assumption, because the recording states none"
    )
    low, high = min(a.bearable), max(a.bearable)
    place = a.frequency[a.bearable.index(high)]
    below = sum(b > a.noise for b in a.bearable)
    out = [
        f"Noise: {_percent(a.noise)} of each entry (typical standard deviation; {known}). "
        f"Sought: {_percent(a.change)} on every parameter.",
        "Taken one line at a time and without weights, the update equations tell such errors "
        f"from noise only below {_percent(low)} at the worst line and {_percent(high)} at the "
        f"best ({short(place)} Hz): the condition (5.12) on norms. "
        f"{_holds(below, len(a.frequency))} It is sufficient, not necessary: it says which "
        "lines are best and how the structure fares against others, not what the weighted "
        "fit needs.",
    ]
    if a.spread is None or a.borne is None:
        out.append(
            "The weighted fit of the chosen lines leaves at least half of the parameters "
            "undetermined whatever the noise: more sensors, forces or lines are needed, or "
            "fewer parameters."
        )
    else:
        sure = (
            "The noise is borne."
            if a.borne > a.noise
            else "Such errors drown: measure more accurately, fit more lines, or seek fewer "
            "parameters."
        )
        out.append(
            f"The weighted fit of {count(len(a.fitted), 'line')} is far better off: before "
            "any updating it expects a typical parameter to be found to ± "
            f"{_percent(a.spread)}. That would reach {_percent(a.change)}, and the errors "
            f"sought would drown, at {_percent(a.borne)} noise. {sure}"
        )
    out.append(
        f"The least that must hold is (5.15): the noise, {_percent(a.noise)}, far below the "
        f"modelling error, here {_percent(min(a.relative_model))} to "
        f"{_percent(max(a.relative_model))} of ‖Z‖."
    )
    radii = [r for r in a.radius if r is not None]
    if radii:
        fine = sum(r < 1.0 for r in radii)
        out.append(
            f"The series by which noise enters the correction converges (5.6) at {fine} of "
            f"{count(len(radii), 'line')}. That must hold and is not enough: what noise brings in "
            "must be small beside the modelling error as well (5.9)."
        )
    if a.best:
        shown = ", ".join(short(f) for f in a.best[:LISTED])
        out.append(
            f"Best lines by the log function: {shown}{' …' if len(a.best) > LISTED else ''} Hz."
        )
    return out


def figure(number_: int, a: AccuracyResult) -> str:
    """Error and system component of the log function, and the admissible noise beside that of the
    recording, against frequency."""

    def paint(axes: list[Any]) -> None:
        upper, lower = axes
        f, mark = a.frequency, "none" if len(a.frequency) > 1 else "o"
        upper.plot(f, a.system, marker=mark, color=AFTER, label="system component, log(‖ΔZ‖/‖Z‖²)")
        upper.plot(f, a.error, marker=mark, color=HELD, label="error component, log ‖ε‖")
        upper.set(ylabel="log10 (m/N)")
        upper.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), handlelength=1.2, borderaxespad=0.1
        )
        lower.plot(f, [100 * b for b in a.bearable], marker=mark, color=AFTER, zorder=2)
        _noise_axis(lower, a)
        for axis in axes:
            axis.tick_params(color=QUIET)
            axis.set_xlim(min(f) - 1e-9, max(f) + 1e-9)

    return draw_panels(
        f"accuracy{number_}",
        "Error component and system component of the characteristic log function, and the "
        "admissible noise, against frequency",
        WIDTH,
        5.2,
        2,
        1,
        paint,
    )


def _noise_axis(ax: Any, a: AccuracyResult) -> None:
    """The noise of the recording, the best lines and those that are fitted."""
    ax.axhline(100 * a.noise, color=HELD, lw=1.2, label="recording", zorder=2)
    ax.set_yscale("log")
    at = dict(zip(a.frequency, a.bearable, strict=True))
    best = [x for x in a.best if x in at]
    values = [100 * at[x] for x in best]
    ax.plot(best, values, "o", color=AFTER, mew=0, ms=4.5, label="best lines", zorder=3)
    ax.plot(
        a.fitted,
        [0.03] * len(a.fitted),
        "|",
        color=BEFORE,
        ms=9,
        mew=1.1,
        transform=ax.get_xaxis_transform(),
        label="fitted lines",
        zorder=3,
    )
    ax.grid(False, which="minor")
    ax.set(xlabel="frequency (Hz)", ylabel="admissible noise (%)")
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=3,
        handlelength=1.2,
        columnspacing=1.4,
        borderaxespad=0.1,
    )


def _percent(value: float) -> str:
    return f"{short(100 * value, 2)} %"


def _holds(good: int, lines: int) -> str:
    if good == 0:
        return "The recording is noisier at every line."
    return (
        "The recording is quieter at every line."
        if good == lines
        else f"The recording is quieter at {good} of {count(lines, 'line')}."
    )
