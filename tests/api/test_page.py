"""docs/python.md does what it says."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python.md"


def test_the_page_runs() -> None:
    names: dict = {}
    said: list[str] = []
    blocks = re.findall(r"```python\n(>>> .*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for block in blocks:
        found = doctest.DocTestParser().get_doctest(block, names, "python.md", "python.md", 0)
        doctest.DocTestRunner().run(found, out=said.append, clear_globs=False)
        names = found.globs
    assert len(blocks) >= 4 and not said, "".join(said)


def test_the_other_blocks_are_python() -> None:
    blocks = re.findall(r"```python\n(?!>>>)(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for block in blocks:
        assert compile(block, "python.md", "exec")
