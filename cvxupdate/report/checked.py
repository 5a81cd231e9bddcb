"""What ``check`` prints of a problem without faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cvxupdate.report.numbers import count

REFERENCE = "reference"
"""The state that the model describes, as problem files have it."""
MOST = 12
"""Nodes, sets of held DOFs, and channels that are listed."""
MOST_RECORDINGS = 6
COUNTS = ("node", "element", "free DOF", "recording", "parameter")


def check_lines(problem: str, summary: Mapping[str, Any]) -> list[str]:
    """Counts, then what its author can judge at a glance (mass, extent, first natural frequencies,
    what is held and what moves free), then the warnings."""
    warnings = summary["warnings"]
    counts = ", ".join(count(summary[f"{k}s"], k) for k in COUNTS)
    how = "in order" if not warnings else f"no faults, but {count(len(warnings), 'warning')}"
    return [
        f"{problem}: {how}. {counts}.",
        f"{_size(summary)}.",
        *_held("Held", summary["held"]),
        *_held("Moved as recorded", summary["moved"]),
        *_states(summary["states"]),
        *_recorded(summary["recorded"]),
        *(f"{says}." for says in summary["free"]),
        *(f"Warning: {w['says']}" for w in warnings),
    ]


def _size(summary: Mapping[str, Any]) -> str:
    mass, extent, f = summary["mass"], summary["extent"], summary["frequencies"]
    parts = [] if mass is None else [f"total mass {mass:.4g} kg"]
    turning = [f"{v:.4g} kg·m² ({kind})" for kind, v in summary["inertia"].items()]
    if turning:
        parts = [f"total inertia {', '.join(turning)}"]
    if max(extent, default=0.0) > 0.0:
        parts.append(f"extent {_joined(extent, ' × ')} m")
    if f:
        parts.append(f"first natural frequencies {_joined(f, ', ')} Hz")
    line = ", ".join(parts) or "no mass, no extent"
    return line[:1].upper() + line[1:]


def _states(states: Mapping[str, int]) -> list[str]:
    """How many recordings are of which state, and which of them the model describes."""
    if not states:
        return []
    parts = [f"{name or 'none named'} ({count(n, 'recording')})" for name, n in states.items()]
    what = "" if REFERENCE in states else f'; none is "{REFERENCE}", which the model describes'
    return [f"States of the structure: {', '.join(parts)}{what}."]


def _recorded(recorded: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line of each of the first recordings: what it holds, and at which DOFs."""
    lines = []
    for r in recorded[:MOST_RECORDINGS]:
        parts = [f"{k} at {_listed(v)}" for k, v in r["channels"].items()]
        held = "" if r["use"] == "fit" else ", held out"
        by = " " if any(k.startswith("per ") for k in r["channels"]) else "; "
        at = f": {by.join(parts)}" if parts else ""
        lines.append(f"{r['name']}{held}: {r['holds']}{at}.")
    more = len(recorded) - MOST_RECORDINGS
    return [*lines, *([f"And {count(more, 'more recording')}."] if more > 0 else [])]


def _listed(labels: Sequence[str]) -> str:
    first = ", ".join(labels[:MOST])
    return first + (f" and {len(labels) - MOST} more" if len(labels) > MOST else "")


def _held(what: str, supports: Sequence[Mapping[str, Any]]) -> list[str]:
    """The line of supports, or of bases; none where there are none."""
    parts = [f"{_nodes(s['nodes'])} ({', '.join(s['dofs'])})" for s in supports]
    more = f"; and {len(parts) - MOST} more" if len(parts) > MOST else ""
    return [f"{what}: {'; '.join(parts[:MOST])}{more}."] if parts else []


def _nodes(nodes: Sequence[int] | str) -> str:
    if isinstance(nodes, str):
        return "all nodes"
    first = ", ".join(map(str, nodes[:MOST]))
    more = f" and {len(nodes) - MOST} more" if len(nodes) > MOST else ""
    return f"node{'s' if len(nodes) > 1 else ''} {first}{more}"


def _joined(values: Sequence[float], by: str) -> str:
    return by.join(f"{v:.4g}" for v in values)
