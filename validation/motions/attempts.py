"""One case made and diagnosed: what processes and workers do, which cannot import a `__main__`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from validation.motions.files import make
from validation.rigs.attempts import attempt


def attempted(seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """One case: generated, diagnosed, written."""
    return attempt(seed, folder, state, limit, make=make)
