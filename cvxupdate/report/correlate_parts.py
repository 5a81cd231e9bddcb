"""The parts of the page of `correlate`: shapes, frequency responses, sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report import correlate_figures as figures
from cvxupdate.report import frf_figures, structure
from cvxupdate.report import structure_figures as on_structure
from cvxupdate.report.correlate_words import balance_sentence
from cvxupdate.report.matrix import matrix
from cvxupdate.report.numbers import count, fixed, number, signed
from cvxupdate.report.orthogonality_rows import orthogonality_rows, static_sentence

if TYPE_CHECKING:
    from cvxupdate.correlate.result import (
        Compared,
        FrfComparison,
        Geometry,
        SensorReport,
        ShapeComparison,
    )

MOST_ROWS = 300
"""Rows of a table at most; result.json holds them all."""
MAPS = 3
"""FDAC maps of a recording at most."""


def svg(text: str | None) -> Markup | None:
    """Text of a figure as it may stand in a page."""
    return Markup(text) if text else None


def shape_part(k: int, s: ShapeComparison, c: Compared) -> dict[str, Any]:
    """The figures and sentences of one table of modes with shapes."""
    name = f"s{k}"
    cross = s.correlation.cross_orthogonality
    geometry = c.geometry if structure.drawable(c.geometry) else None
    where = geometry is not None and s.correlation.element_balance is not None
    return {
        "recording": s.recording,
        "use": s.use,
        "expansion": s.expansion,
        "sensors": len(s.labels),
        "balance_says": balance_sentence(s),
        "balance_by": s.balance_by,
        "mac": _mac(name, s),
        "cross": None if cross is None else _cross(name, s, cross),
        "checks": orthogonality_rows(s),
        "static_says": static_sentence(s),
        "cross_says": "" if cross is None else _cross_sentence(np.asarray(cross)),
        "lines": svg(figures.shape_lines(f"{name}lines", s)),
        "shapes": None
        if geometry is None
        else svg(on_structure.shape_panels(f"{name}shapes", geometry, s)),
        "comac": svg(
            on_structure.comac_picture(f"{name}comac", geometry, s)
            if geometry is not None
            else figures.comac_bars(f"{name}comac", s)
        ),
        "drawn": geometry is not None,
        "worst": _worst(s),
        "balance": _balance(name, s, geometry),
        "by": "element" if where else "group",
        "rows": balance_rows(s),
    }


def _mac(name: str, s: ShapeComparison) -> Markup | None:
    found = s.correlation
    return svg(
        matrix(
            f"{name}mac",
            "MAC of every model mode with every measured mode",
            found.mac,
            [f"{n + 1}: {number(float(f), 4)}" for n, f in enumerate(s.model_frequency)],
            [number(float(f), 4) for f in s.measured_frequency],
            ("model mode (Hz)", "measured mode (Hz)"),
            [
                (int(a), int(x))
                for a, x in zip(found.pairing.model, found.pairing.measured, strict=True)
            ],
        )
    )


def _cross(name: str, s: ShapeComparison, cross: Any) -> Markup | None:
    found = s.correlation
    paired = [f"{number(float(found.frequency_measured[i]), 4)}" for i in found.complete]
    return svg(
        matrix(
            f"{name}cross",
            "Cross-orthogonality of paired modes",
            cross,
            paired,
            paired,
            ("model mode, by its pair (Hz)", "measured mode (Hz)"),
        )
    )


def _balance(name: str, s: ShapeComparison, geometry: Geometry | None) -> Markup | None:
    """The force balance by element on the structure, else by group."""
    e = s.correlation.element_balance
    if geometry is not None and e is not None:
        return svg(
            on_structure.balance_picture(
                f"{name}balance", geometry, s.element_ids, e.stiffness, e.stiffness_change
            )
        )
    if s.groups is None:
        return None
    return svg(
        figures.group_bars(
            f"{name}balance", s.group_names, s.groups.stiffness, s.groups.stiffness_change
        )
    )


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
        svg(frf_figures.fdac_map(f"{name}fdac{j}", f, j))
        for j in range(min(len(f.references), MAPS))
    ]
    return {
        "recording": f.recording,
        "use": f.use,
        "how": f.origin_of,
        "error": number(f.correlation.total, 3),
        "overlays": svg(frf_figures.overlays(f"{name}over", f)),
        "shown": len(frf_figures.chosen(f)),
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
        "figure": svg(figures.visibility(f"v{k}", s)),
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


def _cross_sentence(cross: Any) -> str:
    own = np.diag(cross)
    off = cross - np.diag(own)
    text = f"Diagonal {fixed(float(own.min()))} to {fixed(float(own.max()))}"
    return text + (
        f", largest off the diagonal {fixed(float(off.max()))}." if len(own) > 1 else "."
    )
