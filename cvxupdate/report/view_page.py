"""The page, the files and the terminal summary of `view`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from markupsafe import Markup

from cvxupdate.report.as_json import dumps, plain
from cvxupdate.report.correlate_parts import svg
from cvxupdate.report.diagnosis_place import _axes, draw_measured, size_words
from cvxupdate.report.diagnosis_places import draw_numbers, draw_supports, sketch_of, sketch_view
from cvxupdate.report.moving import moving_pair
from cvxupdate.report.numbers import count, number, seconds
from cvxupdate.report.page import command, render
from cvxupdate.report.structure import WIDTH, _bare, _height, skeleton
from cvxupdate.report.svg import draw
from cvxupdate.report.words import Verdict

if TYPE_CHECKING:
    from rich.console import RenderableType

    from cvxupdate.commands.view import Viewed
    from cvxupdate.correlate.result import Geometry

DRAWN = 12
"""Shapes that move on the page: each is a picture of every element in twelve phases."""


def view_files(found: Viewed) -> tuple[dict[str, str], str]:
    """Files by name, and the JSON text by itself."""
    text = dumps(plain(view_data(found)))
    return {"result.json": text, "report.html": view_page(found)}, text


def view_data(found: Viewed) -> dict[str, Any]:
    """Everything but shapes, as plain data."""
    return {
        "problem": found.spec.name,
        "status": "incomplete" if found.faults else "shown",
        "method": "view",
        "time": found.time,
        "title": found.spec.title,
        "path": found.spec.shown,
        **found.counts,
        "mass": found.mass,
        "extent": found.extent,
        "rigid": found.rigid,
        "frequencies": found.frequencies,
        "sensors": found.sensors,
        "forces": found.forces,
        "faults": found.faults,
        "notes": found.notes,
    }


def view_page(found: Viewed) -> str:
    """The HTML text of a report on `view`."""
    spec = found.spec
    return render(
        "view.html",
        {
            "title": spec.title or spec.name,
            "source": spec.source,
            "verdict": view_verdict(found),
            "notes": found.notes,
            "structure": svg(structure_picture(found)),
            "size": size_words(spec),
            "sensors": found.sensors,
            "forces": found.forces,
            "supports": _support_rows(found),
            "blocks": _block_rows(found),
            "modes": [(str(k), number(f, 5)) for k, f in enumerate(found.frequencies, start=1)],
            "moving": _moving(found),
            "command": command("view", spec.shown),
            "time": seconds(found.time),
        },
    )


def view_verdict(found: Viewed) -> Verdict:
    """What there is, in a line, and what could not be shown."""
    c = found.counts
    parts = [count(c["nodes"], "node"), count(c["elements"], "element")]
    parts.append(count(c["free DOFs"], "free DOF"))
    if found.mass is not None:
        parts.append(f"{number(found.mass, 4)} kg")
    says = list(found.faults)
    if found.frequencies:
        listed = ", ".join(number(f, 4) for f in found.frequencies[:6])
        says.append(f"First natural frequencies: {listed} Hz.")
    return Verdict("bad" if found.faults else "good", f"{', '.join(parts)}.", tuple(says))


def structure_picture(found: Viewed) -> str | None:
    """The structure with its supports, sensors and forces; None where there is nothing, or too
    much, to draw."""
    sketch = sketch_of(found.spec)
    if sketch is None or np.ptp(sketch.xyz, axis=0).max(initial=0.0) == 0.0:
        return None
    drawing = cast("Geometry", sketch)  # the same fields, made from the problem file alone
    view = sketch_view(sketch)
    flat = view.project(sketch.xyz)

    def paint(ax: Any) -> None:
        skeleton(ax, drawing, view)
        draw_supports(ax, sketch, flat)
        draw_numbers(ax, sketch, flat)
        draw_measured(ax, sketch, view, found.sensors, found.forces)
        _bare(ax, view)
        ax.margins(0.12)
        _axes(ax, view)

    says = "The structure with its supports, sensors and forces"
    return draw("structure", says, WIDTH, max(1.7, _height(view, drawing)), paint)


def _moving(found: Viewed) -> list[tuple[str, Markup]]:
    """(caption, picture) of the first modes."""
    if found.geometry is None:
        return []
    out = []
    pairs = zip(found.frequencies[:DRAWN], found.shapes, strict=False)
    for k, (f, shape) in enumerate(pairs, start=1):
        drawn = moving_pair(found.geometry, None, shape, (), f"Mode {k}, moving")
        if drawn is not None:
            out.append((f"Mode {k}: {number(f, 4)} Hz", Markup(drawn)))
    return out


def _support_rows(found: Viewed) -> list[tuple[str, str]]:
    return [
        (
            "all" if s.nodes == "all" else ", ".join(map(str, s.nodes)),
            ", ".join(k for k in s.dofs if k in found.spec.model.dofs) or "none of the model's",
        )
        for s in found.spec.model.supports
    ]


def _block_rows(found: Viewed) -> list[tuple[str, str, str]]:
    """(type, elements, groups) of each block."""
    out = []
    for block in found.spec.model.elements:
        groups = dict.fromkeys(row.group for row in block.rows if row.group is not None)
        listed = ", ".join(list(groups)[:8]) + (" …" if len(groups) > 8 else "")
        out.append((block.type, str(len(block.rows)), listed))
    return out


def view_text(found: Viewed, folder: Path) -> RenderableType:
    """What `view` prints on a terminal."""
    from rich.console import Group
    from rich.text import Text

    from cvxupdate.report.summary import TONES

    says = view_verdict(found)
    return Group(
        Text(found.spec.title or found.spec.name, style="bold"),
        Text(says.headline, style=TONES[says.tone]),
        *(Text(line) for line in says.sentences),
        *(Text(f"{note}.", style="dim") for note in found.notes),
        Text(f"result.json, report.html: {folder}"),
    )
