"""What mkdocstrings has to know of our docstrings: under "Parameters" a name is followed by words,
not by a type, so the words go where numpy's form has its description."""

from __future__ import annotations

import re
from typing import Any

import griffe

SECTION = re.compile(r"(?ms)^(Parameters\n-+\n)(.*?)(?=\n\n|\Z)")
ITEM = re.compile(r"^([\w*]+(?:, [\w*]+)*) : (.*)$")


def described(text: str) -> str:
    """The docstring with each ``name : words`` as a name and an indented description."""

    def section(found: re.Match[str]) -> str:
        lines = []
        for line in found[2].splitlines():
            item = ITEM.match(line)
            lines += [line] if item is None else [item[1], f"    {item[2]}"]
        return found[1] + "\n".join(lines)

    return SECTION.sub(section, text)


class Words(griffe.Extension):
    """Rewrites every docstring before it is parsed."""

    def on_instance(self, *, obj: Any, **kwargs: Any) -> None:
        """Of a module, class or function that was read."""
        if obj.docstring is not None:
            obj.docstring.value = described(obj.docstring.value)
