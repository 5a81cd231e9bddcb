"""The page of `correlate`: how far model and recordings agree, mode by mode, place by place, line
by line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report import correlate_figures as figures
from cvxupdate.report import structure
from cvxupdate.report.correlate_words import balance_sentence, compared_verdict
from cvxupdate.report.numbers import count, decimals, fixed, number, seconds, signed, with_deviation
from cvxupdate.report.page import command, render
from cvxupdate.report.words import METRICS

if TYPE_CHECKING:
    from cvxupdate.correlate.result import (
        Compared,
        FrfComparison,
        ModePair,
        SensorReport,
        ShapeComparison,
    )

MOST_ROWS = 300
"""Rows of a table at most; result.json holds them all."""
MOST_PARTS = 12
"""Recordings of one kind that are shown in full."""
MAPS = 3
"""FDAC maps of a recording at most."""
BY = {"file": "problem file", "shape": "MAC", "frequency": "frequency"}


def correlate_page(compared: Compared) -> str:
    """The HTML text of a report on `correlate`."""
    return render(
        "correlate.html",
        {
            "c": compared,
            "verdict": compared_verdict(compared),
            "asked": asked(compared),
            "metrics": metric_rows(compared),
            "modes": mode_rows(compared.modes[:MOST_ROWS]),
            "more_modes": max(0, len(compared.modes) - MOST_ROWS),
            "bars": figures.ROWS,
            "several": len({m.recording for m in compared.modes}) > 1,
            "mac": any(m.mac is not None for m in compared.modes),
            "figure": {
                "errors": _svg(figures.errors(compared.modes)),
                "frequencies": _svg(figures.frequencies(compared.modes)),
            },
            "nominal": _svg(structure.nominal_panels("nominal", compared)),
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


def shape_part(k: int, s: ShapeComparison, c: Compared) -> dict[str, Any]:
    """The figures and sentences of one table of modes with shapes."""
    found, name = s.correlation, f"s{k}"
    own = [f"{n + 1}: {number(float(f), 4)}" for n, f in enumerate(s.model_frequency)]
    theirs = [number(float(f), 4) for f in s.measured_frequency]
    pairs = [
        (int(a), int(x)) for a, x in zip(found.pairing.model, found.pairing.measured, strict=True)
    ]
    paired = [f"{number(float(found.frequency_measured[i]), 4)}" for i in found.complete]
    cross = found.cross_orthogonality
    drawing = c.drawing if structure.drawable(c.drawing) else None
    e = found.element_balance
    where = drawing is not None and e is not None
    return {
        "recording": s.recording,
        "use": s.use,
        "expansion": s.expansion,
        "sensors": len(s.labels),
        "balance_says": balance_sentence(s),
        "balance_by": s.balance_by,
        "mac": _svg(
            figures.matrix(
                f"{name}mac",
                "MAC of every model mode with every measured mode",
                found.mac,
                own,
                theirs,
                ("model mode (Hz)", "measured mode (Hz)"),
                pairs,
            )
        ),
        "cross": None
        if cross is None
        else _svg(
            figures.matrix(
                f"{name}cross",
                "Cross-orthogonality of paired modes",
                cross,
                paired,
                paired,
                ("model mode, by its pair (Hz)", "measured mode (Hz)"),
            )
        ),
        "cross_says": "" if cross is None else _cross_words(np.asarray(cross)),
        "lines": _svg(figures.shape_lines(f"{name}lines", s)),
        "shapes": None
        if drawing is None
        else _svg(structure.shape_panels(f"{name}shapes", drawing, s)),
        "comac": _svg(
            structure.comac_picture(f"{name}comac", drawing, s)
            if drawing is not None
            else figures.comac_bars(f"{name}comac", s)
        ),
        "drawn": drawing is not None,
        "worst": _worst(s),
        "balance": _svg(
            structure.balance_picture(
                f"{name}balance", drawing, s.element_ids, e.stiffness, e.stiffness_change
            )
        )
        if where and drawing and e
        else None
        if s.groups is None
        else _svg(
            figures.group_bars(
                f"{name}balance", s.group_names, s.groups.stiffness, s.groups.stiffness_change
            )
        ),
        "by": "element" if where else "group",
        "rows": balance_rows(s),
    }


def balance_rows(s: ShapeComparison) -> list[dict[str, str]]:
    """The ten elements or groups that explain most, by stiffness and by mass."""
    b = s.correlation.element_balance or s.groups
    if b is None:
        return []
    names = (
        [f"e{i}" for i in s.element_ids.tolist()]
        if s.correlation.element_balance is not None
        else list(s.group_names)
    )
    mass = b.mass if b.mass is not None else np.zeros(len(b.stiffness))
    change = b.mass_change if b.mass_change is not None else np.zeros(len(b.stiffness))
    energy = s.correlation.element_energy
    order = np.argsort(-np.maximum(b.stiffness, mass), kind="stable")[:10]
    return [
        {
            "name": names[i],
            "stiffness": f"{fixed(100 * float(b.stiffness[i]), 1)} %",
            "change": f"{signed(100 * float(b.stiffness_change[i]), 0)} %",
            "mass": f"{fixed(100 * float(mass[i]), 1)} %",
            "mass_change": f"{signed(100 * float(change[i]), 0)} %",
            "energy": "–" if energy is None else fixed(float(energy[i]), 3),
        }
        for i in order.tolist()
    ]


def frf_part(k: int, f: FrfComparison) -> dict[str, Any]:
    """The figures and the table of one recording of frequency responses."""
    name, rows = f"f{k}", []
    for j, b in enumerate(f.references):
        for i, a in enumerate(f.responses):
            frac, error = float(f.correlation.frac[i, j]), float(f.correlation.error[i, j])
            rows.append(
                {"response": a, "reference": b, "frac": fixed(frac, 3), "error": number(error, 3)}
            )
    maps = [
        _svg(figures.fdac_map(f"{name}fdac{j}", f, j)) for j in range(min(len(f.references), MAPS))
    ]
    return {
        "recording": f.recording,
        "use": f.use,
        "how": f.origin_of,
        "error": number(f.correlation.total, 3),
        "overlays": _svg(figures.overlays(f"{name}over", f)),
        "shown": len(figures.chosen(f)),
        "all": len(rows),
        "maps": [(b, m) for b, m in zip(f.references, maps, strict=False) if m],
        "rows": rows[:MOST_ROWS] if len(rows) > 1 else [],
        "band": f.variance is not None,
    }


def sensor_part(k: int, s: SensorReport) -> dict[str, Any]:
    """What one set of sensors sees."""
    return {
        "recordings": ", ".join(s.recordings[:4])
        + (f" and {len(s.recordings) - 4} more" if len(s.recordings) > 4 else ""),
        "says": s.says,
        "figure": _svg(figures.visibility(f"v{k}", s)),
        "labels": ", ".join(s.labels[:80]) + (" …" if len(s.labels) > 80 else ""),
        "rows": [
            {
                "mode": str(n + 1),
                "frequency": number(float(f), 4),
                "peak": f"{fixed(100 * float(p), 0)} %",
                "independence": fixed(float(i), 2),
            }
            for n, (f, p, i) in enumerate(zip(s.frequency, s.peak, s.independence, strict=True))
        ],
        "better": better_sentence(s),
    }


def better_sentence(s: SensorReport) -> str:
    """What as many sensors elsewhere would give, where that is worth saying."""
    if s.better_condition is None or not s.condition > 1.2 * s.better_condition:
        return ""
    kept = set(s.labels)
    moved = [b for b in s.better if b not in kept]
    names = ", ".join(moved[:12]) + (f" and {len(moved) - 12} more" if len(moved) > 12 else "")
    return (
        "As many sensors chosen by QR with pivoting would have the condition number "
        f"{number(s.better_condition, 3)} instead of {number(s.condition, 3)}; "
        f"{count(len(moved), 'place')} would change, to {names}."
    )


def _worst(s: ShapeComparison) -> str:
    values = np.asarray(s.correlation.comac)
    order = [
        int(i)
        for i in np.argsort(np.where(np.isfinite(values), values, 2.0))[:4]
        if np.isfinite(values[i])
    ]
    return ", ".join(f"{s.labels[i]} {fixed(float(values[i]), 2)}" for i in order)


def _cross_words(cross: Any) -> str:
    own = np.diag(cross)
    off = cross - np.diag(own)
    text = f"Diagonal {fixed(float(own.min()))} to {fixed(float(own.max()))}"
    return text + (
        f", largest off the diagonal {fixed(float(off.max()))}." if len(own) > 1 else "."
    )


def _least(frac: Any) -> str:
    good = np.asarray(frac)[np.isfinite(frac)]
    return fixed(float(good.min())) if good.size else "–"


def _held(use: str) -> str:
    return "" if use == "fit" else ", held out"


def _svg(text: str | None) -> Markup | None:
    return Markup(text) if text else None
