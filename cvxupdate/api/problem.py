"""A problem put together in a program: a model, recordings, and what is to be done."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from cvxupdate.api.frf import Frf
from cvxupdate.api.held import carried
from cvxupdate.api.model import Model
from cvxupdate.api.modes import Modes
from cvxupdate.api.time_history import TimeHistory
from cvxupdate.errors import InputError
from cvxupdate.registry import CONSTRAINTS, REGULARISERS
from cvxupdate.spec import Spec, spec_of
from cvxupdate.spec.given import UNTITLED, named, plain
from cvxupdate.spec.grammar import Own
from cvxupdate.spec.write import Written, compacted, tables_of

Recorded = Frf | TimeHistory | Modes


class Problem:
    """A model, recordings, and what is to be done with them: what a problem file holds.

    Parameters
    ----------
    model : a `Model`, or a [model] table.
    recordings : `Frf`, `TimeHistory`, `Modes`, or [[recordings]] tables; one or a list.
    update : the [update] table: ``{"parameters": ["root: E"]}`` with what may change as `update`
        takes it, in words or as rows; "method" may be left out, as there.
    constraints, regularisers : tables of [constraints] ({"bounds": {…}}) and [regularisation]
        ({"kind": "l1"}), or objects: a constraint has ``clauses(columns)``, a regulariser
        ``expression(p)`` and ``value(p)`` (`cvxupdate.convex.Constraint`, `Regulariser`).
    loss : an object with ``expression(r)``, instead of the one that ``update`` names.
    further : title, source, solver, diagnose, as the tables of a problem file.

    Raises
    ------
    InputError
        With every fault, as `check` says them.
    """

    def __init__(
        self,
        model: Any,
        recordings: Any = (),
        *,
        update: Mapping[str, Any] | None = None,
        constraints: Any = (),
        regularisers: Any = (),
        loss: Any = None,
        name: str = UNTITLED,
        **further: Any,
    ) -> None:
        given = listed(recordings)
        _refuse_tables(update, further)
        own_clauses, clauses = _split(constraints, "constraints")
        own_penalties, penalties = _split(regularisers, "regularisers")
        tables = {
            **further,
            "model": model.table() if isinstance(model, Model) else model,
            "recordings": [recording_table(r, i) for i, r in enumerate(given)],
            "update": update_table(update, given),
            "constraints": _joined(clauses),
            "regularisation": penalties,
        }
        spec = spec_of({k: v for k, v in tables.items() if v not in (None, [], {}, ())})
        own = Own(own_clauses, own_penalties, loss)
        self._spec = named(replace(spec, own=own), name)
        self._keep = (model, tuple(given))

    @property
    def spec(self) -> Spec:
        """The problem as the commands take it."""
        return self._spec

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write problem.toml into ``folder``, arrays beside it in data/; gives its path. The
        command line runs it as it is.

        Raises
        ------
        InputError
            When it cannot be written, or an object takes part that no file can hold.
        """
        if self._spec.own != Own():
            raise InputError(
                "this problem has constraints, regularisers or a loss of its own, which a file "
                "cannot hold. Register their class (cvxupdate.registry) and name it in the tables."
            )
        return save_spec(self._spec, Path(folder))

    def __repr__(self) -> str:
        kinds = ", ".join(r.kind for r in self._spec.recordings) or "no recording"
        nodes = len(self._spec.model.nodes)
        return f"Problem({self._spec.name!r}: {nodes} nodes; {kinds})"


def save_spec(spec: Spec, folder: Path) -> Path:
    """problem.toml of a problem in ``folder``, kept arrays copied beside it."""
    tables = carried(compacted(tables_of(spec)), folder)
    path = folder / "problem.toml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(Written(tables, ()).text_in(folder), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}).") from error
    return path


def given_problem(problem: Any, recordings: Any, **tables: Any) -> tuple[Spec, Any]:
    """What the commands take, as a `Spec`, and what its files live by: a `Problem`, a problem in
    any other form, or a `Model` with recordings and ``tables``.

    Raises
    ------
    InputError
        When a model comes without recordings, or recordings with a whole problem.
    """
    if isinstance(problem, Model):
        if recordings is None:
            raise InputError("a model alone is no problem. Give recordings as well.")
        made = Problem(problem, recordings, **tables)
        return made.spec, made
    if recordings is not None:
        raise InputError("recordings were given with a problem that has its own. Give a Model.")
    more = {k: v for k, v in tables.items() if v is not None}
    spec, keep = (
        (problem.spec, problem) if isinstance(problem, Problem) else (spec_of(problem), None)
    )
    if more:
        own, whole = spec.own, {**tables_of(spec), **more}
        if "update" in more:
            whole["update"] = update_table(more["update"], whole.get("recordings", ()))
        spec = replace(spec_of(whole), own=own, name=spec.name)
    return spec, keep


def listed(recordings: Any) -> list[Any]:
    """Recordings as a list; one alone may be given without."""
    if recordings is None:
        return []
    if isinstance(recordings, Recorded | Mapping):
        return [recordings]
    if isinstance(recordings, str | os.PathLike) or not isinstance(recordings, Sequence):
        raise InputError(
            f"recordings: {type(recordings).__name__} is none. Give Frf, TimeHistory, Modes (each "
            "has from_file), or tables of [[recordings]]."
        )
    return list(recordings)


def recording_table(recording: Any, number: int = 0) -> dict[str, Any]:
    """The [[recordings]] table of what was given."""
    if isinstance(recording, Recorded):
        kind = type(recording).__name__
        return {"name": f"{kind} {number + 1}", **recording.table()}
    if isinstance(recording, Mapping):
        return dict(plain(recording, f"recordings[{number}]"))
    raise InputError(
        f"recordings[{number}]: a {type(recording).__name__} is no recording. Give Frf, "
        "TimeHistory, Modes or a table of [[recordings]]."
    )


def update_table(update: Any, recordings: Sequence[Any]) -> Any:
    """[update] as a file has it: parameters that are given in words as rows, and a method."""
    if not isinstance(update, Mapping):
        return update
    given = update.get("parameters")
    rows = {"parameters": parameter_rows(given)} if isinstance(given, str | list | tuple) else {}
    return {"method": _method(recordings), **update, **rows}


def _method(recordings: Sequence[Any]) -> str:
    """What suits the recordings: rfm for responses, sensitivity for modes with shapes, else
    frequencies."""
    kinds = {
        "modes"
        if isinstance(r, Modes)
        else str(r.get("kind"))
        if isinstance(r, Mapping)
        else "response"
        for r in recordings
    }
    if kinds - {"modes"}:
        return "rfm"
    shaped = any(isinstance(r, Modes) and r.shapes is not None for r in recordings)
    return "sensitivity" if shaped else "frequencies"


def parameter_rows(parameters: Any) -> list[Any]:
    """[update] parameters: rows as in a problem file, or in words, ``"column: E"`` (a group and a
    property), ``"all: stiffness"`` (one for each element).

    Raises
    ------
    InputError
        For a text without a colon.
    """
    given = [parameters] if isinstance(parameters, str | Mapping) else list(parameters or ())
    out: list[Any] = []
    for one in given:
        if not isinstance(one, str):
            out.append(one)
            continue
        group, colon, of = (part.strip() for part in one.rpartition(":"))
        if not colon or not group or not of:
            raise InputError(
                f'parameters: {one!r} is not understood. Write "group: property", e.g. '
                '"column: E", or a row such as {"group": "column", "of": "E"}.'
            )
        every = {"elements": "all", "each": "element"}
        out.append({**(every if group == "all" else {"group": group}), "of": of})
    return out


ARGUMENTS = {"regularisation": "regularisers", "regularizers": "regularisers"}
"""Names of tables of a problem file, and spellings, and the arguments that they are here."""


def _refuse_tables(*given: Mapping[str, Any] | None) -> None:
    """Keys that are another argument's name."""
    for name, argument in ARGUMENTS.items():
        if any(table is not None and name in table for table in given):
            raise InputError(
                f"{name}: is no argument. Did you mean {argument}? For example "
                f'{argument}={{"kind": "tikhonov", "weight": 1.0}}.'
            )


def _split(given: Any, what: str) -> tuple[tuple[Any, ...], list[Mapping[str, Any]]]:
    """Objects, and tables."""
    items = (
        [given] if isinstance(given, Mapping) or not isinstance(given, Sequence) else list(given)
    )
    if given is None:
        return (), []
    objects = tuple(o for o in items if not isinstance(o, Mapping))
    needed = "clauses" if what == "constraints" else "expression"
    for one in objects:
        if isinstance(one, type) or not callable(getattr(one, needed, None)):
            raise InputError(
                f"{what}: {one!r} is none. Give tables as in a problem file, or objects with "
                f"{needed}(…). Tables have the keys {', '.join(_known(what))}."
            )
    return objects, [t for t in items if isinstance(t, Mapping)]


def _known(what: str) -> list[str]:
    if what == "constraints":
        return sorted({key for kind in CONSTRAINTS.members() for key in kind.keys})
    return ["kind", "weight", *REGULARISERS.names()]


def _joined(tables: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """[constraints] of several tables; the lists of one key go together."""
    out: dict[str, Any] = {}
    for table in tables:
        for key, value in table.items():
            if key in out and isinstance(value, list) and isinstance(out[key], list):
                out[key] = [*out[key], *value]
            elif key in out:
                raise InputError(f"constraints: {key} is given twice. Give it once.")
            else:
                out[key] = value
    return out
