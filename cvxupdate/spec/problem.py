"""Read a problem file, say every fault, give a `Spec`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cvxupdate.errors import Fault, ProblemFileError
from cvxupdate.registry import ELEMENTS
from cvxupdate.spec.checks import CHECKS
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import inherited, row_model
from cvxupdate.spec.grammar import ProblemFile, Spec, grammar
from cvxupdate.spec.places import Places, gather
from cvxupdate.spec.prepare import Complaint, Prepared, prepare
from cvxupdate.spec.prune import prune
from cvxupdate.spec.read import problem_in, read_toml
from cvxupdate.spec.toml import toml_tables
from cvxupdate.spec.words import findings, translate


def load_problem(path: str | os.PathLike[str]) -> Spec:
    """Read a problem file and everything in it that is text; of a folder, its problem.toml.

    Raises
    ------
    ProblemFileError
        With every fault of the file (and of the files it names) at once.
    """
    faults, spec = _examine(Path(path))
    if faults or spec is None:
        raise ProblemFileError(faults)
    return spec


def check_problem(path: str | os.PathLike[str]) -> tuple[Fault, ...]:
    """Every fault of a problem file, in the order of the file; empty when it holds."""
    return _examine(Path(path))[0]


def read_text(text: str, path: str | os.PathLike[str]) -> Spec:
    """A problem file that is at hand as text; relative paths in it are relative to ``path``'s
    folder.

    Raises
    ------
    ProblemFileError
        With every fault at once.
    """
    return load_tables(toml_tables(text), path)


def load_tables(tables: dict[str, Any], path: str | os.PathLike[str]) -> Spec:
    """A problem whose tables are at hand; relative paths in them are relative to ``path``'s folder.

    Raises
    ------
    ProblemFileError
        With every fault at once.
    """
    faults, spec = _parsed(tables, Path(path))
    if faults or spec is None:
        raise ProblemFileError(faults)
    return spec


def check_text(text: str, path: str | os.PathLike[str]) -> tuple[Fault, ...]:
    """Every fault of a problem file that is at hand as text."""
    return _parsed(toml_tables(text), Path(path))[0]


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of problem files, for editors and other programs."""
    out = grammar().model_json_schema()
    out = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **out,
        "title": "cvxupdate problem file",
    }
    # A row may leave out what its block gives.
    for kind in ELEMENTS.members():
        part = out["$defs"][row_model(kind.text.block).__name__]
        given = inherited(kind.name)
        part["required"] = [key for key in part.get("required", []) if key not in given]
    model = out["$defs"]["Model"]
    model["anyOf"] = [{"required": model.pop("required")}, {"required": ["include"]}]
    one = out["properties"]["regularisation"]
    out["properties"]["regularisation"] = {
        "anyOf": [one["items"], one],
        "description": one["description"],
    }
    return out


def _examine(path: Path) -> tuple[tuple[Fault, ...], Spec | None]:
    path = problem_in(path)
    raw = read_toml(path)
    return ((raw,), None) if isinstance(raw, Fault) else _parsed(raw, path)


def _parsed(raw: dict[str, Any], path: Path) -> tuple[tuple[Fault, ...], Spec | None]:
    prepared = prepare(raw, path)
    places = Places(prepared)
    complaints = list(prepared.complaints)
    if prepared.incomplete:  # without the whole [model] every other complaint would be a guess
        return gather(complaints, places), None
    try:
        parsed: ProblemFile | None = grammar().model_validate(prepared.data)
    except ValidationError as error:
        details = findings(error)
        complaints += [c for c in translate(details, prepared) if not _known(c, prepared)]
        parsed = prune(prepared, [d["loc"] for d in details], places)
    spec = None
    if parsed is not None:
        spec = _spec(path, parsed)
        case = Case(spec, frozenset(prepared.damaged))
        for check in CHECKS:
            if not set(check.needs) & prepared.damaged:
                complaints += places.sought(check(case))
    faults = gather(complaints, places)
    return faults, None if faults else spec


def _known(complaint: Complaint, prepared: Prepared) -> bool:
    """Whether a missing table is missing only because its CSV file could not be read, which was
    said already."""
    source, loc = prepared.origin(complaint.loc)
    return complaint.problem == "is missing." and any(
        (c.source or prepared.source) == source and c.loc[: len(loc)] == loc
        for c in prepared.complaints
    )


def name_of(path: Path) -> str:
    """What a problem is called: its file, or the folder of a problem.toml."""
    absolute = Path(os.path.abspath(path))
    return (absolute.parent.name if absolute.name == "problem.toml" else absolute.stem) or "problem"


def _spec(path: Path, parsed: ProblemFile) -> Spec:
    return Spec(
        path,
        name_of(path),
        parsed.title,
        parsed.source,
        parsed.model,
        parsed.recordings,
        parsed.update,
        parsed.constraints,
        parsed.regularisation,
        parsed.solver,
        parsed.diagnose,
    )
