"""The page of `correlate`: how far model and recordings agree, mode by mode, place by place, line
by line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report import correlate_figures as figures
from cvxupdate.report import structure_figures as on_structure
from cvxupdate.report.correlate_parts import MOST_ROWS, frf_part, sensor_part, shape_part, svg
from cvxupdate.report.correlate_words import compared_verdict
from cvxupdate.report.matrix import ROWS
from cvxupdate.report.numbers import count, decimals, fixed, number, seconds, signed, with_deviation
from cvxupdate.report.own_errors import own_rows
from cvxupdate.report.page import command, render
from cvxupdate.report.words import METRICS

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Compared, ModePair

MOST_PARTS = 12
"""Recordings of one kind that are shown in full."""
BY = {"file": "problem file", "shape": "MAC", "frequency": "frequency"}


def correlate_page(compared: Compared) -> str:
    """The HTML text of a report on `correlate`."""
    return render(
        "correlate.html",
        {
            "c": compared,
            "own": own_rows(compared.recordings),
            "verdict": compared_verdict(compared),
            "asked": asked(compared),
            "metrics": metric_rows(compared),
            "modes": mode_rows(compared.modes[:MOST_ROWS]),
            "more_modes": max(0, len(compared.modes) - MOST_ROWS),
            "bars": ROWS,
            "several": len({m.recording for m in compared.modes}) > 1,
            "mac": any(m.mac is not None for m in compared.modes),
            "figure": {
                "errors": svg(figures.errors(compared.modes)),
                "frequencies": svg(figures.frequencies(compared.modes)),
            },
            "nominal": svg(on_structure.nominal_panels("nominal", compared)),
            "shapes": [
                shape_part(k, s, compared) for k, s in enumerate(compared.shapes[:MOST_PARTS])
            ],
            "frfs": [frf_part(k, f) for k, f in enumerate(compared.frfs[:MOST_PARTS])],
            "more_frfs": max(0, len(compared.frfs) - MOST_PARTS),
            "frf_rows": [
                {
                    "recording": f.recording,
                    "use": f.use,
                    "error": number(f.correlation.total, 3),
                    "frac": _least(f.correlation.frac),
                    "how": f.origin_of,
                }
                for f in compared.frfs[:MOST_ROWS]
            ],
            "sensors": [sensor_part(k, s) for k, s in enumerate(compared.sensors[:MOST_PARTS])],
            "command": command("correlate", compared.path),
            "time": seconds(compared.time),
        },
    )


def asked(c: Compared) -> list[tuple[str, list[str]]]:
    """What was compared, as (term, lines)."""
    out = [("Problem", [c.problem, c.path])]
    if c.source:
        out.append(("Source", [c.source]))
    m = c.model
    sizes = (
        f"{count(m['nodes'], 'node')}, {count(m['elements'], 'element')}, "
        f"{count(m['dofs'], 'free degree', 'free degrees')} of freedom"
    )
    rigid = f", {count(m['rigid'], 'rigid-body mode')}" if m["rigid"] else ""
    mass = [f"total mass {number(m['mass'], 5)} kg"] if m["mass"] else []
    mass += ["matrices of another program, in its units"] if m["given"] else []
    out.append(("Model", [sizes + rigid, *mass, "damped" if m["damped"] else "undamped"]))
    lines = []
    for name in dict.fromkeys(x.recording for x in c.modes):
        mine = [x for x in c.modes if x.recording == name]
        sensors = next((len(s.labels) for s in c.shapes if s.recording == name), 0)
        lines.append(
            f"{name}: {count(len(mine), 'mode')}"
            + (f" at {count(sensors, 'sensor')}" if sensors else ", no shapes")
            + _held(mine[0].use)
        )
    lines += [
        f"{f.recording}: {count(len(f.responses), 'response')} × "
        f"{count(len(f.references), 'reference')}, {len(f.frequency)} lines from "
        f"{number(float(f.frequency[0]), 3)} to {number(float(f.frequency[-1]), 4)} Hz, "
        f"{f.origin_of}{_held(f.use)}"
        for f in c.frfs[:20]
    ]
    if len(c.frfs) > 20:
        lines.append(f"and {len(c.frfs) - 20} more")
    out.append(("Recordings", lines))
    return out


def metric_rows(c: Compared) -> list[dict[str, str]]:
    """The contract's metrics: fitted recordings first, then those held out."""
    out = []
    for key, what in (("fit", "to fit"), ("hold_out", "held out")):
        for metric, pair in c.fit.get(key, {}).items():
            name, unit = METRICS.get(metric, (metric, ""))
            out.append(
                {
                    "name": name,
                    "what": what,
                    "value": f"{fixed(pair['before'])} %"
                    if unit == "%"
                    else number(pair["before"]),
                }
            )
    return out


def mode_rows(modes: tuple[ModePair, ...]) -> list[dict[str, str]]:
    """Pairs as text; a column has the same decimals throughout."""
    given = min(decimals(m.measured for m in modes), 4)
    places = max(given, 2 if max((m.measured for m in modes), default=0.0) > 20.0 else 3)
    return [
        {
            "number": str(m.number),
            "mode": str(m.mode),
            "recording": m.recording,
            "use": m.use,
            "by": BY[m.by],
            "measured": with_deviation(m.measured, m.standard_deviation)
            if m.standard_deviation
            else fixed(m.measured, max(given, places) if given > 3 else given),
            "model": fixed(m.model, places),
            "error": signed(m.error_percent),
            "mac": fixed(m.mac, 3),
            "damping": "–" if m.damping is None else f"{fixed(100 * m.damping)} %",
        }
        for m in modes
    ]


def _least(frac: Any) -> str:
    good = np.asarray(frac)[np.isfinite(frac)]
    return fixed(float(good.min())) if good.size else "–"


def _held(use: str) -> str:
    return "" if use == "fit" else ", held out"
