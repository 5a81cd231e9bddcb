"""Structure A and Structure B (chapter 9) diagnosed from their tables, and held to what is
known of them. Part of ``make proof``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

PROBLEMS = Path(__file__).resolve().parents[1] / "problems"
PLATES = ("structure_a", "structure_b")


def strips(elements: Sequence[int], truth: Mapping[str, Any]) -> tuple[bool, bool]:
    """Whether a set of plate elements holds both middle strips from edge to edge and little else;
    and whether each strip is off by one element at most.

    Elements are numbered row by row. A strip may be one or two elements wide.
    """
    n = int(truth["columns"])
    cells = {((e - 1) % n + 1, (e - 1) // n + 1) for e in elements}
    rows = {y for _, y in cells if all((x, y) in cells for x in range(1, n + 1))}
    height = max((y for _, y in cells), default=0)
    columns = {x for x, _ in cells if all((x, y) in cells for y in range(1, height + 1))}
    cross = {c for c in cells if c[1] in rows or c[0] in columns}
    whole = bool(rows) and bool(columns) and cross == cells and len(rows) <= 2 and len(columns) <= 2
    exact = whole and rows <= set(truth["along"]) and columns <= set(truth["across"])
    near = (
        whole
        and all(min(abs(y - t) for t in truth["along"]) <= 1 for y in rows)
        and all(min(abs(x - t) for t in truth["across"]) <= 1 for x in columns)
    )
    return exact, near


def judge(said: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    """Words, place, number of parameters and the mean error of the frequencies, each right or
    not."""
    findings = said["findings"]
    named = [f["physics"] for f in findings]
    mean = said.get("metrics", {}).get("fit", {}).get("frequency_error_percent_mean", {})
    held = said.get("metrics", {}).get("hold_out", {}).get("frequency_error_percent_mean", {})
    count = sum(len(f["parameters"]) for f in findings if "damping" not in f["physics"])
    words = (
        bool(named)
        and set(named) <= set(truth["words"])
        and all(any(w in named for w in choice) for choice in truth["needed"])
    )
    place: bool | None = None
    note = ""
    if "across" in truth:
        own = [
            strips(f["location"]["elements"], truth) for f in findings if f["location"]["elements"]
        ]
        rivals = [
            strips(e["location"]["elements"], truth)
            for f in findings
            for e in f["equivalent"]
            if e["location"]["elements"]
        ]
        place = any(exact for exact, _ in own + rivals)
        if not any(exact for exact, _ in own) and any(near for _, near in own):
            note = "a cross, one strip one element beside the middle" + (
                "; the middle one is among the equivalents" if place else ""
            )
    after = mean.get("after")
    enough = (
        after is not None and after <= truth["mean_percent"] and 0 < count <= truth["parameters"]
    )
    return {
        "verdict": said["verdict"],
        "says": said["says"],
        "words": words,
        "place": place,
        "note": note,
        "parameters": count,
        "enough": enough,
        "before": mean.get("before"),
        "after": after,
        "limit": truth["mean_percent"],
        "held_before": held.get("before"),
        "held_after": held.get("after"),
        "equivalent": [e["physics"] for f in findings for e in f["equivalent"]],
        "time": said.get("time"),
        "right": words and enough and place is not False,
    }


def truth_of(name: str) -> dict[str, Any]:
    """The truth of a plate, opened after the diagnosis."""
    return tomllib.loads((PROBLEMS / name / "truth.toml").read_text(encoding="utf-8"))
