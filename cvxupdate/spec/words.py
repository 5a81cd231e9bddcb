"""Pydantic's findings in our words: place, value, remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from cvxupdate.keys import Loc
from cvxupdate.spec.elements import inherited
from cvxupdate.spec.grammar import ProblemFile, grammar
from cvxupdate.spec.prepare import Complaint, Prepared

_TYPES = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": 'text in quotes ("…")',
    "bool_type": "true or false",
    "tuple_type": "a list […]",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "is_instance_of": 'a file name in quotes ("…")',
    "path_type": 'a file name in quotes ("…")',
}
_LIMITS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
_KINDS_OF_TEXT = ("type", "kind", "shape")


def show(value: Any) -> str:
    """A value as it would stand in the file, cut to one short line."""
    try:
        text = _toml(value)
    except (ValueError, RecursionError):
        text = f"a {type(value).__name__}"
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_toml(v) for v in value[:12]) + ("…]" if len(value) > 12 else "]")
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join(f"{k} = {_toml(v)}" for k, v in list(value.items())[:6])
            + ("…}" if len(value) > 6 else "}")
        )
    return repr(value) if isinstance(value, str) else str(value)


def nearest(wrong: object, names: Iterable[object], what: str = "") -> str:
    """The remedy for a name that does not exist: the nearest one, and the list when it is short."""
    known = sorted({str(n) for n in names})
    close = difflib.get_close_matches(str(wrong), known, n=1, cutoff=0.6) or [
        k for k in known if k.lower() == str(wrong).lower()
    ]
    if close:
        return f"Did you mean '{close[0]}'?"
    if not known:
        return f"There is no {what} at all." if what else ""
    listed = ", ".join(known[:12]) + (", …" if len(known) > 12 else "")
    return f"Known: {listed}."


def strip_tags(loc: Loc) -> Loc:
    """Pydantic names the branch of a union inside the place; the file does not."""
    out = list(loc)
    for at, where in (
        (3, loc[:2] == ("model", "elements")),
        (3, loc[:2] == ("model", "sections")),
        (2, loc[:2] == ("model", "damping")),
        (2, loc[:1] == ("recordings",)),
    ):
        if where and len(out) > at:
            del out[at]
    return tuple(out)


def findings(error: ValidationError) -> list[ErrorDetails]:
    """What pydantic found, without lists that are too short only because their items are faulty."""
    details = error.errors(include_url=False)
    return [
        d for d in details if d["type"] != "too_short" or len(d["input"]) < d["ctx"]["min_length"]
    ]


def translate(errors: Sequence[ErrorDetails], prepared: Prepared) -> list[Complaint]:
    """One complaint for each finding; what rows have from their block is complained of once, at the
    block."""
    complaints: list[Complaint] = []
    seen: set[tuple[Loc, str]] = set()
    missing: dict[tuple[Loc, str], list[int]] = {}
    for error in errors:
        loc = strip_tags(error["loc"])
        row = _row_of(loc)
        if row is not None:
            block, index, key = row
            if index in prepared.inherited.get(block, {}).get(key, frozenset()):
                loc = (*block, key, *loc[6:])
            elif (
                error["type"] == "missing"
                and len(loc) == 6
                and key in _inheritable(prepared, block)
            ):
                missing.setdefault((block, key), []).append(index)
                continue
        said = _say(error, loc, prepared)
        if (loc, said[0]) not in seen:
            seen.add((loc, said[0]))
            complaints.append(Complaint(loc, *said))
    for (block, key), rows in missing.items():
        everywhere = len(rows) > 1 and len(rows) == len(_get(prepared.data, (*block, "rows")))
        places: list[Loc] = (
            [(*block, key)] if everywhere else [(*block, "rows", i, key) for i in rows]
        )
        complaints += [
            Complaint(p, "is missing.", f"Give `{key}` on the row, or once on the block.")
            for p in places
        ]
    return complaints


def _say(error: ErrorDetails, loc: Loc, prepared: Prepared) -> tuple[str, str]:
    kind, value, ctx = error["type"], error["input"], error.get("ctx", {})
    key = loc[-1] if loc else ""
    if kind == "missing":
        return "is missing.", f"Add `{key} = …`: {_meaning(error['loc'])}." if _meaning(
            error["loc"]
        ) else f"Add `{key}`."
    if kind == "extra_forbidden":
        return f"unknown key '{key}' (value {show(value)}).", nearest(
            key, _known_keys(error["loc"][:-1])
        )
    if kind == "finite_number":
        return (
            f"{show(value)} is not a finite number.",
            "Give a finite value, or leave the key out if it is unknown.",
        )
    if kind in _TYPES:
        return f"{show(value)} is not {_TYPES[kind]}.", _type_remedy(kind, value)
    if kind in _LIMITS:
        name, words = _LIMITS[kind]
        limit = ctx[name]
        what = "is negative" if limit == 0 and _is_negative(value) else "is out of range"
        return f"{show(value)} {what}.", f"It must be {words} {limit:g}."
    if kind == "literal_error":
        return f"{show(value)} is not one of the words allowed here.", _literal_remedy(
            value, str(ctx["expected"])
        )
    if kind == "one_of":
        return f"{show(value)} cannot stand here.", f"Give {ctx['wanted']}."
    if kind == "union_tag_not_found":
        word = str(ctx["discriminator"]).strip("'")
        if not isinstance(value, dict):
            return f"{show(value)} is not a table.", f"Give a table with `{word}`."
        return f"`{word}` is missing.", f"Say which `{word}` it is: {_tags(error['loc'])}."
    if kind == "union_tag_invalid":
        word = str(ctx["discriminator"]).strip("'")
        return f"unknown {word} {show(ctx['tag'])}.", _literal_remedy(
            ctx["tag"], str(ctx["expected_tags"])
        )
    if kind in ("too_short", "too_long"):
        least = kind == "too_short"
        limit = ctx["min_length"] if least else ctx["max_length"]
        count = ctx["actual_length"]
        if count == 0 and limit == 1:
            return "is empty.", "Give at least one entry."
        return (
            f"has {count} entries: {show(value)}.",
            f"It must have at {'least' if least else 'most'} {limit}.",
        )
    if kind == "string_too_short":
        return "is empty text.", "Give a name, or leave the key out."
    return f"{show(value)} cannot stand here: {error['msg']}.", "See docs/problem-files.md."


def _is_negative(value: Any) -> bool:
    return isinstance(value, int | float) and value < 0


def _type_remedy(kind: str, value: Any) -> str:
    if kind in ("float_type", "int_type"):
        if isinstance(value, str):
            return "Write the number without quotes."
        if isinstance(value, bool):
            return "true and false are not numbers."
        if isinstance(value, int):
            return "The number is too large."
    return f"Give {_TYPES[kind]}."


def _literal_remedy(value: Any, expected: str) -> str:
    words = [w.strip().strip("'\"") for w in expected.replace(" or ", ", ").split(",")]
    close = difflib.get_close_matches(str(value), words, n=1, cutoff=0.6)
    hint = f"Did you mean '{close[0]}'? " if close else ""
    return f"{hint}Allowed: {', '.join(words)}."


def _row_of(loc: Loc) -> tuple[Loc, int, str] | None:
    """(block, row index, key) of a place inside a row of an element block."""
    if len(loc) >= 6 and loc[:2] == ("model", "elements") and loc[3] == "rows":
        return loc[:3], int(loc[4]), str(loc[5])
    return None


def _inheritable(prepared: Prepared, block: Loc) -> tuple[str, ...]:
    return inherited(str(_get(prepared.data, (*block, "type"))))


def _get(data: Any, loc: Loc) -> Any:
    for step in loc:
        data = data[step]
    return data


def _schema() -> dict[str, Any]:
    return _schema_of(grammar())


@lru_cache(maxsize=8)
def _schema_of(file: type[ProblemFile]) -> dict[str, Any]:
    return file.model_json_schema()


def _at(loc: Loc) -> dict[str, Any]:
    """The piece of the JSON Schema at a place (union tags included); {} when the place is
    unknown."""
    root = _schema()
    here = root
    for step in loc:
        here = _deref(here)
        if isinstance(step, int):
            here = here.get("items") or _prefix(here, step)
        elif step in here.get("properties", {}):
            here = here["properties"][step]
        elif step in here.get("discriminator", {}).get("mapping", {}):
            here = {"$ref": here["discriminator"]["mapping"][step]}
        else:
            here = here.get("additionalProperties") or {}
        if not isinstance(here, dict):
            return {}
    return here if "description" in here else _deref(here)


def _prefix(here: dict[str, Any], step: int) -> dict[str, Any]:
    items: list[dict[str, Any]] = here.get("prefixItems", [])
    return items[step] if step < len(items) else {}


def _deref(here: dict[str, Any]) -> dict[str, Any]:
    """Through references, and into the branch of an optional or a table that has structure."""
    while True:
        if "$ref" in here:
            here = _schema()["$defs"][here["$ref"].split("/")[-1]]
        elif "anyOf" in here:
            branches = [b for b in here["anyOf"] if b.get("type") != "null"]
            here = next(
                (b for b in branches if b.get("type") == "array" or "$ref" in b or "anyOf" in b),
                branches[0],
            )
        else:
            return here


def _known_keys(loc: Loc) -> list[str]:
    return list(_deref(_at(loc)).get("properties", {}))


def _meaning(loc: Loc) -> str:
    return str(_at(loc).get("description", "")).split("\n")[0].rstrip(".")


def _tags(loc: Loc) -> str:
    return ", ".join(_deref(_at(loc)).get("discriminator", {}).get("mapping", {}))
