"""Take the broken pieces out of a problem file, so that the rest can be checked in the same go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from cvxupdate.keys import Loc
from cvxupdate.spec.grammar import ProblemFile, grammar
from cvxupdate.spec.places import Places
from cvxupdate.spec.prepare import Prepared, section_of
from cvxupdate.spec.words import strip_tags


def prune(prepared: Prepared, tagged: Sequence[Loc], places: Places) -> ProblemFile | None:
    """The problem file without the pieces at ``tagged``; None when too little is left to be
    checked.

    The sections that lost something are added to ``prepared.damaged``, and the original indices to
    ``places.kept``.
    """
    doomed: set[Loc] = set()
    for loc in map(strip_tags, tagged):
        piece = _piece(loc, prepared.data)
        if piece is None:
            return None
        doomed.add(piece)
        prepared.damaged.add(section_of(piece))
    for block in {d[:3] for d in doomed if len(d) == 5 and d[:2] == ("model", "elements")}:
        rows = prepared.data["model"]["elements"][block[2]]["rows"]
        if all((*block, "rows", i) in doomed for i in range(len(rows))):
            doomed.add(block)
    data = _without(prepared.data, (), doomed, places.kept)
    try:
        return grammar().model_validate(data)
    except ValidationError:
        return None


def _piece(loc: Loc, data: Any) -> Loc | None:
    """The smallest piece around a fault that can go: a row, an entry of a list of tables, a named
    table."""
    here, last = data, None
    for i, step in enumerate(loc):
        if (
            isinstance(step, int)
            and isinstance(here, tuple)
            and step < len(here)
            and isinstance(here[step], dict)
        ):
            last = loc[: i + 1]
        try:
            here = here[step]
        except (KeyError, IndexError, TypeError):
            break
    if last is not None:
        return last
    if loc[:1] != ("model",):
        return loc[:1] if loc and loc[0] != "model" else None
    if len(loc) > 2 and loc[1] in ("materials", "sections"):
        return loc[:3]
    if len(loc) > 1 and (
        loc[1] == "damping" or loc[1] not in ("dofs", "nodes", "elements", "materials", "sections")
    ):
        return loc[:2]
    return None


def _without(value: Any, at: Loc, doomed: set[Loc], kept: dict[Loc, list[int]]) -> Any:
    near = [d for d in doomed if d[: len(at)] == at]
    if not near:
        return value
    if isinstance(value, dict):
        return {
            k: _without(v, (*at, k), doomed, kept)
            for k, v in value.items()
            if (*at, k) not in doomed
        }
    if isinstance(value, tuple):
        steps = {d[len(at)] for d in near if len(d) > len(at)}
        gone = {d[-1] for d in near if len(d) == len(at) + 1}
        left = [i for i in range(len(value)) if i not in gone]
        if gone:
            kept[at] = left
        return tuple(
            _without(value[i], (*at, i), doomed, kept) if i in steps else value[i] for i in left
        )
    return value
