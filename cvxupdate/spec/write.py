"""A problem as tables and as text: what `load_problem` read, written out whole, with every table of
rows inline.

Paths become absolute, or stay relative to their data set under CVXUPDATE_DATA, so the text may lie
in any folder; `Written.text_in` makes them relative to the folder in which it will lie.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cvxupdate.spec.elements import MATRICES, inherited
from cvxupdate.spec.grammar import Spec
from cvxupdate.spec.tables import DATA_VARIABLE, is_table

WIDE = 150
"""Characters of a line up to which a list stands on it."""


FILES = ("file", "covariance")
FILED = (*FILES, *MATRICES)
"""Keys that may hold a path."""


@dataclass(frozen=True)
class Written:
    """A problem file to be written: its tables, and the comment on top."""

    tables: dict[str, Any]
    head: tuple[str, ...]

    @property
    def text(self) -> str:
        """As TOML, with absolute paths."""
        return to_toml(self.tables, self.head)

    def text_in(self, folder: str | os.PathLike[str]) -> str:
        """As TOML for a file in ``folder``: paths are relative to it, so that the folder may move
        together with the recordings."""
        return to_toml(_relative(self.tables, os.path.abspath(folder)), self.head)


def _relative(value: Any, folder: str) -> Any:
    if isinstance(value, Mapping):
        return {
            k: Path(os.path.relpath(v, folder)).as_posix()
            if k in FILED and isinstance(v, str) and os.path.isabs(v)
            else _relative(v, folder)
            for k, v in value.items()
        }
    return [_relative(v, folder) for v in value] if isinstance(value, list) else value


def tables_of(spec: Spec) -> dict[str, Any]:
    """The whole problem as plain tables, defaults left out; a fresh copy that may be changed. Rows
    hold what their block gave them."""
    out: dict[str, Any] = {k: v for k, v in (("title", spec.title), ("source", spec.source)) if v}
    out["model"] = _plain(spec.model)
    for block in out["model"]["elements"]:
        for key in inherited(block["type"]):
            block.pop(key, None)
        for row in (block, *block["rows"]):
            _locate(row)
    if spec.recordings:
        out["recordings"] = [{"kind": r.kind, **_plain(r)} for r in spec.recordings]
    for recording in out.get("recordings", ()):
        _own_rows(recording)
        _locate(recording)
    if spec.update is not None:
        out["update"] = _plain(spec.update)
    for key in ("constraints", "solver", "diagnose"):
        table = _plain(getattr(spec, key))
        if table:
            out[key] = table
    if spec.regularisation:
        out["regularisation"] = [_plain(r) for r in spec.regularisation]
    return out


def compacted(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The same tables with what all rows of a block share said once, on the block."""
    model = tables["model"]
    blocks = []
    for block in model["elements"]:
        rows = block["rows"]
        shared = {
            k: rows[0][k]
            for k in inherited(block["type"])
            if len(rows) > 1 and all(k in r and r[k] == rows[0][k] for r in rows)
        }
        rest = {k: v for k, v in block.items() if k not in ("type", "rows")}
        blocks.append(
            {
                "type": block["type"],
                **rest,
                **shared,
                "rows": [{k: v for k, v in r.items() if k not in shared} for r in rows],
            }
        )
    return {**tables, "model": {**model, "elements": blocks}}


def _plain(part: Any) -> dict[str, Any]:
    made = part.model_dump(mode="python", exclude_none=True, exclude_defaults=True)
    return dict(_thawed(made))


def _thawed(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {k: _thawed(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [_thawed(v) for v in value]
    return value


def _own_rows(recording: dict[str, Any]) -> None:
    """A table of modes that was read from a CSV file holds its rows, perhaps paired anew, and the
    file no more: of two tables one would be read and the other one be looked at."""
    file = recording.get("file")
    if recording["kind"] != "modes" or not recording.get("rows") or not is_table(file):
        return
    name = Path(str(file)).name
    recording.setdefault("name", name)
    recording.setdefault("source", name)
    for key in ("file", "dataset"):
        recording.pop(key, None)


def _locate(table: dict[str, Any]) -> None:
    """Names of files as they are found from anywhere: within their data set, else absolute."""
    named = {k: Path(table[k]) for k in FILES if isinstance(table.get(k), str | Path)}
    if not named:
        return
    root, dataset = os.environ.get(DATA_VARIABLE), table.get("dataset")
    folder = None if dataset is None or root is None else Path(root) / dataset
    if folder is not None and all(file.is_relative_to(folder) for file in named.values()):
        table |= {key: file.relative_to(folder).as_posix() for key, file in named.items()}
        return
    table.pop("dataset", None)
    table |= {key: Path(os.path.abspath(file)).as_posix() for key, file in named.items()}


def to_toml(tables: Mapping[str, Any], comment: Sequence[str] = ()) -> str:
    """TOML text; lists of tables at the top, in [model] and of elements, supports, ties, bases and
    families get headers of their own, rows one line each."""
    lines = [f"# {line}".rstrip() for text in comment for line in text.splitlines()]
    if lines:
        lines.append("")
    lines += [f"{_key(k)} = {_value(v)}" for k, v in tables.items() if not _is_table(v)]
    for name, value in tables.items():
        if isinstance(value, Mapping):
            _table(lines, _key(name), value)
        elif _is_table(value):
            for item in value:
                _table(lines, _key(name), item, True)
    return "\n".join(lines).lstrip("\n") + "\n"


HEADED = tuple(f"model.{k}" for k in ("elements", "supports", "ties", "bases", "families"))
BELOW = ("model.materials", "model.sections")


def _table(lines: list[str], path: str, table: Mapping[str, Any], listed: bool = False) -> None:
    lines += ["", f"[[{path}]]" if listed else f"[{path}]"]
    later: list[tuple[str, Any]] = []
    for key, value in table.items():
        here = f"{path}.{_key(key)}"
        if here in HEADED or here in BELOW or here == "model.damping":
            later.append((here, value))
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    for here, value in later:
        if here in BELOW:
            for name, item in value.items():
                _table(lines, f"{here}.{_key(name)}", item)
        elif isinstance(value, Mapping):
            _table(lines, here, value)
        else:
            for item in value:
                _table(lines, here, item, True)


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or (
        isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)
    )


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
            if value
            else "{}"
        )
    if isinstance(value, list | tuple):
        items = [_value(v) for v in value]
        flat = "[" + ", ".join(items) + "]"
        rows = bool(value) and isinstance(value[0], Mapping)
        return (
            flat
            if not rows and len(flat) <= WIDE
            else "[\n" + "".join(f"  {item},\n" for item in _wrapped(items, rows)) + "]"
        )
    if isinstance(value, str | Path):
        return _text(str(value))
    return repr(value) if isinstance(value, int | float) else _text(str(value))


def _wrapped(items: Sequence[str], rows: bool) -> list[str]:
    if rows:
        return list(items)
    out: list[str] = []
    for item in items:
        if out and len(out[-1]) + len(item) + 2 <= WIDE:
            out[-1] += f", {item}"
        else:
            out.append(item)
    return out
