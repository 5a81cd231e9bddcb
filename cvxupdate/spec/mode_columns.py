"""Tables of modes as other programs export them: one column for each DOF, damping in per cent,
headers with units, turned into the rows of ours."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from cvxupdate.keys import DofKind
from cvxupdate.spec.tables import TableError, is_table, locate, read_table

SAME = 1e-9
"""Relative difference of numbers that are one, written twice."""
_DOF = re.compile(
    r"n?(?P<node>\d{1,9})\s*[:._ ]\s*(?P<sign>[+-]?)(?P<dof>r?[xyz])"
    r"(?P<sign2>[+-]?)(?:[\s._(]*(?P<part>re|im)(?:al|ag|aginary)?\)?)?",
    re.IGNORECASE,
)
_FREQUENCY = re.compile(
    r"(natural[ _]?)?(frequency|freq|f|fn)[ _]*[\[(]?(hz)?[\])]?", re.IGNORECASE
)
_DAMPING = re.compile(
    r"(modal[ _]?)?(damping|damp|zeta|xi|d(?=[ _]*[\[(]?%))([ _]?ratio)?"
    r"[ _]*[\[(]?(?P<percent>%|pct|percent)?[\])]?",
    re.IGNORECASE,
)
_KINDS = get_args(DofKind)
_NUMBER = ("mode", "no", "no.", "number", "#", "nr", "")
_PAIR = re.compile(r"model[ _]mode", re.IGNORECASE)


@dataclass(frozen=True)
class DofColumn:
    """A column that holds the entries of shapes at one DOF: its name, ``sign`` of the direction,
    ``part`` "" (the entry), "re" or "im"."""

    name: str
    node: int
    dof: str
    sign: int
    part: str = ""


def dof_columns(header: Sequence[str]) -> tuple[DofColumn, ...]:
    """The columns of a header that name a DOF: ``4:+X``, ``n4.x``, ``4:-RZ``, ``4:+X re``."""
    out = []
    for name in header:
        found = _DOF.fullmatch(name.strip())
        if found is None or found["dof"].lower() not in _KINDS:
            continue
        sign = -1 if "-" in (found["sign"], found["sign2"]) else 1
        part = (found["part"] or "").lower()
        out.append(DofColumn(name, int(found["node"]), found["dof"].lower(), sign, part))
    return tuple(out)


def is_mode_table(header: Sequence[str]) -> bool:
    """Whether a header has a frequency, and beside it a shape, a damping ratio or DOFs."""
    names = [name.strip() for name in header]
    beside = any(_DAMPING.fullmatch(n) or n in ("shape", "frequency_std") for n in names)
    return any(_FREQUENCY.fullmatch(n) for n in names) and (beside or bool(dof_columns(names)))


def column_of(header: Sequence[str], at: Sequence[object]) -> str:
    """The column of an entry ("shape", k) of a row that was gathered from columns of DOFs; "" where
    there are none."""
    whole = list({(c.node, c.dof): c.name for c in dof_columns(header) if c.part != "im"}.values())
    if len(at) < 2 or at[0] != "shape" or "shape" in header or not isinstance(at[1], int):
        return ""
    return whole[at[1]] if at[1] < len(whole) else ""


def gather_modes(recording: dict[str, Any], rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows with the keys of a problem file; ``recording`` gets the channels that the columns name,
    where it has none of its own.

    A column of numbers of the modes is left out beside columns of DOFs: there it counts, and fixes
    no pairing. A column ``model_mode`` does, beside whatever columns.
    """
    header = list(dict.fromkeys(key for row in rows for key in row))
    columns = dof_columns(header)
    whole = {(c.node, c.dof): c for c in columns if c.part != "im"}
    renamed = {name: _key(name, bool(columns)) for name in header}
    if columns and "shape" not in header:
        _channels(recording, list(whole.values()))
    out = []
    for row in rows:
        made: dict[str, Any] = {}
        for name, value in row.items():
            key, factor = renamed[name]
            if key and not any(c.name == name for c in columns):
                made[key] = value * factor if factor != 1.0 and _number(value) else value
        if columns and "shape" not in header and any(c.name in row for c in columns):
            made["shape"] = [_entry(row, c, columns) for c in whole.values()]
        out.append(made)
    return out


def differing(recording: dict[str, Any], base: Path) -> str:
    """Where a table of modes gives rows and names a CSV file, and they differ in more than the
    pairing: in what; empty where they agree, or where there is nothing to compare."""
    file, dataset, rows = (recording.get(k) for k in ("file", "dataset", "rows"))
    if recording.get("kind") != "modes" or not isinstance(file, str) or not is_table(file):
        return ""
    if not isinstance(rows, list) or not all(isinstance(r, dict) for r in rows):
        return ""
    path = locate(file, dataset if isinstance(dataset, str) else None, base)
    try:
        there = gather_modes({}, read_table(path)[0])
    except TableError:
        return ""
    start = f"differ from '{file}', which `file` names beside them: "
    if len(there) != len(rows):
        return f"{start}{len(rows)} here, {len(there)} there."
    for number, (row, other) in enumerate(zip(rows, there, strict=True), start=1):
        for key in sorted((row.keys() | other.keys()) - {"mode"}):
            if not _alike(row.get(key), other.get(key)):
                return (
                    f"{start}{key} of row {number} is {row.get(key)} here, {other.get(key)} there."
                )
    return ""


def _alike(one: Any, other: Any) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_alike, one, other))
    if _number(one) and _number(other):
        return math.isclose(one, other, rel_tol=SAME)
    return bool(one == other)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _key(name: str, wide: bool) -> tuple[str, float]:
    """The key of a column and the factor of its values; "" for one that is left out."""
    plain = name.strip()
    if _FREQUENCY.fullmatch(plain):
        return "frequency", 1.0
    if _PAIR.fullmatch(plain):
        return "mode", 1.0
    damping = _DAMPING.fullmatch(plain)
    if damping is not None:
        return "damping", 0.01 if damping["percent"] else 1.0
    return ("", 1.0) if wide and plain.lower() in _NUMBER else (name, 1.0)


def _entry(row: dict[str, Any], column: DofColumn, columns: Sequence[DofColumn]) -> Any:
    """What stands under a DOF; an empty cell is NaN, which the checks of rows refuse by name."""
    value = row.get(column.name, float("nan"))
    if not column.part:
        return value
    imaginary = next(
        (c for c in columns if (c.node, c.dof, c.part) == (column.node, column.dof, "im")), None
    )
    return [value, 0.0 if imaginary is None else row.get(imaginary.name, float("nan"))]


def _channels(recording: dict[str, Any], columns: Sequence[DofColumn]) -> None:
    """Channels as the columns name them; those that the file declares by the names of columns get
    their places."""
    own = recording.get("channels")
    if own is None:
        quantity = recording.get("response", "displacement")
        nodes = recording.get("node_map")
        nodes = nodes if isinstance(nodes, dict) else {}
        recording["channels"] = [
            {
                "column": place,
                "quantity": quantity,
                "node": nodes.get(str(c.node), c.node),
                "dof": c.dof,
                **({"sign": -1} if c.sign < 0 else {}),
            }
            for place, c in enumerate(columns)
        ]
        recording.pop("node_map", None)
        return
    places = {c.name: place for place, c in enumerate(columns)}
    for row in own if isinstance(own, list) else ():
        if isinstance(row, dict) and row.get("column") in places:
            row["column"] = places[row["column"]]
