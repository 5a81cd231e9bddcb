"""A TOML file of the user's, or the one fault that keeps it from being read."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from cvxupdate.errors import Fault
from cvxupdate.spec.toml import toml_tables

LARGEST = 500_000_000
"""Bytes above which a file is surely not a problem file."""


def problem_in(path: Path) -> Path:
    """The problem.toml of a folder that has one; else the path as it is."""
    inside = path / "problem.toml"
    return inside if os.path.isdir(path) and inside.is_file() else path


def read_toml(path: Path) -> dict[str, Any] | Fault:
    """The parsed TOML, or the one fault that keeps it from being read."""

    def fault(problem: str, remedy: str, key: str = "") -> Fault:
        return Fault(str(path), key, problem, remedy)

    if "\0" in str(path):
        return fault("holds a NUL character, so it names no file.", "Correct the name.")
    if os.path.isdir(path):
        return fault("is a folder, without a problem.toml.", "Name a problem file.")
    try:
        if path.exists() and not path.is_file():  # a pipe or a device might never end
            return fault("is not a file.", "Name the .toml file.")
        if os.path.getsize(path) > LARGEST:
            return fault(
                f"is larger than {LARGEST // 1_000_000} MB: surely not a problem file.",
                "Name the .toml file.",
            )
        blob = path.read_bytes()
    except FileNotFoundError:
        return fault("there is no such file.", "Check the name and the folder you are in.")
    except OSError as error:
        return fault(f"cannot be read: {error.strerror}.", "Check the name and the permissions.")
    if blob.startswith((b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")):
        return fault(
            "begins with a byte-order mark.",
            "Save the file as UTF-8 without BOM; TOML does not allow one.",
        )
    try:
        text = blob.decode("utf-8")
    except UnicodeDecodeError as error:
        line = blob.count(b"\n", 0, error.start) + 1
        return fault(
            f"is not UTF-8 text (line {line}, byte {error.start}).", "Save the file as UTF-8."
        )
    if not text.strip():
        return fault("is empty.", "Write a problem file; docs/problem-files.md shows one.")
    try:
        return toml_tables(text)
    except RecursionError:
        return fault("is nested too deeply.", "A problem file needs four levels at most.")
    except ValueError as error:  # TOMLDecodeError, or an integer of thousands of digits
        return fault(
            f"is not valid TOML: {error}.",
            "Correct that place; quotes, brackets and commas are the usual causes.",
        )
