"""From parsed TOML to what pydantic reads: included models and CSV tables in place, paths resolved,
block values pushed into rows."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cvxupdate.keys import Loc
from cvxupdate.spec.elements import EXCLUSIVE, MATRICES, MATRIX_FILES, from_files, inherited
from cvxupdate.spec.include import Refusal, included, merge, placed
from cvxupdate.spec.mode_columns import differing, gather_modes
from cvxupdate.spec.tables import Source, TableError, is_table, locate, read_table, unusable


@dataclass(frozen=True)
class Complaint:
    """A fault at a place of the problem, before the place is written out as file and key.

    ``loc`` is a place of the whole problem; with ``source`` it is a place of that file.
    """

    loc: Loc
    problem: str
    remedy: str
    source: Source | None = None


@dataclass
class Prepared:
    """The data for pydantic, and where each part of it came from."""

    data: dict[str, Any]
    source: Source
    origins: dict[Loc, tuple[Source, Loc]] = field(default_factory=dict)
    """Place in a merged [model] → the file that says it, and the place there; empty when nothing is
    included."""
    inherited: dict[Loc, dict[str, frozenset[int]]] = field(default_factory=dict)
    """For a block: key → the rows that have it from the block."""
    wrapped: bool = False
    """[regularisation] was one table, so index 0 is not in the file."""
    complaints: list[Complaint] = field(default_factory=list)
    damaged: set[str] = field(default_factory=set)
    """Sections of which a part could not be read."""
    incomplete: bool = False
    """An included file could not be used, so the [model] is not known."""

    def origin(self, loc: Loc) -> tuple[Source, Loc]:
        """The file that says what stands at ``loc``, and the place there."""
        for length in range(len(loc), 1, -1):
            found = self.origins.get(loc[:length])
            if found is not None:
                return found[0], (*found[1], *loc[length:])
        return self.source, loc


def prepare(raw: dict[str, Any], path: Path) -> Prepared:
    """Everything pydantic needs to see at once; never raises for what a file may hold."""
    out = Prepared(_copy(raw), Source(path))
    data = out.data
    out.origins = _assemble(out, data, out.source, ())
    model = data.get("model")
    if isinstance(model, dict) and isinstance(model.get("elements"), list):
        for i, block in enumerate(model["elements"]):
            if isinstance(block, dict):
                _inherit(out, block, ("model", "elements", i))
                if from_files(block.get("type")):
                    base = out.origin(("model", "elements", i))[0].path.parent
                    for _, row in _dicts(block.get("rows")):
                        _resolve_matrices(row, base)
    if isinstance(data.get("regularisation"), dict):
        data["regularisation"] = [data["regularisation"]]
        out.wrapped = True
    out.data = _freeze(data)
    return out


def _assemble(
    out: Prepared, data: dict[str, Any], source: Source, above: tuple[Path, ...]
) -> dict[Loc, tuple[Source, Loc]]:
    """Put the tables and the included [model] of one file in place; where each part of the merged
    [model] came from, {} when nothing was included.

    ``above`` are the files that led here, the problem file first.
    """
    for i, recording in _dicts(data.get("recordings")):
        said = differing(recording, source.path.parent)
        if said:
            remedy = "Remove `file`, and the rows count; or the rows, and the file is read."
            out.complaints.append(Complaint(("recordings", i, "rows"), said, remedy, source))
    for table, key, loc in _tables(data):
        _inline(out, table, key, loc, source)
    for table in _with_files(data):
        _resolve(table, source.path.parent)
    model = data.get("model")
    if not isinstance(model, dict) or not isinstance(model.get("include"), str):
        return {}
    name = model.pop("include")
    inner = Source(source.path.parent / name)
    below = included(name, (*above, source.path))
    if isinstance(below, Refusal):
        there = source if below.here else inner
        out.complaints.append(Complaint(below.loc, below.problem, below.remedy, there))
        out.incomplete = True
        return {}
    places = _assemble(out, below, inner, (*above, source.path)) or placed(below["model"], inner)
    data["model"], places = merge(below["model"], places, model, placed(model, source))
    return places


def section_of(loc: Loc) -> str:
    """The section a place belongs to: ``nodes``, ``elements`` … of the model, or the name of the
    top-level table."""
    return str(loc[1]) if loc[0] == "model" and len(loc) > 1 else str(loc[0])


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _copy(v) for k, v in value.items()}
    return [_copy(v) for v in value] if isinstance(value, list) else value


def _freeze(value: Any) -> Any:
    """Lists as tuples, which is what pydantic's strict mode takes for a tuple."""
    if isinstance(value, dict):
        return {k: _freeze(v) for k, v in value.items()}
    return tuple(_freeze(v) for v in value) if isinstance(value, list) else value


def _dicts(value: Any) -> Iterator[tuple[int, dict[str, Any]]]:
    if isinstance(value, list):
        yield from ((i, item) for i, item in enumerate(value) if isinstance(item, dict))


def _tables(data: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str, Loc]]:
    """Every place where rows may be named by a CSV file."""
    model, update = data.get("model"), data.get("update")
    if isinstance(model, dict):
        yield model, "nodes", ("model",)
        for i, block in _dicts(model.get("elements")):
            yield block, "rows", ("model", "elements", i)
    for i, recording in _dicts(data.get("recordings")):
        table = is_table(recording.get("file")) and recording.get("kind") == "modes"
        if table and "rows" not in recording:
            recording["rows"] = {k: recording[k] for k in ("file", "dataset") if k in recording}
        yield recording, "rows", ("recordings", i)
        yield recording, "channels", ("recordings", i)
    if isinstance(update, dict):
        yield update, "parameters", ("update",)


def _inline(out: Prepared, table: dict[str, Any], key: str, at: Loc, source: Source) -> None:
    named = table.get(key)
    if not isinstance(named, dict):
        return
    loc = (*at, key)
    file, dataset = named.get("file"), named.get("dataset")
    faults = [
        Complaint(
            (*loc, k),
            f"unknown key '{k}'.",
            "A table of rows takes `file` and `dataset` only.",
            source,
        )
        for k in named
        if k not in ("file", "dataset")
    ]
    rows: list[dict[str, Any]] = []
    if not isinstance(file, str) or not isinstance(dataset, str | None):
        faults.append(
            Complaint(
                loc,
                "is neither a list of rows nor a file.",
                'Give rows, or { file = "x.csv" }.',
                source,
            )
        )
    else:
        path = locate(file, dataset, source.path.parent)
        wrong = unusable(path, dataset)
        if wrong:
            faults.append(Complaint((*loc, "file"), *wrong, source))
        else:
            try:
                rows, source.tables[loc] = read_table(path)
                if at[0] == "recordings" and key == "rows":
                    rows = gather_modes(table, rows)
            except TableError as error:
                problem = f"'{path}' {error.problem}"
                faults.append(Complaint((*loc, "file"), problem, error.remedy, source))
    out.complaints += faults
    if rows or not faults:
        table[key] = rows
    else:  # nothing to check there: what depends on it is not to be complained of as well
        del table[key]
        out.damaged.add(section_of(loc))


def _with_files(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield from (recording for _, recording in _dicts(data.get("recordings")))
    model = data.get("model")
    if isinstance(model, dict):
        for _, block in _dicts(model.get("elements")):
            if from_files(block.get("type")):
                yield block
                yield from (row for _, row in _dicts(block.get("rows")))


def _resolve(table: dict[str, Any], base: Path) -> None:
    dataset = table.get("dataset")
    if not isinstance(dataset, str | None):
        return
    for key in ("file", "covariance") if "kind" in table else ("file",):
        if isinstance(table.get(key), str):
            table[key] = locate(table[key], dataset, base)


def _resolve_matrices(row: dict[str, Any], base: Path) -> None:
    """A matrix that is a file of its own, as an absolute path (after the row has its `dataset` from
    the block)."""
    for key in MATRICES:
        name, dataset = row.get(key), row.get("dataset")
        if (
            isinstance(name, str)
            and name.lower().endswith(MATRIX_FILES)
            and isinstance(dataset, str | None)
        ):
            row[key] = os.path.abspath(locate(name, dataset, base))


def _inherit(out: Prepared, block: dict[str, Any], loc: Loc) -> None:
    """Push what the block says into the rows that do not say it themselves."""
    keys = inherited(block["type"]) if isinstance(block.get("type"), str) else ()
    rows = list(_dicts(block.get("rows")))
    given = {key: block[key] for key in keys if key in block}
    from_block: dict[str, frozenset[int]] = {}
    own = [set(row) for _, row in rows]
    for key, value in given.items():
        takers = [
            (i, row)
            for (i, row), has in zip(rows, own, strict=True)
            if key not in has and EXCLUSIVE.get(key) not in has
        ]
        for _, row in takers:
            row[key] = value
        from_block[key] = frozenset(i for i, _ in takers)
    out.inherited[loc] = from_block
