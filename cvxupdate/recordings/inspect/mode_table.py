"""Inspection of a table of modes: our own, or one column for each DOF."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

from cvxupdate.recordings.inspect.block import recordings_block
from cvxupdate.recordings.inspect.result import Inspection
from cvxupdate.spec.mode_columns import dof_columns, gather_modes, is_mode_table
from cvxupdate.spec.tables import TableError, read_table

PLACEHOLDERS = (
    "channels = [   # the file does not say where the shapes were measured: nodes and directions "
    "are placeholders, correct them"
)
_LONGEST = 2_000_000  # bytes of a table of modes; what is longer is no such table


def mode_table_of(path: Path) -> Inspection | None:
    """A .csv file of modes as found; None for any other."""
    if path.suffix.lower() != ".csv" or not 0 < path.stat().st_size < _LONGEST:
        return None
    try:
        rows, _ = read_table(path)
    except TableError:
        return None
    header = list(dict.fromkeys(key for row in rows for key in row))
    if not rows or not is_mode_table(header) or _is_spectrum(header, rows):
        return None
    recording: dict[str, Any] = {}
    modes = gather_modes(recording, rows)
    lines, notes = [], []
    if any("shape" in m for m in modes) and "channels" not in recording:
        first = next(m["shape"] for m in modes if "shape" in m)
        entries = len(first) if isinstance(first, list) else 1
        rows_ = [
            f'  {{ column = {k}, quantity = "displacement", node = {k + 1}, dof = "z" }},'
            for k in range(entries)
        ]
        lines = [PLACEHOLDERS, *rows_, "]"]
    elif recording.get("channels"):
        places = ", ".join(
            f"n{c['node']}.{'-' if c.get('sign') == -1 else ''}{c['dof']}"
            for c in recording["channels"]
        )
        notes.append(f"shapes at {places}, as the columns name them; node_map renames nodes")
    frequencies = ", ".join(f"{m['frequency']:.5g}" for m in modes[:12] if "frequency" in m)
    notes.insert(0, f"modes at {frequencies} Hz{' and more' if len(modes) > 12 else ''}")
    return Inspection(
        str(path),
        "text",
        "modes",
        float("nan"),
        len(modes),
        (),
        (),
        tuple(notes),
        recordings_block(path, "modes", lines),
    )


def _is_spectrum(header: list[str], rows: list[dict[str, Any]]) -> bool:
    """Whether the frequencies are evenly spaced lines of FRFs at the DOFs of the columns."""
    if not dof_columns(header) or "shape" in header or len(rows) < 16:
        return False
    first = header[0]
    values = [row.get(first) for row in rows[:16]]
    numbers = [v for v in values if isinstance(v, int | float)]
    steps = [b - a for a, b in itertools.pairwise(numbers)]
    return len(steps) == 15 and max(steps) - min(steps) <= 1e-3 * abs(max(steps))
