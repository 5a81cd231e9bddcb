"""Tables of the grammar in Markdown, straight from the models: ``python -m cvxupdate.spec.describe
docs/problem-files.md``.

The page holds ``<!-- keys: Node -->`` … ``<!-- end -->``; what stands between is written anew, and
a test compares. So are the table of what a parameter may change (``<!-- properties -->``) and, for
parts that the page names nowhere, whole sections (``<!-- others -->``): a new element or constraint
needs no word here.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from cvxupdate.registry import ELEMENTS
from cvxupdate.spec.grammar import grammar
from cvxupdate.spec.problem import schema

_MARKED = re.compile(r"<!-- keys: (?P<name>\w+) -->\n.*?<!-- end -->", re.DOTALL)
_PROPERTIES = re.compile(r"<!-- properties -->\n.*?<!-- end -->", re.DOTALL)
_OTHERS = re.compile(r"<!-- others -->\n.*?<!-- end others -->", re.DOTALL)
_WORDS = {
    "number": "number",
    "integer": "integer",
    "string": "text",
    "boolean": "true/false",
    "null": "",
}


def fill(page: str) -> str:
    """The page with every marked table written anew.

    Raises
    ------
    KeyError
        When the page asks for a table that the grammar does not have.
    """
    whole, rows = schema(), grammar().model_json_schema()["$defs"]
    others = [name for name in whole["$defs"] if name not in described(_OTHERS.sub("", page))]
    page = _PROPERTIES.sub(lambda m: f"<!-- properties -->\n{_properties()}\n<!-- end -->", page)
    page = _OTHERS.sub(lambda m: _sections(whole, others), page)
    return _MARKED.sub(
        lambda m: f"<!-- keys: {m['name']} -->\n{_table(whole, rows, m['name'])}\n<!-- end -->",
        page,
    )


def _properties() -> str:
    said: dict[tuple[str, ...], list[str]] = {}
    for kind in ELEMENTS.members():
        said.setdefault(kind.text.changes, []).append(kind.name)
    rows = [f"| {', '.join(names)} | {' '.join(of)} |" for of, names in said.items()]
    return "\n".join(["| type | `of` |", "|---|---|", *rows])


def _sections(whole: dict[str, Any], names: list[str]) -> str:
    made = ["<!-- others -->"]
    for name in names:
        meaning = " ".join(whole["$defs"][name].get("description", "").split())
        head = f"\n### {_shown(name)}\n\n{meaning}\n"
        made.append(f"{head}\n<!-- keys: {name} -->\n\n<!-- end -->\n")
    return "\n".join([*made, "<!-- end others -->"])


def _shown(name: str) -> str:
    """The heading of a part; the tables of constraints are called after their constraint."""
    return name.removesuffix("Table")


def described(page: str) -> frozenset[str]:
    """Names of the parts that a page has tables of."""
    return frozenset(m["name"] for m in _MARKED.finditer(page))


def _table(whole: dict[str, Any], rows_alone: dict[str, Any], name: str) -> str:
    """Of one part; ``rows_alone`` are the definitions where a row inherits nothing of its block."""
    part = whole if name == "ProblemFile" else whole["$defs"][name]
    required = part.get("required", ())
    instead = part.get("anyOf", [{}])[0].get("required", ())
    strict = rows_alone.get(name, {}).get("required", ())
    rows = ["| key | type | default | meaning |", "|---|---|---|---|"]
    for key, value in part["properties"].items():
        default = (
            "**required**"
            if key in required
            else "**required**, or included"
            if key in instead
            else "row or block"
            if key in strict
            else _default(value)
        )
        meaning = value.get("description", "").replace("|", "\\|").replace("\n", " ")
        rows.append(f"| `{key}` | {_type(whole, value)} | {default} | {meaning} |")
    return "\n".join(rows)


def _default(value: dict[str, Any]) -> str:
    default = value.get("default")
    if default is None or default == {} or default == []:
        return "–"
    if isinstance(default, dict):
        return "as below"
    return f'`"{default}"`' if isinstance(default, str) else f"`{str(default).lower()}`"


def _type(whole: dict[str, Any], value: dict[str, Any]) -> str:
    if "$ref" in value:
        name = value["$ref"].split("/")[-1]
        return f"[{_shown(name)}](#{_shown(name).lower()})"
    if "anyOf" in value:
        return " or ".join(dict.fromkeys(t for t in (_type(whole, v) for v in value["anyOf"]) if t))
    if "oneOf" in value:
        return " or ".join(_type(whole, v) for v in value["oneOf"])
    if "const" in value:
        return f'`"{value["const"]}"`'
    if "enum" in value:
        return " ".join(f'`"{v}"`' if isinstance(v, str) else f"`{v}`" for v in value["enum"])
    if value.get("type") == "array":
        items = value.get("items") or {}
        if "prefixItems" in value:
            return "[" + ", ".join(_type(whole, v) for v in value["prefixItems"]) + "]"
        count = value.get("minItems")
        many = f"{count} × " if count is not None and count == value.get("maxItems") else ""
        return f"list of {many}{_type(whole, items)}"
    if value.get("type") == "object":
        if "file" in value.get("properties", {}):
            return "`{ file, dataset }`"
        by_pattern: dict[str, Any] = next(iter(value.get("patternProperties", {}).values()), {})
        return f"table of {_type(whole, value.get('additionalProperties') or by_pattern)}"
    limits = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
    said = [
        f"{sign} {value[word]:g}"
        for word, sign in limits.items()
        if word in value and abs(value[word]) < 1e5
    ]
    word = "file" if value.get("format") == "path" else _WORDS[value["type"]]
    return f"{word} {', '.join(said)}".strip() if word else ""


def main() -> None:
    """Rewrite the tables of the pages named on the command line."""
    for name in sys.argv[1:]:
        page = Path(name)
        page.write_text(fill(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
