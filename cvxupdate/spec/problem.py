"""Read a problem file, say every fault, give a `Spec`."""

from __future__ import annotations

import os
import tomllib
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
from cvxupdate.spec.words import findings, translate

LARGEST = 500_000_000
"""Bytes above which a file is surely not a problem file."""


def load_problem(path: str | os.PathLike[str]) -> Spec:
    """Read a problem file and everything in it that is text.

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
    one = out["properties"]["regularisation"]
    out["properties"]["regularisation"] = {
        "anyOf": [one["items"], one],
        "description": one["description"],
    }
    return out


def _examine(path: Path) -> tuple[tuple[Fault, ...], Spec | None]:
    raw = _read(path)
    if isinstance(raw, Fault):
        return (raw,), None
    prepared = prepare(raw, path)
    places = Places(prepared)
    complaints = list(prepared.complaints)
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
                complaints += [places.original(c) for c in check(case)]
    faults = gather(complaints, places)
    return faults, None if faults else spec


def _known(complaint: Complaint, prepared: Prepared) -> bool:
    """Whether a missing table is missing only because its CSV file could not be read, which was
    said already."""
    return complaint.problem == "is missing." and any(
        c.loc[: len(complaint.loc)] == complaint.loc for c in prepared.complaints
    )


def _spec(path: Path, parsed: ProblemFile) -> Spec:
    absolute = Path(os.path.abspath(path))
    name = absolute.parent.name if absolute.name == "problem.toml" else absolute.stem
    return Spec(
        path,
        name or "problem",
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


def _read(path: Path) -> dict[str, Any] | Fault:
    """The parsed TOML, or the one fault that keeps it from being read."""

    def fault(problem: str, remedy: str, key: str = "") -> Fault:
        return Fault(str(path), key, problem, remedy)

    if "\0" in str(path):
        return fault("holds a NUL character, so it names no file.", "Correct the name.")
    if os.path.isdir(path):
        inside = path / "problem.toml"
        return fault(
            "is a folder.",
            f"Name the problem file in it: {inside}."
            if inside.is_file()
            else "Name a problem file.",
        )
    try:
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
        return tomllib.loads(text)
    except RecursionError:
        return fault("is nested too deeply.", "A problem file needs four levels at most.")
    except ValueError as error:  # TOMLDecodeError, or an integer of thousands of digits
        return fault(
            f"is not valid TOML: {error}.",
            "Correct that place; quotes, brackets and commas are the usual causes.",
        )
