"""The page and the terminal summary of `identify`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from cvxupdate.report import identify_figures as figures
from cvxupdate.report.correlate_parts import svg
from cvxupdate.report.identify_table import block, damping_block, measured_damping_files
from cvxupdate.report.moving import Motion, moving_shape
from cvxupdate.report.numbers import NOTHING, count, fixed, number, seconds, with_deviation
from cvxupdate.report.page import command, render
from cvxupdate.report.words import Verdict

if TYPE_CHECKING:
    from rich.console import RenderableType

    from cvxupdate.commands.identified import Identified, ModeSetResult

DRAWN = 12
"""Shapes that move on a page, at most: each is a picture of every element in twelve phases."""
KINDS = ("x", "y", "z")
HOW = {
    "plscf": "poles by the poly-reference least-squares complex frequency-domain estimator "
    "(pLSCF), then maximum likelihood",
    "realisation": "poles by the eigensystem realisation algorithm, shapes by least squares",
    "ibrahim": "poles by Ibrahim's time-domain method (2.18 to 2.21), shapes by least squares",
    "appropriation": "appropriated forces (2.35 to 2.44)",
    "table": "as the table has them",
    "ssi": "covariance-driven stochastic subspace identification: responses alone",
}


def identify_page(found: Identified) -> str:
    """The HTML text of a report on `identify`."""
    verb = f"identify {found.options}".strip()
    return render(
        "identify.html",
        {
            "f": found,
            "verdict": identified_verdict(found),
            "sets": [_part(k, s, found) for k, s in enumerate(found.sets)],
            "several": len(found.sets) > 1,
            "command": command(verb, found.path),
            "time": seconds(found.time),
        },
    )


def identified_verdict(found: Identified) -> Verdict:
    """What came of it, in a line, and what to mind."""
    modes = [m for s in found.sets for m in s.modes]
    total = count(len(modes), "mode")
    where = "" if len(found.sets) == 1 else f" in {len(found.sets)} recordings"
    f = [m.frequency for m in modes]
    says = [f"from {number(min(f), 4)} to {number(max(f), 4)} Hz"] if f else []
    worst = [s for s in found.sets if s.fit is not None and s.fit.rest > 0.3]
    minds = [
        f"{s.recording}: the modes leave {fixed(100 * s.fit.rest, 0)} % of the measured responses "
        "unexplained. Look at the figure: noise, a band that is too wide, or what is not linear."
        for s in worst
        if s.fit is not None
    ]
    minds += [line for line in found.skipped]
    tone = "fair" if worst or found.skipped else "good"
    return Verdict(tone, f"{total}{where}, {' '.join(says)}.", tuple(minds))


def _part(k: int, s: ModeSetResult, found: Identified) -> dict[str, Any]:
    name = f"i{k}"
    return {
        "s": s,
        "how": HOW.get(s.method, s.method),
        "band": f"{number(s.band[0], 4)} to {number(s.band[1], 4)} Hz",
        "rows": mode_rows(s),
        "purity": any(np.isfinite(m.purity) for m in s.modes),
        "damped": any(np.isfinite(m.damping) for m in s.modes),
        "shapes_known": len(s.labels) > 1,
        "diagram": svg(figures.diagram(f"{name}d", s)),
        "synthesis": None if s.fit is None else svg(figures.synthesised(f"{name}f", s.fit)),
        "rest": "" if s.fit is None else f"{fixed(100 * s.fit.rest)} %",
        "mac": svg(figures.auto_mac(f"{name}m", s)),
        "alike": _alike(s),
        "damping": svg(figures.damping(f"{name}z", s)),
        "law": "" if s.laws is None else s.laws.says,
        "moving": _moving(s, found),
        "normal": [_normal(s, n) for n in s.normal],
        "block": block(s),
        "damping_block": damping_block(s),
        "measured": next(iter(measured_damping_files(s).items()), None),
    }


def mode_rows(s: ModeSetResult) -> list[dict[str, str]]:
    """The table of modes as text."""
    return [
        {
            "number": str(k),
            "frequency": with_deviation(m.frequency, _or_none(m.frequency_std)),
            "damping": "–"
            if not np.isfinite(m.damping)
            else f"{with_deviation(100 * m.damping, _or_none(100 * m.damping_std), 3)} %",
            "mpc": fixed(m.mpc, 3),
            "mpd": "–" if not np.isfinite(m.mpd) else f"{fixed(m.mpd, 1)}°",
            "purity": fixed(m.purity, 3),
        }
        for k, m in enumerate(s.modes, start=1)
    ]


def _or_none(value: float) -> float | None:
    return value if np.isfinite(value) and value > 0.0 else None


def _alike(s: ModeSetResult) -> str:
    """Pairs of modes whose shapes these sensors cannot tell from one another."""
    v = np.asarray(s.auto_mac)
    pairs = [(i, j) for i in range(len(v)) for j in range(i + 1, len(v)) if v[i, j] > 0.9]
    if not pairs or len(s.labels) < 2:
        return ""
    named = [
        f"{number(s.modes[i].frequency, 4)} and {number(s.modes[j].frequency, 4)} Hz"
        for i, j in pairs[:6]
    ]
    return (
        f"Alike at these sensors (MAC above 0.9): {'; '.join(named)}. Either there are too few "
        "sensors to tell them apart, or one mode was found twice."
    )


def _moving(s: ModeSetResult, found: Identified) -> list[tuple[str, Markup]]:
    """The first modes on the structure; none without a model or with fewer than two places."""
    geometry = found.geometry
    if geometry is None:
        return []
    at = {int(n): k for k, n in enumerate(geometry.node_ids)}
    seen = [
        k
        for k, (n, d) in enumerate(zip(s.nodes, s.dofs, strict=True))
        if d in KINDS and n in at and "(" not in s.labels[k]
    ]
    if len(seen) < 2:
        return []
    out = []
    for k, m in enumerate(s.modes[:DRAWN]):
        motion = Motion(
            tuple(at[s.nodes[i]] for i in seen),
            tuple(KINDS.index(s.dofs[i]) for i in seen),
            np.asarray(s.shapes[k][seen]),
        )
        says = f"Mode {k + 1} at {number(m.frequency)} Hz, moving"
        drawn = moving_shape(geometry, motion, says)
        if drawn is not None:
            out.append((f"mode {k + 1}: {number(m.frequency)} Hz", Markup(drawn)))
    return out


def _normal(s: ModeSetResult, n: Any) -> dict[str, Any]:
    rows = [
        {
            "number": str(k),
            "complex": number(m.frequency, 5),
            "normal": number(float(f), 5),
            "mac": fixed(float(c), 4),
        }
        for k, (m, f, c) in enumerate(zip(s.modes, n.frequency, n.mac, strict=True), start=1)
    ]
    known = np.isfinite(n.frequency)
    moved = np.abs(n.frequency[known] / s.frequency[known] - 1.0)
    return {
        "found": str(int(np.count_nonzero(known))),
        "shift": f"{number(100.0 * float(moved.max()), 3)} %" if moved.size else NOTHING,
        "least": fixed(float(n.mac[known].min()), 4) if moved.size else NOTHING,
        "name": n.route,
        "says": n.says,
        "rows": rows,
        "equations": n.equations,
        "assumes": n.assumes,
        "fails": n.fails,
    }


NAMES = {
    "plscf": "poly-reference least squares (plscf)",
    "realisation": "eigensystem realisation",
    "ibrahim": "Ibrahim's time-domain method",
    "appropriation": "force appropriation",
    "ssi": "stochastic subspaces (ssi)",
}
"""The methods in words."""


def identify_text(found: Identified, folder: Path) -> RenderableType:
    """What `identify` prints on a terminal."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from cvxupdate.report.summary import TONES

    says = identified_verdict(found)
    parts: list[RenderableType] = [
        Text(f"Modes identified from {found.title or found.problem}", style="bold"),
        Text(says.headline, style=TONES[says.tone]),
        *(Text(line) for line in says.sentences),
    ]
    for s in found.sets:
        table = Table(
            title=f"{s.recording}, by {NAMES.get(s.method, s.method)}",
            title_justify="left",
            box=None,
        )
        for head in ("", "frequency (Hz)", "damping", "MPC", "MPD"):
            table.add_column(head, justify="right")
        for row in mode_rows(s):
            table.add_row(*(row[k] for k in ("number", "frequency", "damping", "mpc", "mpd")))
        parts.append(table)
        parts += [Text(f"  {note}", style="dim") for note in s.notes]
        for n in s.normal:
            means = np.nanmean(n.mac) if np.any(np.isfinite(n.mac)) else float("nan")
            said = n.says or f"mean MAC with the complex shapes {fixed(float(means), 4)}"
            parts.append(Text(f"  normal modes by {n.route}: {said}"))
    parts += [Text(note, style="dim") for note in found.notes]
    parts.append(Text(f"{found.sets[0].file}, recordings.toml, report.html: {folder}"))
    return Group(*parts)
