"""The page, the files and the terminal summary of `plan`."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report import plan_figures as figures
from cvxupdate.report.as_json import dumps, plain
from cvxupdate.report.correlate_parts import svg
from cvxupdate.report.numbers import count, fixed, number, seconds
from cvxupdate.report.page import command, render
from cvxupdate.report.plan_apart import (
    apart_csv,
    apart_data,
    apart_map,
    apart_rows,
    apart_says,
    boundary_says,
    law_rows,
    laws_says,
    together_says,
)
from cvxupdate.report.words import Verdict

if TYPE_CHECKING:
    from rich.console import RenderableType

    from cvxupdate.commands.planned import Lines, Planned

WORST = 12
"""Parameters in the table of deviations; the others are in result.json."""


def plan_files(found: Planned) -> tuple[dict[str, str], str]:
    """Files by name, and the JSON text by itself."""
    text = dumps(plain(plan_data(found)))
    return {"result.json": text, "plan.csv": plan_csv(found), "report.html": plan_page(found)}, text


def plan_data(found: Planned) -> dict[str, Any]:
    """Everything but curves, as plain data."""
    return {
        "problem": found.problem,
        "status": "converged",
        "reason": "a plan was made from the model",
        "method": "plan",
        "time": found.time,
        "title": found.title,
        "path": found.path,
        "options": found.options,
        "frequencies": found.frequencies,
        "sensors": [vars(s) for s in found.sensors],
        "exciters": vars(found.exciters),
        "indicator_dips": found.indicator.dips,
        "parameters": found.parameters,
        "lines": [vars(x) for x in found.lines],
        "log_function": {
            "frequency": found.log_function[0],
            "bearable_noise": found.log_function[1],
        },
        "noise": found.noise,
        "accuracy": found.accuracy,
        "notes": found.notes,
        "apart": apart_data(found.apart),
    }


def plan_csv(found: Planned) -> str:
    """What to mount and what to measure: kind, order, DOF, node, direction and place in m; lines in
    Hz."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["kind", "order", "dof", "node", "direction", "x", "y", "z", "frequency"])
    geometry = found.geometry
    at = (
        {}
        if geometry is None
        else {int(n): geometry.xyz[k] for k, n in enumerate(geometry.node_ids)}
    )
    for kind, labels in (
        ("sensor", found.sensors[0].labels),
        ("exciter", found.exciters.labels),
    ):
        for k, label in enumerate(labels, start=1):
            node, _, direction = label[1:].partition(".")
            xyz = at.get(int(node))
            place = ["", "", ""] if xyz is None else [f"{float(v):.9g}" for v in xyz]
            writer.writerow([kind, k, label, node, direction, *place, ""])
    for k, f in enumerate(found.lines[0].lines if found.lines else (), start=1):
        writer.writerow(["line", k, "", "", "", "", "", "", f"{f:.9g}"])
    if found.apart is not None:
        writer.writerow([])
        writer.writerow(["kind", "order", "dof", "drive", "says", "deviations"])
        writer.writerows(apart_csv(found.apart))
    return out.getvalue()


def plan_page(found: Planned) -> str:
    """The HTML text of a report on `plan`."""
    return render(
        "plan.html",
        {
            "f": found,
            "verdict": plan_verdict(found),
            "apart": [] if found.apart is None else apart_rows(found.apart),
            "laws": [] if found.apart is None else law_rows(found.apart),
            "apart_map": svg(apart_map("pa", found)),
            "places": svg(figures.places("pl", found)),
            "indicator": svg(figures.indicator("pi", found)),
            "log": svg(figures.bearable("pb", found)),
            "sensors": [_sensor_row(s) for s in found.sensors],
            "modes": _mode_rows(found),
            "forces": _force_rows(found),
            "lines": [_line_row(x, found) for x in found.lines],
            "deviations": _deviation_rows(found),
            "noise": f"{number(100 * found.noise, 3)} %",
            "apart_noise": f"{number(100 * found.noise, 3)} % noise"
            if "--noise" in found.options
            else "the noise of the recordings",
            "accuracy": f"{number(100 * found.accuracy, 3)} %",
            "command": command(f"plan {found.options}".strip(), found.path),
            "time": seconds(found.time),
        },
    )


def plan_verdict(found: Planned) -> Verdict:
    """What to do, in a line, and what to mind."""
    s, e = found.sensors[0], found.exciters
    headline = (
        f"{count(len(s.labels), 'sensor')} and {count(len(e.labels), 'exciter')} for "
        f"{count(len(found.frequencies), 'mode')} from {number(found.frequencies[0])} to "
        f"{number(found.frequencies[-1])} Hz."
    )
    says = [f"Sensors: {', '.join(s.labels)}.", f"Exciters: {', '.join(e.labels)}."]
    if found.lines:
        says.append(_accuracy(found))
    if found.apart is not None:
        first = apart_says(found.apart)
        told = [together_says(found.apart), boundary_says(found.apart), *found.apart.lines]
        told.append(laws_says(found.apart))
        told = [line for line in told if line and line != first]
        headline, says = first, [*told, f"From the model alone: {headline}", *says]
    tone = "good" if s.alike < 0.9 and all(d < 0.3 for d in found.indicator.dips) else "fair"
    return Verdict(tone, headline, tuple(says))


def _accuracy(found: Planned) -> str:
    best = found.lines[0]
    known = [d for d in best.deviations if np.isfinite(d)]
    if len(known) < len(best.deviations):
        names = [
            n for n, d in zip(found.parameters, best.deviations, strict=True) if not np.isfinite(d)
        ]
        listed = ", ".join(names[:6]) + (" …" if len(names) > 6 else "")
        return f"These measurements leave {count(len(names), 'parameter')} open: {listed}."
    return (
        f"With {number(100 * found.noise, 3)} % noise on the responses the parameters are known to "
        f"{number(100 * max(known), 3)} % or better (one deviation); "
        f"{number(100 * found.accuracy, 3)} % of every one needs {number(100 * best.bears, 3)} % "
        "noise or less."
    )


def _sensor_row(s: Any) -> dict[str, str]:
    return {
        "rule": s.rule,
        "says": s.says,
        "labels": ", ".join(s.labels),
        "condition": number(s.condition, 3) if np.isfinite(s.condition) else "∞",
        "alike": fixed(s.alike, 2),
        "peak": fixed(s.peak, 2),
        "deviation": "" if s.deviation is None else f"{number(100 * s.deviation, 3)} %",
    }


def _mode_rows(found: Planned) -> list[dict[str, str]]:
    e = found.exciters
    return [
        {
            "number": str(k),
            "frequency": number(f),
            "drive": fixed(d, 2),
            "dip": fixed(dip, 2),
            "purity": fixed(p, 2),
        }
        for k, (f, d, dip, p) in enumerate(
            zip(found.frequencies, e.drive, found.indicator.dips, e.purity, strict=True), start=1
        )
    ]


def _force_rows(found: Planned) -> list[list[str]]:
    return [
        [str(k), *(fixed(float(v), 2) for v in row)]
        for k, row in enumerate(found.exciters.forces, start=1)
    ]


def _line_row(x: Lines, found: Planned) -> dict[str, str]:
    known = [d for d in x.deviations if np.isfinite(d)]
    return {
        "rule": x.rule,
        "says": x.says,
        "count": str(len(x.lines)),
        "lines": ", ".join(number(f, 4) for f in x.lines),
        "median": f"{number(100 * float(np.median(known)), 3)} %" if known else "–",
        "worst": f"{number(100 * max(known), 3)} %" if known else "–",
        "open": str(len(x.deviations) - len(known)),
        "bears": f"{number(100 * x.bears, 3)} %" if x.bears > 0.0 else "none",
    }


def _deviation_rows(found: Planned) -> list[dict[str, str]]:
    if not found.lines:
        return []
    pairs = list(zip(found.parameters, found.lines[0].deviations, strict=True))
    pairs.sort(key=lambda q: -q[1] if np.isfinite(q[1]) else -np.inf)
    return [
        {
            "name": name,
            "deviation": f"{number(100 * d, 3)} %" if np.isfinite(d) else "open",
            "needs": f"{number(100 * found.noise * found.accuracy / d, 3)} %"
            if np.isfinite(d) and d > 0.0
            else "–",
        }
        for name, d in pairs[:WORST]
    ]


def plan_text(found: Planned, folder: Path) -> RenderableType:
    """What `plan` prints on a terminal."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from cvxupdate.report.summary import TONES

    says = plan_verdict(found)
    table = Table(title="sensors", title_justify="left", box=None)
    for head in ("rule", "condition", "alike", "peak", "deviation"):
        table.add_column(head, justify="left" if head == "rule" else "right")
    for s in found.sensors:
        row = _sensor_row(s)
        table.add_row(*(row[k] for k in ("rule", "condition", "alike", "peak", "deviation")))
    parts: list[RenderableType] = [
        Text(found.title or found.problem, style="bold"),
        Text(says.headline, style=TONES[says.tone]),
        *(Text(line) for line in says.sentences),
        table,
        *(Text(note, style="dim") for note in found.notes),
        Text(f"plan.csv, result.json, report.html: {folder}"),
    ]
    return Group(*parts)
