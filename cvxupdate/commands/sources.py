"""What `identify` looks at: a problem file, recordings alone, or a raw file of recordings."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cvxupdate.errors import Fault, InputError, ProblemFileError
from cvxupdate.spec import Spec, read_text, spec_of
from cvxupdate.spec.given import Given, is_text, plain, tables_in
from cvxupdate.spec.read import problem_in, read_toml

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.read.contents import Progress
    from cvxupdate.recordings.types import Recording


@dataclass(frozen=True)
class Source:
    """Recordings with the name and title of where they come from; ``geometry`` and ``model`` where
    a model goes with them; ``notes`` what was taken for granted."""

    name: str
    title: str
    path: str
    recordings: tuple[Recording, ...]
    geometry: Geometry | None = None
    notes: tuple[str, ...] = ()
    model: Model | None = None


def open_source(
    given: Given, rate: float | None = None, progress: Progress | None = None
) -> Source:
    """The recordings of a problem in any form (with its geometry), of [[recordings]] without a
    [model] (a TOML file, its text or its tables), or of a raw file, as `inspect` suggests them.

    Raises
    ------
    InputError
        Where it cannot be read, or holds nothing to identify.
    """
    if isinstance(given, Spec):
        return _problem(given, progress)
    if isinstance(given, Mapping):
        return _tables(plain(given), progress)
    if isinstance(given, str) and is_text(given):
        return _tables(tables_in(given), progress)
    path = problem_in(Path(given))
    if path.suffix.lower() != ".toml":
        return _raw(path, rate, progress)
    raw = read_toml(path)
    if isinstance(raw, Fault):
        raise ProblemFileError((raw,))
    if "model" in raw:
        return _problem(path, progress)
    text = path.read_text(encoding="utf-8") + "\n" + bare_model(raw.get("recordings", []))
    return _alone(read_text(text, path), progress)


def _tables(tables: Mapping[str, Any], progress: Progress | None) -> Source:
    if "model" in tables:
        return _problem(spec_of(tables), progress)
    model = tomllib.loads(bare_model(tables.get("recordings", [])))
    return _alone(spec_of({**tables, **model}), progress)


def _problem(given: Path | Spec, progress: Progress | None) -> Source:
    from cvxupdate.correlate.compare import geometry_of
    from cvxupdate.study import open_problem

    spec, model, recordings = open_problem(given, progress)
    geometry = geometry_of(spec, model)
    return Source(spec.name, spec.title, spec.shown, recordings, geometry, model=model)


def _alone(spec: Spec, progress: Progress | None, notes: Iterable[str] = ()) -> Source:
    """The recordings of a file without a model: nothing to check their nodes against."""
    from dataclasses import replace

    from cvxupdate.recordings.corrections import corrected
    from cvxupdate.recordings.load import load_recording
    from cvxupdate.recordings.types import TimeHistory

    out = []
    for number, declared in enumerate(spec.recordings):
        found = corrected(load_recording(declared, number, None, progress), declared.corrections)
        if isinstance(found, TimeHistory):
            found = replace(found, band=declared.band)
        out.append(found)
    return Source(spec.name, spec.title, spec.shown, tuple(out), None, tuple(notes))


def _raw(path: Path, rate: float | None, progress: Progress | None) -> Source:
    from cvxupdate.recordings.inspect import inspect_file

    found = inspect_file(path, progress=progress)
    if not found.block or found.kind not in ("frf", "time"):
        raise InputError(
            f"{path}: holds no frequency responses and no time histories that could be told from "
            f"one another ({found.kind}). 'cvxupdate inspect {path}' says what it holds; write a "
            "[[recordings]] table into a .toml file and identify that."
        )
    raw: dict[str, Any] = tomllib.loads(found.block)
    table = raw["recordings"][0]
    if found.kind == "time" and rate is not None:
        table["rate"] = float(rate)
    elif found.kind == "time" and found.rate != found.rate and "time_column" not in table:
        raise InputError(f"{path}: does not state its sampling rate. Give --rate, in Hz.")
    notes = ["read as 'cvxupdate inspect' suggests: check quantities, units and signs"]
    notes += _places(table)
    spec = read_text(_toml(table) + bare_model([table]), path)
    return _alone(spec, progress, notes)


def _places(table: dict[str, Any]) -> list[str]:
    """Gives channels that the file puts nowhere, all at one node, nodes of their own: 1, 2, …"""
    moving = [
        row for row in table.get("channels", []) if "node" in row and row["quantity"] != "force"
    ]
    labels = [(row["node"], row["dof"], row["quantity"]) for row in moving]
    if len(set(labels)) == len(labels):
        return []
    for number, row in enumerate(moving, start=1):
        row["node"] = number
    return ["the file does not say where its sensors are: they are numbered in its order"]


def _toml(table: dict[str, Any]) -> str:
    """A [[recordings]] table as text, a key a line: JSON's text, numbers and lists are TOML's."""
    lines = [f"{key} = {_value(value)}" for key, value in table.items()]
    return "\n".join(["[[recordings]]", *lines, ""])


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def bare_model(tables: Any) -> str:
    """A [model] of lumps on springs, one at every node that the recordings name: what the grammar
    asks of a file that has none. Nothing is computed with it."""
    nodes = {1}
    for table in tables if isinstance(tables, list) else []:
        for key in ("channels", "references", "corrections"):
            rows = table.get(key, []) if isinstance(table, dict) else []
            nodes |= {
                row["node"]
                for row in (rows if isinstance(rows, list) else [])
                if isinstance(row, dict) and isinstance(row.get("node"), int)
            }
    listed = sorted(n for n in nodes if n >= 0)
    places = ", ".join(f"{{ id = {n}, x = {float(k)} }}" for k, n in enumerate(listed))
    lumps = ", ".join(f"{{ id = {k}, nodes = [{n}] }}" for k, n in enumerate(listed, start=1))
    springs = ", ".join(
        f"{{ id = {k}, nodes = [{n}] }}" for k, n in enumerate(listed, start=1 + len(listed))
    )
    return (
        '\n[model]\ndofs = ["x", "y", "z", "rx", "ry", "rz"]\n'
        f"nodes = [{places}]\n"
        f'[[model.elements]]\ntype = "mass"\nm = 1.0\nrows = [{lumps}]\n'
        f'[[model.elements]]\ntype = "spring"\ndof = "x"\nk = 1.0\nrows = [{springs}]\n'
    )
