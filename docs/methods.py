"""The page on the methods of the thesis: every public part of the package whose docstring cites an
equation of chapters 2 to 6 or 9, with the way in and the tests that name it.

``python -m docs.methods`` writes docs/methods.md; `tests/test_methods.py` compares it with the
package, and fails for a method without a way in or without a test.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, TESTS, PAGE = ROOT / "cvxupdate", ROOT / "tests", ROOT / "docs" / "methods.md"
STUDIES = ROOT / "validation" / "studies"
CITED = re.compile(r"\(([^()]*(?:[2-6]|9)\.\d[^()]*)\)")
BEGINS = re.compile(r"\s*(?:[2-6]|9)\.\d{1,3}(?!\d)")
NUMBER = re.compile(r"(?<![\d.])(?:[2-6]|9)\.\d{1,3}(?:\.\d)?(?!\d)")
RANGE = re.compile(r"(?<![\d.])([2-69])\.(\d{1,3})(?: to |–)\1\.(\d{1,3})(?!\d)")
DOORS = ("cvxupdate.cli", "cvxupdate.commands", "cvxupdate.study", "cvxupdate.api")
# lists that the registry reads by name
LISTS = ("cvxupdate.convex.regularisers", "cvxupdate.convex.constraints", "cvxupdate.fe.elements")

WAYS: tuple[tuple[str, str], ...] = (
    ("cvxupdate.direct", '`run`, `method = "direct"`, `direct = "…"` ([page](direct-methods.md))'),
    ("cvxupdate.update.ceam", '`run`, `method = "ceam"`'),
    ("cvxupdate.residual.ceam", '`run`, `method = "ceam"`'),
    ("cvxupdate.residual.frf_filled", '`run`, `method = "rfm"`, `residual = "filled"`'),
    ("cvxupdate.residual.frf_modal", '`run`, `method = "rfm"`, `residual = "modal-balance"`'),
    ("cvxupdate.residual.frf_points", "`plan`; `run`, `lines` of `rfm`"),
    ("cvxupdate.residual.frf_accuracy", '`run`, `method = "rfm_accuracy"`; `plan`'),
    ("cvxupdate.residual.eigen", '`run`, `method = "sensitivity"`'),
    ("cvxupdate.recordings.appropriate", "`identify --method appropriation --indicator …`; `plan`"),
    ("cvxupdate.recordings.realise", "`identify --normal …`"),
    ("cvxupdate.recordings.identify", "`identify --method …`"),
    ("cvxupdate.update.classic", "`run`, `solution = …`"),
    ("cvxupdate.update.modal", '`run`, `method = "frequencies"` or `"sensitivity"`'),
    ("cvxupdate.update.minimum_variance", '`run`, `method = "minimum-variance"`'),
    ("cvxupdate.update.shortest", '`run`, `solution = "minimum-norm"`'),
    ("cvxupdate.update.rfm", '`run`, `method = "rfm"`, `residual = …`'),
    ("cvxupdate.update.trust_region", "`run`, every iterative method"),
    ("cvxupdate.update.result", '`run`, `method = "rfm_accuracy"`'),
    ("cvxupdate.correlate", "`correlate`"),
    ("cvxupdate.convex.regularisers", "`run`, `[[regularisation]]`"),
    ("cvxupdate.reduction", "`run`, `reduction` or `expansion`; `correlate`"),
    (
        "cvxupdate.fe.damping",
        "`identify` (`damping.toml`, `damping_measured.toml`); `[model.damping]`",
    ),
    ("cvxupdate.commands.identify_damping", "`identify` (`damping_measured.toml`)"),
    ("cvxupdate.commands.plan", "`plan`"),
)
"""The longest prefix of a module says how its methods are reached."""


@dataclass(frozen=True)
class Method:
    """A public function or class: ``cites`` equations, ``says`` the first sentence of its
    docstring, ``way`` in, ``tests`` the test modules and ``studies`` the studies that name it."""

    module: str
    name: str
    cites: tuple[str, ...]
    says: str
    way: str
    tests: tuple[str, ...]
    studies: tuple[str, ...]

    @property
    def code(self) -> str:
        """Where it stands."""
        return f"{self.module.removeprefix('cvxupdate.')}.{self.name}"


@cache
def modules() -> Mapping[str, ast.Module]:
    """Every module of the package, parsed."""
    out = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        out[name] = ast.parse(path.read_text(encoding="utf-8"))
    return out


@cache
def methods() -> tuple[Method, ...]:
    """In the order of their equations."""
    found = []
    for module, tree in modules().items():
        for node in tree.body:
            # a class is what a function gives back, but for the members of a list
            if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
                continue
            given_back = isinstance(node, ast.ClassDef) and node.decorator_list
            if given_back and not module.startswith(LISTS):
                continue
            text = ast.get_docstring(node) or ""
            cites = cited(text)
            if cites:
                says = " ".join(text.split("\n\n")[0].split())
                found.append(
                    Method(
                        module,
                        node.name,
                        tuple(dict.fromkeys(cites)),
                        says,
                        way_of(module) if (module, node.name) in reached() else "",
                        naming(node.name, module),
                        studied(node.name, module),
                    )
                )
    return tuple(sorted(found, key=lambda m: (_order(m.cites[0]), m.code)))


def cited(text: str) -> list[str]:
    """The numbers in brackets of a docstring, as (2.76, 2.77), (Baruch 1978; 2.76) or (2.17 to
    2.21); those of a range one by one."""
    out = []
    for brackets in CITED.findall(text):
        for part in brackets.split(";"):
            if not BEGINS.match(part):
                continue
            wide = RANGE.sub(
                lambda m: ", ".join(f"{m[1]}.{k}" for k in range(int(m[2]), int(m[3]) + 1)), part
            )
            out += NUMBER.findall(wide)
    return list(dict.fromkeys(out))


def _ranges(numbers: tuple[str, ...]) -> str:
    """Numbers as text, three in a row or more as a range."""
    rows: list[list[str]] = []
    for number in numbers:
        last = _order(rows[-1][-1]) if rows else ()
        if last and len(last) == 2 and _order(number) == (last[0], last[1] + 1):
            rows[-1].append(number)
        else:
            rows.append([number])
    return ", ".join(f"{r[0]} to {r[-1]}" if len(r) > 2 else ", ".join(r) for r in rows)


def _order(number: str) -> tuple[int, ...]:
    return tuple(int(x) for x in number.split("."))


def way_of(module: str) -> str:
    """That of the longest prefix; empty where none is known."""
    own = [(len(prefix), way) for prefix, way in WAYS if module.startswith(prefix)]
    return max(own, default=(0, ""))[1]


@cache
def _test_texts() -> Mapping[str, tuple[str, frozenset[str]]]:
    """Text and words of every test module."""
    out = {}
    for p in sorted([*TESTS.rglob("test_*.py"), *TESTS.glob("cases/*.py")]):
        text = p.read_text(encoding="utf-8")
        out[str(p.relative_to(TESTS))] = text, frozenset(re.findall(r"\w+", text))
    return out


def naming(name: str, module: str) -> tuple[str, ...]:
    """The test modules that name it, as it is or with hyphens (of a short word those that import
    from its package); else those that import from its module."""
    hyphens = name.replace("_", "-")
    package, part = ".".join(module.split(".")[:2]), module.rpartition(".")[2]
    own, others = [], []
    for t, (text, words) in _test_texts().items():
        named = name in words or f'"{hyphens}"' in text or f"'{hyphens}'" in text
        if named and (package in text or len(name) > 9):
            own.append(t)
        elif part in words and package in text:
            others.append(t)
    return tuple(own or others)


@cache
def _study_texts() -> Mapping[str, tuple[str, frozenset[str]]]:
    """Text and words of every study."""
    out = {}
    for p in sorted(STUDIES.glob("*.py")):
        text = p.read_text(encoding="utf-8")
        out[p.stem] = text, frozenset(re.findall(r"\w+", text))
    return out


def studied(name: str, module: str) -> tuple[str, ...]:
    """The studies that name it and import from its package."""
    package = ".".join(module.split(".")[:2])
    return tuple(s for s, (t, words) in _study_texts().items() if name in words and package in t)


@cache
def reached() -> set[tuple[str, str]]:
    """Every (module, name) that the commands and the functions for programs can come to: from
    their modules along the names that are used, classes and what runs on import whole."""
    starts = [(m, "") for m in modules() if m.startswith(DOORS) or m in LISTS]
    done: set[tuple[str, str]] = set()
    while starts:
        at = starts.pop()
        if at in done:
            continue
        done.add(at)
        starts += [other for other in _leads(*at) if other not in done]
    return done


@cache
def _own(module: str) -> Mapping[str, ast.stmt]:
    """What a module defines, by name."""
    body = modules()[module].body
    return {n.name: n for n in body if isinstance(n, ast.FunctionDef | ast.ClassDef)}


def _leads(module: str, name: str) -> Iterator[tuple[str, str]]:
    """Where a part leads; the name "" is the module with all that it defines."""
    tree = modules()[module]
    known = _imported(module)
    own = _own(module)
    door = module.startswith(DOORS)
    body = (
        [n for n in tree.body if door or not isinstance(n, ast.FunctionDef | ast.ClassDef)]
        if not name
        else [own[name]]
        if name in own
        else []
    )
    if name:
        yield module, ""
        if name in known and name not in own:
            yield known[name]
    for node in body:
        for inner in ast.walk(node):
            if isinstance(inner, ast.Name):
                if inner.id in own:
                    yield module, inner.id
                elif inner.id in known:
                    yield known[inner.id]
            elif isinstance(inner, ast.Attribute) and isinstance(inner.value, ast.Name):
                target = known.get(inner.value.id)
                if target is not None and not target[1]:
                    yield target[0], inner.attr


def _from(module: str, node: ast.ImportFrom) -> str:
    """The module that an import names, from a package's own as well."""
    if not node.level:
        return node.module or ""
    package = (PACKAGE.parent / Path(*module.split("."))).is_dir()
    parts = module.split(".")[: len(module.split(".")) - node.level + package]
    return ".".join([*parts, *([node.module] if node.module else [])])


@cache
def _given(module: str) -> frozenset[str]:
    """The names that a package gives out of its own modules."""
    if module not in modules():
        return frozenset()
    own = [n for n in modules()[module].body if isinstance(n, ast.ImportFrom)]
    names = [(_from(module, n), a.name) for n in own for a in n.names]
    return frozenset(name for of, name in names if of == f"{module}.{name}")


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """A node and all in it that is no expression."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr):
            yield from _statements(child)


@cache
def _imported(module: str) -> Mapping[str, tuple[str, str]]:
    """Names → what they stand for, of every import anywhere in a module."""
    out = {}
    for node in _statements(modules()[module]):
        if isinstance(node, ast.ImportFrom):
            of = _from(module, node)
            for alias in node.names:
                whole = f"{of}.{alias.name}"
                # a function may have the name of its module: the package then says which it gives
                again = whole in modules() and alias.name in _given(of)
                if whole in modules() and not again:
                    out[alias.asname or alias.name] = (whole, "")
                elif of in modules():
                    out[alias.asname or alias.name] = (of, alias.name)
    return out


def page() -> str:
    """The text of docs/methods.md."""
    out = [
        "# Methods of the thesis, and the way to each",
        "",
        "Every part of the package that works by a numbered equation of chapters 2 to 6 or 9 of",
        "the thesis that [theory.md](theory.md) names: the way in, and tests that fail where it",
        "is wrong, and the [studies](studies.md) that use it by name. Chapters 7 and 8 have pages",
        "of their own ([generic elements](generic-elements.md), [exact",
        "elements](exact-elements.md)). Written by",
        "`python -m docs.methods` from the docstrings.",
        "",
        "| equation | what | way in | tests | studies |",
        "|---|---|---|---|---|",
    ]
    for m in methods():
        way = m.way or f"none yet; in Python `from {m.module} import {m.name}`"
        says = re.split(r"(?<=[.:;])\s", m.says)[0].replace("|", "\\|").rstrip(":;")
        tests = ", ".join(f"`{t}`" for t in m.tests[:2])
        used = ", ".join(f"`{s}`" for s in m.studies[:2])
        out.append(f"| {_ranges(m.cites)} | `{m.code}`: {says} | {way} | {tests} | {used} |")
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
