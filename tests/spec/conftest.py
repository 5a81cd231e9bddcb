"""One good problem file, and a way to spoil it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

GOOD = Path(__file__).parent / "good"


@pytest.fixture
def good(tmp_path: Path) -> Path:
    """A copy of the good problem file with its data."""
    folder = tmp_path / "good"
    shutil.copytree(GOOD, folder)
    return folder / "problem.toml"


@pytest.fixture
def spoil(good: Path) -> Callable[..., Path]:
    """Replace text that occurs exactly once in the good file; returns its path."""

    def edit(*pairs: tuple[str, str]) -> Path:
        text = good.read_text()
        for old, new in pairs:
            assert text.count(old) == 1, f"{old!r} occurs {text.count(old)} times in the good file"
            text = text.replace(old, new)
        good.write_text(text)
        return good

    return edit
