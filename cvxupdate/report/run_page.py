"""The page of `run`: what was asked, what came of it, and the proof."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from cvxupdate.report import figures, parameter_figures
from cvxupdate.report.accuracy import accuracy_sections
from cvxupdate.report.classical import classical_parts, method_words
from cvxupdate.report.clause_lines import clause_lines
from cvxupdate.report.direct_rows import direct_beside, direct_rows
from cvxupdate.report.family_parts import MOST_FAMILIES, family_parts
from cvxupdate.report.grouping_parts import grouping_parts
from cvxupdate.report.judged_parts import judged_parts
from cvxupdate.report.numbers import (
    NOTHING,
    count,
    decimals,
    fixed,
    number,
    power,
    prefix_of,
    seconds,
    short,
    signed,
    with_deviation,
)
from cvxupdate.report.open_rows import open_rows, open_sentence
from cvxupdate.report.overlay_figures import overlay_parts
from cvxupdate.report.own_errors import own_rows
from cvxupdate.report.page import command, render
from cvxupdate.report.starts_parts import starts_parts
from cvxupdate.report.words import (
    CERTIFICATE,
    METRICS,
    certificate_sentence,
    conflict_sentence,
    definite_sentence,
    verdict,
)

if TYPE_CHECKING:
    from cvxupdate.update.result import ModeResult, ParameterResult, Updated

MOST_ROWS = 300
"""Rows of a table at most; result.json holds them all."""
MOST_OPEN = 12
"""Undetermined combinations at most, and clauses that hold with equality."""

PROPERTIES = {
    "stiffness": "stiffness (p-value)",
    "mass": "mass (p-value)",
    "damping": "damping (p-value)",
    "E": "Young's modulus",
    "nu": "Poisson's ratio",
    "G": "Shear modulus",
    "rho": "density",
    "A": "area",
    "I": "second moment of area",
    "Iy": "second moment of area, y",
    "Iz": "second moment of area, z",
    "J": "torsion constant",
    "thickness": "thickness",
    "height": "height",
    "width": "width",
    "diameter": "diameter",
    "wall": "wall thickness",
    "k": "spring stiffness",
    "m": "mass",
    "c": "damper",
    "eta": "loss factor",
    "alpha": "mass-proportional damping",
    "beta": "stiffness-proportional damping",
    "Dx": "bending rigidity Dx (factor)",
    "Dy": "bending rigidity Dy (factor)",
    "D1": "coupling rigidity D1 (factor)",
    "Dxy": "twisting rigidity Dxy (factor)",
    "Ixx": "rotary inertia, x",
    "Iyy": "rotary inertia, y",
    "Izz": "rotary inertia, z",
    "generic": "entry",
}


def run_page(updated: Updated) -> str:
    """The HTML text of a report on `run`."""
    moved = updated.status != "infeasible"
    stated = updated.noise is not None
    pictures = {
        "frequencies": figures.frequencies(updated.modes, moved),
        "errors": figures.mode_errors(updated.modes, moved, stated),
        "parameters": parameter_figures.parameters(updated.parameters, moved),
        "convergence": figures.convergence(updated),
    }
    return render(
        "run.html",
        {
            "u": updated,
            "own": own_rows(updated.recordings),
            "direct": direct_rows(updated),
            "beside": direct_beside(updated),
            "classical": classical_parts(updated),
            "moved": moved,
            "verdict": verdict(updated),
            "status": updated.status,
            "figure": {key: Markup(svg) if svg else None for key, svg in pictures.items()},
            "asked": asked(updated),
            "active": clause_lines(updated.active, MOST_OPEN),
            "metrics": metric_rows(updated),
            "modes": mode_rows(updated.modes[:MOST_ROWS], stated),
            "more_modes": max(0, len(updated.modes) - MOST_ROWS),
            "bars": figures.ROWS,
            "intervals": parameter_figures.INTERVALS,
            "open": MOST_OPEN,
            "several": len({m.recording for m in updated.modes}) > 1,
            "mac": any(m.mac_before is not None for m in updated.modes),
            "parameters": [
                parameter_row(q) for q in parameter_figures.strongest(updated.parameters, MOST_ROWS)
            ],
            "more_parameters": max(0, len(updated.parameters) - MOST_ROWS),
            "history": [_history_row(h) for h in updated.history[:MOST_ROWS]],
            "certificate": [
                {"name": name, "value": _residual(updated.certificate[key]), "meaning": meaning}
                for key, name, meaning in CERTIFICATE
                if key in updated.certificate
            ],
            "certificate_says": certificate_sentence(updated),
            "definite_says": definite_sentence(updated),
            "conflict_says": conflict_sentence(updated),
            "undetermined": open_rows(updated, MOST_OPEN),
            "open_says": open_sentence(updated),
            "overlays": overlay_parts(updated, moved),
            "judged": judged_parts(updated) if moved else {},
            "minima": starts_parts(updated) if moved else {},
            "groupings": grouping_parts(updated),
            "families": family_parts(updated) if moved else [],
            "more_families": max(0, len(updated.families) - MOST_FAMILIES),
            "accuracy": accuracy_sections(updated),
            "command": command("run", updated.path),
            "time": seconds(updated.time),
        },
    )


def _history_row(h: dict[str, Any]) -> dict[str, Any]:
    return {
        "number": h["number"],
        "objective": number(h["objective"], 7),
        "ratio": number(h["ratio"], 4),
        "step": number(h["step"], 3),
        "radius": number(h["radius"], 3),
        "accepted": "accepted" if h["accepted"] else "rejected",
    }


def asked(updated: Updated) -> list[tuple[str, list[str]]]:
    """What the problem file asked for, as (term, lines)."""
    m = updated.model
    use: dict[tuple[str, str], int] = {}
    for mode in updated.modes:
        use[mode.recording, mode.use] = use.get((mode.recording, mode.use), 0) + 1
    out = [("Problem", [updated.problem, updated.path])]
    if updated.source:
        out.append(("Source", [updated.source]))
    if {"nodes", "elements", "dofs"} <= m.keys():
        sizes = (
            f"{count(m['nodes'], 'node')}, {count(m['elements'], 'element')}, "
            f"{count(m['dofs'], 'free degree', 'free degrees')} of freedom"
        )
        out.append(("Model", [sizes, *_mass(m)]))
    if use:
        out.append(
            (
                "Recordings",
                [
                    f"{name}: {count(n, 'mode')}, "
                    f"{'fitted' if u == 'fit' else 'held out: scored, never fitted'}"
                    for (name, u), n in use.items()
                ],
            )
        )
    out.append(("Method", [method_words(updated)]))
    out.append(("Parameters", [_parameter_words(updated)]))
    out.append(
        (
            "Constraints",
            [
                "bounds on each parameter, listed below"
                if any(q.lower is not None or q.upper is not None for q in updated.parameters)
                else "no bounds",
                *clause_lines([str(c) for c in m.get("clauses", ())]),
            ],
        )
    )
    for r in updated.regularisation:
        rule = f", chosen by {r['rule']}" if r.get("rule") else ""
        note = f" ({r['note']})" if r.get("note") else ""
        weight = number(r["weight"]) if not isinstance(r["weight"], str) else r["weight"]
        out.append(("Regularisation", [f"{r['kind']}, weight {weight}{rule}{note}"]))
    return out


def metric_rows(updated: Updated) -> list[dict[str, str]]:
    """The contract's metrics before and after, fitted first, then held out."""
    out = []
    for key, what in (("fit", "fitted"), ("hold_out", "held out")):
        for metric, pair in updated.fit.get(key, {}).items():
            name, unit = METRICS.get(metric, (metric, ""))
            before, after = (
                f"{fixed(v)} %" if unit == "%" else number(v)
                for v in (pair["before"], pair["after"])
            )
            out.append({"name": name, "what": what, "before": before, "after": after})
    return out


def mode_rows(modes: Sequence[ModeResult], stated: bool) -> list[dict[str, str]]:
    """Modes as text; ``stated`` says whether the recordings gave deviations. A column has the same
    decimals throughout."""
    given = min(decimals(m.measured for m in modes), 4)
    places = max(given, 2 if max((m.measured for m in modes), default=0.0) > 20.0 else 4)
    return [
        {
            "mode": str(m.model_mode_before)
            if m.model_mode_before == m.model_mode_after
            else f"{m.model_mode_before} → {m.model_mode_after}",
            "recording": m.recording,
            "use": m.use,
            "measured": with_deviation(m.measured, m.standard_deviation)
            if stated
            else fixed(m.measured, given),
            "before": fixed(m.before, places),
            "after": fixed(m.after, places),
            "error_before": signed(100 * (m.before - m.measured) / m.measured),
            "error_after": signed(100 * (m.after - m.measured) / m.measured),
            "mac_before": fixed(m.mac_before, 3),
            "mac_after": fixed(m.mac_after, 3),
        }
        for m in modes
    ]


def parameter_row(q: ParameterResult) -> dict[str, Any]:
    """One parameter as text, in SI units with a prefix where that is usual."""
    factor, unit = prefix_of(q.unit, q.before, q.after)
    deviation = None if q.standard_deviation is None else q.standard_deviation / factor
    low, high = (NOTHING if v is None else short(v / factor) for v in (q.lower, q.upper))
    if q.group is not None:
        where = f"group {q.group}" + (
            f" ({count(len(q.elements), 'element')})" if q.elements else ""
        )
    elif q.element is not None:
        where = f"element {q.element}"
    else:
        where = count(len(q.elements), "element") if q.elements else "whole model"
    note = (
        f"at its {q.bound} bound"
        if q.at_bound
        else "not determined"
        if q.standard_deviation is None
        else ""
    )
    return {
        "name": q.name,
        "of": PROPERTIES.get(q.of, q.of),
        "where": where,
        "before": short(q.before / factor),
        "after": with_deviation(q.after / factor, deviation),
        "bounds": f"{low} … {high}",
        "unit": unit or "–",
        "note": note,
    }


def _parameter_words(updated: Updated) -> str:
    names = [q.name for q in updated.parameters]
    shown = ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")
    return f"{len(names)}: {shown}" if names else "none"


def _mass(m: dict[str, Any]) -> list[str]:
    if "mass_before" not in m:
        return []
    before, after = number(m["mass_before"], 5), number(m.get("mass_after"), 5)
    return [
        f"total mass {before} kg"
        if before == after
        else f"total mass {before} kg before, {after} kg after"
    ]


def _residual(value: float | None) -> str:
    if value is None or not math.isfinite(value):
        return NOTHING
    return "0" if value == 0.0 else power(value)
