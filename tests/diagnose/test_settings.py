"""Every threshold is used, and has its reason."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from cvxupdate.diagnose import settings

SOURCE = Path(settings.__file__)
TREE = ast.parse(SOURCE.read_text(encoding="utf-8"))
NAMES = [
    name.id
    for line in TREE.body
    if isinstance(line, ast.Assign)
    for name in ast.walk(line.targets[0])
    if isinstance(name, ast.Name)
]
# the comment above COARSE and FINE is theirs too
FOLLOWING = {"SEVERAL_LEVEL", "FINE_SEVERAL"}


def test_every_threshold_is_used() -> None:
    others = [p for p in SOURCE.parent.rglob("*.py") if p != SOURCE]
    used = "\n".join(p.read_text(encoding="utf-8") for p in others)
    assert NAMES and [n for n in NAMES if not re.search(rf"\b{n}\b", used)] == []


def test_no_threshold_is_set_twice() -> None:
    assert sorted(NAMES) == sorted(set(NAMES))


def test_no_module_beside_has_one_of_its_own() -> None:
    """A threshold has one place; a module that wants it imports it."""
    doubled = {
        (path.name, name.id)
        for path in SOURCE.parent.rglob("*.py")
        if path != SOURCE
        for line in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(line, ast.Assign)
        for name in ast.walk(line.targets[0])
        if isinstance(name, ast.Name) and name.id in NAMES
    }
    assert doubled == set()


def test_every_threshold_has_its_reason() -> None:
    """A comment stands above each line, or above the lines just before it."""
    lines = SOURCE.read_text(encoding="utf-8").splitlines()
    bare = [
        lines[line.lineno - 1]
        for line in TREE.body
        if isinstance(line, ast.Assign) and not lines[line.lineno - 2].startswith("#")
    ]
    assert [b for b in bare if b.partition(" ")[0].rstrip(",") not in FOLLOWING] == []
