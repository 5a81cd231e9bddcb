"""Rules of the house that the code itself shows: sizes of files and functions, no `hasattr`, no
`assert` in the package, an assertion in every test, tests that mirror the package.

The `PENDING` sets name what is still over a limit. They may only shrink: a name that no longer
breaks its rule must be taken out.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.cases.sources import tree

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, TESTS = ROOT / "cvxupdate", ROOT / "tests"
LONGEST_FILE, LONGEST_FUNCTION, MOST_BRANCHES = 300, 60, 15  # lines, lines, cyclomatic complexity

PENDING_FILES: set[str] = set()
PENDING_FUNCTIONS: set[str] = set()
PENDING_HASATTR: set[str] = set()

SHARED_FOLDERS = {"cases", "benchmarks"}  # instances for the contract tests; `make bench`
BESIDE = {"validation"}  # packages of scripts beside the package, which have tests too
WHOLE = {
    "test_architecture.py",
    "test_methods.py",
    "test_house_rules.py",
    "test_documents.py",
    "test_examples.py",
    "test_package.py",
    "test_problems.py",
    "test_recipes.py",
}  # of the repository as a whole
Function = ast.FunctionDef | ast.AsyncFunctionDef


def sources(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.py"))


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def functions(path: Path) -> Iterator[tuple[str, Function]]:
    """Every function with its name in the file: ``Class.method``, ``outer.inner``."""

    def inside(node: ast.AST, name: str) -> Iterator[tuple[str, Function]]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.expr):  # no function stands in one, and they are most of it
                continue
            if isinstance(child, Function | ast.ClassDef):
                own = f"{name}.{child.name}" if name else child.name
                if not isinstance(child, ast.ClassDef):
                    yield own, child
                yield from inside(child, own)
            else:
                yield from inside(child, name)

    yield from inside(tree(path), "")


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """A node and all in it that is no expression."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr):
            yield from statements(child)


def complexity(function: ast.AST) -> int:
    """McCabe's number as `ruff` counts it: one more than the branches, those of inner functions
    included."""
    count = 1
    for node in statements(function):
        if isinstance(node, ast.If | ast.For | ast.AsyncFor | ast.While | ast.ExceptHandler):
            count += 1
        if isinstance(node, ast.For | ast.AsyncFor | ast.While | ast.Try) and node.orelse:
            count += 1
        if isinstance(node, ast.Match):
            count += len(node.cases)
        if isinstance(node, Function) and node is not function:
            count += 1
    return count


def long_files() -> set[str]:
    return {
        relative(p)
        for p in sources(PACKAGE)
        if len(p.read_text(encoding="utf-8").splitlines()) > LONGEST_FILE
    }


def large_functions() -> set[str]:
    return {
        f"{relative(path)}:{name}"
        for path in sources(PACKAGE)
        for name, f in functions(path)
        if (f.end_lineno or f.lineno) - f.lineno + 1 > LONGEST_FUNCTION
        or complexity(f) > MOST_BRANCHES
    }


def users_of_hasattr() -> set[str]:
    return {
        relative(path)
        for path in sources(PACKAGE)
        if "hasattr" in path.read_text(encoding="utf-8")
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Name) and node.id == "hasattr"
    }


@pytest.mark.parametrize(
    ("found", "pending"),
    [
        pytest.param(long_files, PENDING_FILES, id="files over 300 lines"),
        pytest.param(large_functions, PENDING_FUNCTIONS, id="functions over 60 lines or branches"),
        pytest.param(users_of_hasattr, PENDING_HASATTR, id="hasattr"),
    ],
)
def test_nothing_new_breaks_a_rule(found, pending: set[str]) -> None:
    over = found()
    assert over <= pending, f"split or mend: {sorted(over - pending)}"
    assert pending <= over, f"mended: take out of PENDING: {sorted(pending - over)}"


def test_the_package_asserts_nothing() -> None:
    """`python -O` drops assertions; a fault of the input is an error of cvxupdate/errors.py."""
    found = [
        f"{relative(path)}:{node.lineno}"
        for path in sources(PACKAGE)
        if "assert" in path.read_text(encoding="utf-8")
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Assert)
    ]
    assert found == []


def asserts(function: ast.AST) -> bool:
    """An assert, pytest.raises/warns/fail, or a helper named assert_… or check_…."""
    for node in ast.walk(function):
        if isinstance(node, ast.Assert):
            return True
        if isinstance(node, ast.Call):
            f = node.func
            name = (
                f.attr if isinstance(f, ast.Attribute) else f.id if isinstance(f, ast.Name) else ""
            )
            if name in ("raises", "warns", "fail") or name.startswith(("assert_", "check_")):
                return True
    return False


@cache
def without_assertion() -> tuple[tuple[str, str], ...]:
    """(its own name, where it stands) of every function of the tests that asserts nothing, though
    its name promises it."""
    return tuple(
        (f.name, f"{relative(path)}:{name}")
        for path in sources(TESTS)
        for name, f in functions(path)
        if f.name.startswith(("test_", "assert_", "check_")) and not asserts(f)
    )


def test_every_test_asserts() -> None:
    assert [where for name, where in without_assertion() if name.startswith("test_")] == []


def test_helpers_that_count_as_assertions_assert() -> None:
    """A helper of the tests whose name promises an assertion holds one."""
    assert [where for name, where in without_assertion() if not name.startswith("test_")] == []


def test_tests_mirror_the_package() -> None:
    """Every folder of tests is a folder of the package (or of the scripts beside it), every file
    beside them a module."""
    folders = {p.parent.relative_to(TESTS) for p in sources(TESTS)} - {Path()}
    astray = {
        f.as_posix()
        for f in folders
        if f.parts[0] not in SHARED_FOLDERS
        and not ((ROOT if f.parts[0] in BESIDE else PACKAGE) / f).is_dir()
    }
    assert astray == set()
    for path in TESTS.glob("test_*.py"):
        module = PACKAGE / path.name.removeprefix("test_")
        assert path.name in WHOLE or module.is_file(), f"{path.name} mirrors no module"


def test_the_net_catches_what_it_should() -> None:
    """The net itself, on a function that breaks each rule."""
    source = (
        "def test_a():\n    for i in x:\n        if i:\n            pass\n    else:\n        y()\n"
        "    while z:\n        break\n    try:\n        pass\n    except E:\n        pass\n"
    )
    f = ast.parse(source).body[0]
    assert complexity(f) == 6 and not asserts(f)
    assert asserts(ast.parse("def f():\n    with pytest.raises(E):\n        g()"))
    assert asserts(ast.parse("def f():\n    check_all(1)"))
