"""Syntax trees of the repository's files, parsed once for all tests that read them."""

from __future__ import annotations

import ast
import gc
from functools import cache
from pathlib import Path


@cache
def tree(path: Path) -> ast.Module:
    """The syntax tree of a file; nobody changes it. It stays to the end: to look through the trees
    of all files for garbage takes longer than to parse them."""
    found = ast.parse(path.read_text(encoding="utf-8"))
    gc.freeze()
    return found
