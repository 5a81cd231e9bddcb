"""What the recordings in memory share: names of motions, keys that are passed on, words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cvxupdate.errors import InputError
from cvxupdate.recordings.types import Origin

MOTIONS = {
    "displacement": "displacement",
    "receptance": "displacement",
    "compliance": "displacement",
    "velocity": "velocity",
    "mobility": "velocity",
    "acceleration": "acceleration",
    "accelerance": "acceleration",
    "inertance": "acceleration",
}
RATIOS = {"displacement": "m/N", "velocity": "(m/s)/N", "acceleration": "(m/s²)/N"}
MADE = frozenset(
    ("kind", "file", "channels", "references", "variables", "response", "rate", "rows")
)
"""Keys of [[recordings]] that an object of arrays writes itself."""


def motion_of(quantity: Any) -> str:
    """Displacement, velocity or acceleration; the names of FRFs too (mobility …)."""
    found = MOTIONS.get(str(quantity).strip().lower())
    if found is None:
        raise InputError(
            f"quantity: {quantity!r} is no motion. Give displacement (receptance), velocity "
            "(mobility) or acceleration (accelerance)."
        )
    return found


def settings_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of [[recordings]] that are passed on: use, name, level, band, corrections …"""
    own = sorted(set(settings) & MADE)
    if own:
        raise InputError(f"{', '.join(own)}: follows from the arrays. Leave it out.")
    return {k: v for k, v in settings.items() if v is not None}


def origin_keys(origin: Origin) -> dict[str, Any]:
    """What a recording that was read keeps of [[recordings]]."""
    return {"use": origin.use, "name": origin.name, "level": origin.level}


def counted(n: int, what: str) -> str:
    """ "1 line", "2 lines"."""
    return f"{n} {what}{'' if n == 1 else 's'}"
