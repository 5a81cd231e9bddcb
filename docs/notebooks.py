"""A notebook for every tutorial: its text, its files, its commands and its code as cells.

``python -m docs.notebooks`` writes docs/tutorials/files/NAME/NAME.ipynb from the tutorial NAME.md;
`tests/test_documents.py` compares them, and runs what stands in them as the page has it.
"""

from __future__ import annotations

import doctest
import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TUTORIALS = Path(__file__).resolve().parent / "tutorials"
BLOCK = re.compile(r"```(\w+)([^\n]*)\n(.*?)```\n?", re.DOTALL)
NAMED = re.compile(r'title="(in )?([^",]+)(?:, instead)?"')
"""Beside a block: ``title="FILE"`` is the file, ``title="in FILE, instead"`` its new lines."""
KEY = re.compile(r"^(\w+) = ", re.MULTILINE)
PROJECT = tomllib.loads((TUTORIALS.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
SITE = PROJECT["project"]["urls"]["Documentation"].replace("/tree/", "/blob/")
"""Where the other pages are."""
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def path_of(page: Path) -> Path:
    """Beside the files that the tutorial asks for."""
    return page.parent / "files" / page.stem / f"{page.stem}.ipynb"


def pieces(text: str) -> Iterator[tuple[str, str, str]]:
    """(language, what stands beside it, text) of every part of a page, prose as "markdown"."""
    at = 0
    for found in BLOCK.finditer(text):
        if text[at : found.start()].strip():
            yield "markdown", "", text[at : found.start()].strip()
        yield found[1], found[2].strip(), found[3]
        at = found.end()
    if text[at:].strip():
        yield "markdown", "", text[at:].strip()


def code(language: str, beside: str, text: str) -> list[str]:
    """The cells that do what a block says; none for one that is only shown. What Python answers
    ends a cell, for a notebook shows its last line."""
    if language == "console":
        said = [line[2:] for line in text.splitlines() if line.startswith("$ ")]
        return ["\n".join("!" + line for line in said)]
    if language == "python":
        out, open_ = [], ""
        for example in doctest.DocTestParser().get_examples(text):
            open_ += example.source
            if example.want:
                out.append(open_.strip())
                open_ = ""
        return [*out, open_.strip()] if open_.strip() else out or [text.strip()]
    named = NAMED.search(beside)
    if named is None:
        return []
    if not named[1]:
        return [f"%%writefile {named[2]}\n{text.strip()}"]
    lines = [
        f"text = re.sub(r'(?m)^{key} = .*$', {line!r}, text)"
        for line in text.strip().splitlines()
        for key in KEY.findall(line)
    ]
    opened = ["import pathlib, re", f"path = pathlib.Path({named[2]!r})", "text = path.read_text()"]
    return ["\n".join([*opened, *lines, "_ = path.write_text(text)"])]


def moved(text: str, page: Path) -> str:
    """A page's text for its notebook, which somebody downloaded: its files lie beside it, other
    pages are on the site, and it need not name itself."""
    alone = re.sub(rf"(?m)^.*\b{page.stem}\.ipynb\).*\n?", "", text)
    return alone.replace(f"](files/{page.stem}/", "](").replace("](../", f"]({SITE}/").strip()


def notebook(page: Path) -> str:
    """The text of its file."""
    cells: list[dict[str, Any]] = []
    for language, beside, text in pieces(page.read_text(encoding="utf-8")):
        sources = [] if language == "markdown" else code(language, beside, text)
        shown = moved(text, page) if language == "markdown" else f"```{language}\n{text}```"
        for kind, source in [("code", s) for s in sources] or [("markdown", shown)]:
            own: dict[str, Any] = {"id": f"cell-{len(cells) + 1}", "metadata": {}}
            own |= {"execution_count": None, "outputs": []} if kind == "code" else {}
            cells.append({"cell_type": kind, **own, "source": source.splitlines(True)})
    about = {"kernelspec": KERNEL, "language_info": {"name": "python"}}
    whole = {"cells": cells, "metadata": about, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for each in sorted(TUTORIALS.glob("*.md")):
        path_of(each).parent.mkdir(exist_ok=True)
        path_of(each).write_text(notebook(each), encoding="utf-8")
