"""A problem in whatever form it is given: the path of a file, TOML text, tables, a `Spec`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cvxupdate.errors import Fault, InputError, ProblemFileError
from cvxupdate.spec.grammar import Spec
from cvxupdate.spec.problem import load_problem, load_tables
from cvxupdate.spec.toml import toml_tables
from cvxupdate.spec.update import Update
from cvxupdate.spec.write import tables_of, to_toml

Given = str | os.PathLike[str] | Mapping[str, Any] | Spec
"""A path, TOML text, the tables of a problem file as a dictionary, or a problem that was read."""

DEEPEST = 30
"""Levels of a dictionary: a problem has nine at most, and one that holds itself has no end."""
UNNAMED = Path("problem")
"""What messages call a problem without a file."""
UNTITLED = "model"
"""Its name in results, where it has no title and none is given."""


def spec_of(problem: Given) -> Spec:
    """A problem in any of its forms, read and checked.

    A text with a line break or an equals sign is TOML (unless a file is called so), every other one
    a path; paths in text and tables are relative to the working directory. Arrays and tables of
    pandas may stand for lists.

    Raises
    ------
    ProblemFileError
        With every fault at once.
    InputError
        When it is none of these.
    """
    if isinstance(problem, Spec):
        return problem
    if isinstance(problem, Mapping):
        return named(load_tables(plain(problem), UNNAMED), UNTITLED)
    if isinstance(problem, str) and is_text(problem):
        return named(load_tables(tables_in(problem), UNNAMED), UNTITLED)
    if isinstance(problem, str | os.PathLike):
        return load_problem(Path(problem))
    raise InputError(
        f"a {type(problem).__name__} is no problem. Give the path of a problem file, its text, its "
        "tables as a dictionary, or a Model with recordings."
    )


def to_update(spec: Spec, command: str) -> tuple[Spec, Update]:
    """A problem with the [update] table and the recordings that a command needs, said before the
    recordings are read.

    Raises
    ------
    InputError
        Where it has none of them.
    """
    if spec.update is None:
        raise InputError(
            f"{spec.path}: {command} needs an [update] table. Add one with a method and parameters."
        )
    if not spec.recordings:
        raise InputError(
            f"{spec.path}: there are no recordings, so [update] has nothing to fit. Add "
            "[[recordings]]; 'cvxupdate plan' says what to measure."
        )
    return spec, spec.update


def is_text(problem: str) -> bool:
    """Whether a string is the text of a problem file, not its path."""
    return "\n" in problem or ("=" in problem and not os.path.exists(problem))


def named(spec: Spec, name: str) -> Spec:
    """The same problem under another name."""
    return replace(spec, name=name)


def again(spec: Spec) -> str:
    """What opens the same problem in another process: its file, or its text."""
    return str(spec.path) if spec.path.is_file() else to_toml(tables_of(spec))


def tables_in(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises
    ------
    ProblemFileError
        When it is not TOML.
    """

    def fault(problem: str, remedy: str) -> ProblemFileError:
        return ProblemFileError([Fault(str(UNNAMED), "", problem, remedy)])

    try:
        return toml_tables(text)
    except RecursionError:
        raise fault("is nested too deeply.", "A problem needs four levels at most.") from None
    except ValueError as error:
        raise fault(
            f"is not valid TOML: {error}.",
            "Correct that place; quotes, brackets and commas are the usual causes.",
        ) from None


def plain(value: Any, key: str = "", depth: int = 0) -> Any:
    """Tables with what Python programs put into them as what TOML has: arrays and tuples as lists,
    numbers of numpy as numbers, paths as text, a table of pandas as rows; None is an absent key.

    Raises
    ------
    InputError
        For something that has no place in a problem, with its key.
    """
    if depth > DEEPEST:
        raise InputError(f"{key or 'the problem'}: is nested too deeply. Does it hold itself?")
    if isinstance(value, Mapping):
        return {
            _key(k, key): plain(v, f"{key}.{k}" if key else str(k), depth + 1)
            for k, v in value.items()
            if v is not None
        }
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, list | tuple):
        return [plain(v, f"{key}[{i}]", depth + 1) for i, v in enumerate(value)]
    return _foreign(value, key, depth)


def _key(name: Any, key: str) -> str:
    if isinstance(name, str):
        return name
    if isinstance(name, int) and not isinstance(name, bool):
        return str(name)  # a node number of node_map
    raise InputError(f"{key or 'the problem'}: the key {name!r} is no text. Write it as text.")


def _foreign(value: Any, key: str, depth: int) -> Any:
    """Arrays and tables of other packages, told by what they can do: none has to be loaded."""
    rows = getattr(value, "to_dict", None)
    if callable(rows) and getattr(value, "columns", None) is not None:
        return [
            {str(k): plain(v, f"{key}[{i}].{k}", depth + 1) for k, v in row.items() if v == v}
            for i, row in enumerate(rows("records"))
        ]
    for turn in ("tolist", "item"):
        turned = getattr(value, turn, None)
        if callable(turned):
            made = turned()
            if isinstance(made, str | bool | int | float | complex | list):
                return plain(made, key, depth + 1)
    raise InputError(
        f"{key or 'the problem'}: a {type(value).__name__} has no place in a problem. Give text, "
        "numbers, lists, arrays or dictionaries."
    )
