"""What ``check`` prints of a problem without faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cvxupdate.report.numbers import count

COUNTS = ("nodes", "elements", "free DOFs", "recordings", "parameters")


def check_lines(problem: str, summary: Mapping[str, Any]) -> list[str]:
    """Counts, then what its author can judge at a glance (mass, extent, first natural frequencies),
    then the warnings."""
    warnings = summary["warnings"]
    counts = ", ".join(f"{summary[k]} {k}" for k in COUNTS)
    how = "in order" if not warnings else f"no faults, but {count(len(warnings), 'warning')}"
    return [
        f"{problem}: {how}. {counts}.",
        f"{_size(summary)}.",
        *(f"Warning: {w['says']}" for w in warnings),
    ]


def _size(summary: Mapping[str, Any]) -> str:
    mass, extent, f = summary["mass"], summary["extent"], summary["frequencies"]
    parts = [] if mass is None else [f"total mass {mass:.4g} kg"]
    if max(extent, default=0.0) > 0.0:
        parts.append(f"extent {_joined(extent, ' × ')} m")
    if f:
        parts.append(f"first natural frequencies {_joined(f, ', ')} Hz")
    line = ", ".join(parts) or "no mass, no extent"
    return line[:1].upper() + line[1:]


def _joined(values: Sequence[float], by: str) -> str:
    return by.join(f"{v:.4g}" for v in values)
