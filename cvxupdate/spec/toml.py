"""TOML text to tables, as the three doors of a problem file need it (file, text, what `inspect`
writes)."""

from __future__ import annotations

import re
import tomllib
from typing import Any

DOTS = 300
"""Dots in one key or one number: the parser takes the square of it."""


def toml_tables(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises
    ------
    RecursionError
        Where it is nested too deeply, be it in brackets or in the dots of a key.
    ValueError
        Where it is not TOML.
    """
    if text.count(".") > DOTS and any(
        part.count(".") > DOTS for part in re.split(r"[,=\[\]{}\n\"\']", text)
    ):
        raise RecursionError
    return tomllib.loads(text)
