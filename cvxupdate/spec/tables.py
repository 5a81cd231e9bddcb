"""CSV files that stand for a table of rows: the same column names, one row a line."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cvxupdate.keys import Loc

LISTS = frozenset(
    {"nodes", "shape", "orientation", "axis", "elements", "groups", "dofs", "labels", "index"}
)
"""Columns whose cell holds a list, separated by blanks or ``;``."""
TEXTS = frozenset(
    {
        "group",
        "material",
        "section",
        "dof",
        "name",
        "of",
        "each",
        "quantity",
        "unit",
        "dataset",
        "file",
        "stiffness",
        "mass",
        "structural",
    }
)
"""Columns that are never numbers, and never lists."""
DATA_VARIABLE = "CVXUPDATE_DATA"

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMPLEX = re.compile(rf"(?P<re>{_NUMBER.pattern})(?P<im>[+-](\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)[ij]")


class TableError(Exception):
    """A table file cannot be used: what is wrong, and the remedy."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.problem, self.remedy = problem, remedy


@dataclass(frozen=True)
class TableFile:
    """Where the rows of a table came from; ``lines[i]`` is the line of row i (the first line is
    1), ``header`` that of the ``columns``' names."""

    path: Path
    lines: tuple[int, ...]
    header: int
    columns: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Source:
    """A file with a part of the problem; ``tables``: the CSV files that it names, by their place in
    it."""

    path: Path
    tables: dict[Loc, TableFile] = field(default_factory=dict)


def locate(
    file: str, dataset: str | None, base: Path, environ: Mapping[str, str] = os.environ
) -> Path:
    """The path that ``file`` (and ``dataset``) names; an unset CVXUPDATE_DATA stays visible in
    it."""
    if dataset is None:
        return base / file
    return Path(environ.get(DATA_VARIABLE) or f"${DATA_VARIABLE}") / dataset / file


def is_table(file: object) -> bool:
    """Whether the name of a file is that of a table of rows."""
    return isinstance(file, str | Path) and str(file).lower().endswith(".csv")


def unusable(
    path: Path, dataset: str | None, environ: Mapping[str, str] = os.environ
) -> tuple[str, str] | None:
    """What is wrong with a file that a problem file names, and the remedy; None when it can be
    opened."""
    if dataset is not None and not environ.get(DATA_VARIABLE):
        return (
            f"needs data set '{dataset}', but the environment variable {DATA_VARIABLE} is not set.",
            f"Set {DATA_VARIABLE} to the folder that holds the data sets; "
            "problems/real/README.md says where to get them.",
        )
    if "\0" in str(path):
        return "holds a NUL character, so it names no file.", "Correct the name."
    if dataset is not None and not os.path.isdir(os.path.join(environ[DATA_VARIABLE], dataset)):
        return (
            f"data set '{dataset}' is not in {environ[DATA_VARIABLE]}.",
            f"Put it there, or set {DATA_VARIABLE} to the folder that holds it; see "
            "problems/real/README.md.",
        )
    if os.path.isdir(path):
        return f"'{path}' is a folder.", "Name a file in it."
    if not os.path.isfile(path):
        return (
            f"there is no file '{path}'.",
            "Correct the name (paths are relative to the problem file) or put the file there.",
        )
    if not os.access(path, os.R_OK):
        return f"'{path}' may not be read.", "Change the permissions of the file."
    if os.path.getsize(path) == 0:
        return (
            f"'{path}' is empty (0 bytes).",
            "Put the data there again; the copy may have been cut off.",
        )
    return None


def read_table(path: Path) -> tuple[list[dict[str, Any]], TableFile]:
    """Rows of a CSV file with one header line.

    The columns are separated by ``,``, ``;`` or tabs (whichever the header uses); empty cells are
    absent keys; beside ``;`` and tabs numbers may have a decimal comma; blank lines and lines that
    begin with ``#`` are left out; a cell of a list column holds its items separated by blanks.

    Raises
    ------
    TableError
        When the file is not UTF-8 text, has no header or no rows, or a row has not as many
        cells as the header.
    """
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TableError(f"is not UTF-8 text (byte {error.start}).", "Save it as UTF-8.") from None
    except OSError as error:
        raise TableError(
            f"cannot be read: {error.strerror}.", "Check the name and the permissions."
        ) from None
    lines = [
        (i, line)
        for i, line in enumerate(io.StringIO(text), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise TableError(
            "is empty.", "Give a header line with the column names, then one row a line."
        )
    delimiter = max(",;\t", key=lines[0][1].count)
    try:
        cells = [
            next(csv.reader([line], delimiter=delimiter, strict=True), []) for _, line in lines
        ]
    except csv.Error as error:
        raise TableError(f"is not a CSV file ({error}).", "Check quotes and separators.") from None
    header = [name.strip() for name in cells[0]]
    if len(header) > 1 and not header[0] and cells[1:]:  # pandas writes its index so
        header, cells = header[1:], [row[1:] for row in cells]
    if "" in header or len(set(header)) < len(header):
        raise TableError(
            "line 1: an empty or repeated column name.", "Give every column its own name."
        )
    numbers = tuple(number for number, _ in lines)
    rows = _rows(header, numbers[1:], cells[1:], delimiter)
    return rows, TableFile(path, numbers[1:], numbers[0], tuple(header))


def _rows(
    header: list[str], numbers: tuple[int, ...], cells: list[list[str]], delimiter: str
) -> list[dict[str, Any]]:
    """Cells as rows by column name; ``numbers`` are their lines."""
    rows: list[dict[str, Any]] = []
    for number, row in zip(numbers, cells, strict=True):
        if len(row) != len(header):
            raise TableError(
                f"line {number}: {len(row)} cell{'s' * (len(row) > 1)} under {len(header)} "
                "column names.",
                "Check the separators; a cell that is left empty keeps its separator.",
            )
        rows.append(
            {
                k: _cell(k, _pointed(k, v.strip(), delimiter))
                for k, v in zip(header, row, strict=True)
                if v.strip()
            }
        )
    return rows


def _pointed(column: str, text: str, delimiter: str) -> str:
    """Numbers with a decimal point, where the columns are not separated by commas."""
    return text if delimiter == "," or column in TEXTS else re.sub(r"(?<=\d),(?=\d)", ".", text)


def _cell(column: str, text: str) -> Any:
    if column in LISTS and text not in ("all", "auto"):
        return [_scalar(part) for part in re.split(r"[;\s]+", text.strip("[]() ;")) if part]
    return text if column in TEXTS else _scalar(text)


def _scalar(text: str) -> Any:
    """Number, ``1.0+0.2j`` as [re, im], or the text itself."""
    if re.fullmatch(r"[+-]?\d{1,18}", text):
        return int(text)
    if _NUMBER.fullmatch(text) or text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
        return float(text)
    both = _COMPLEX.fullmatch(text)
    return [float(both["re"]), float(both["im"])] if both else text
