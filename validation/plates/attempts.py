"""One case made and diagnosed: what processes and workers do, which cannot import a `__main__`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from validation.plates.files import make
from validation.timed import timed


def tried(seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """One case written, diagnosed and judged; its file."""
    return timed(_written, seed, folder, state, limit)


def _written(seed: int, folder: Path) -> dict[str, Any]:
    return {"family": make(seed, folder).design.family}
