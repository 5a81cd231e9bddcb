"""``include`` of a [model]: a file that holds a [model], read and merged under the one that names
it.

The rule: lists (`nodes`, `elements`, `supports`, `ties`, `families`) are appended, the included
entries first; `materials` and `sections` are merged by name, and a name given again replaces the
included entry whole; any other key given again replaces the included value.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cvxupdate.errors import Fault
from cvxupdate.keys import Loc
from cvxupdate.spec.read import read_toml
from cvxupdate.spec.tables import Source, unusable

LISTED = ("nodes", "elements", "supports", "ties", "families")
NAMED = ("materials", "sections")
DEEPEST = 4
"""Files that may lie under one another; more could only confuse."""


@dataclass(frozen=True)
class Refusal:
    """Why a file cannot be included; ``here``: the fault is in the file that includes, else in the
    one that is included."""

    here: bool
    loc: Loc
    problem: str
    remedy: str


def included(name: str, above: tuple[Path, ...]) -> dict[str, Any] | Refusal:
    """The tables of the file that ``include = name`` says in the last file of ``above``, only
    [model] among them."""
    path = above[-1].parent / name
    at: Loc = ("model", "include")
    wrong = unusable(path, None)
    if wrong is not None:
        return Refusal(True, at, *wrong)
    if any(os.path.samefile(path, p) for p in above):
        chain = " → ".join(p.name for p in (*above, path))
        return Refusal(True, at, f"goes in a circle: {chain}.", "Take one `include` out.")
    if len(above) > DEEPEST:
        return Refusal(
            True,
            at,
            f"'{name}' would be more than {DEEPEST} files under {above[0].name}.",
            "Write fewer files, or include the last one directly.",
        )
    raw = read_toml(path)
    if isinstance(raw, Fault):
        return Refusal(False, (), raw.problem, raw.remedy)
    for key in raw:
        if key != "model":
            return Refusal(
                False,
                (key,),
                f"`{key}` cannot stand in an included file.",
                "An included file holds [model] and nothing else; put it into the problem file.",
            )
    if not isinstance(raw["model"], dict):
        return Refusal(False, ("model",), "is not a table.", "Give a table.")
    return raw


def placed(model: Mapping[str, Any], source: Source) -> dict[Loc, tuple[Source, Loc]]:
    """Every key and entry of a [model] that stands in one file, with its place there."""
    out: list[Loc] = []
    for key, value in model.items():
        out.append(("model", key))
        if key in LISTED and isinstance(value, list):
            out += [("model", key, i) for i in range(len(value))]
        elif key in NAMED and isinstance(value, dict):
            out += [("model", key, name) for name in value]
    return {loc: (source, loc) for loc in out}


def merge(
    under: Mapping[str, Any],
    under_places: Mapping[Loc, tuple[Source, Loc]],
    over: Mapping[str, Any],
    over_places: Mapping[Loc, tuple[Source, Loc]],
) -> tuple[dict[str, Any], dict[Loc, tuple[Source, Loc]]]:
    """The included [model] ``under`` with what ``over`` adds or replaces, and where each entry came
    from. A faulty included list or table stays, so that its fault is said."""
    model, places = dict(under), dict(under_places)
    for key, value in over.items():
        old = model.get(key)
        if key in LISTED and isinstance(old, list) and isinstance(value, list):
            model[key] = [*old, *value]
            for i in range(len(value)):
                places[("model", key, len(old) + i)] = over_places[("model", key, i)]
        elif key in NAMED and isinstance(old, dict) and isinstance(value, dict):
            model[key] = {**old, **value}
            for name in value:
                places[("model", key, name)] = over_places[("model", key, name)]
        elif old is None or key not in (*LISTED, *NAMED) or not isinstance(value, (list, dict)):
            model[key] = value
            places = {loc: at for loc, at in places.items() if loc[:2] != ("model", key)}
            places |= {loc: at for loc, at in over_places.items() if loc[:2] == ("model", key)}
    return model, places
