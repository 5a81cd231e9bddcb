"""What the package says of itself: its dependencies, its extras, its citation."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SOURCE = "\n".join(p.read_text(encoding="utf-8") for p in (ROOT / "cvxupdate").rglob("*.py"))


def names(requirements: list[str]) -> set[str]:
    """Names of distributions, which are those of their modules here."""
    return {re.split(r"[\[<>=;~! ]", r)[0] for r in requirements}


def imported(name: str) -> bool:
    """Whether a module of this name is imported, or named as text (a solver that is found by
    name)."""
    return re.search(rf"(?m)^\s*(from|import) {name}\b|[\"']{name}[\"']", SOURCE) is not None


def test_every_dependency_is_used_by_the_package() -> None:
    assert {n for n in names(PROJECT["dependencies"]) if not imported(n)} == set()


def test_every_format_and_solver_of_the_extras_is_used_by_the_package() -> None:
    extras = PROJECT["optional-dependencies"]
    assert set(extras) == {"formats", "fast", "solvers", "bench", "docs", "test"}
    wanted = names([*extras["formats"], *extras["fast"], *extras["solvers"]])
    assert {n for n in wanted if not imported(n)} == {"highspy"}  # qpsolvers calls it "highs"


def test_the_citation_is_of_this_version() -> None:
    said = dict(
        re.findall(r"^([\w-]+): \"?(.+?)\"?$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    )
    assert said["version"] == PROJECT["version"]
    assert said["license"] == PROJECT["license"]["text"]
    assert said["repository-code"] == PROJECT["urls"]["Homepage"]


def test_the_hooks_before_a_commit_are_those_of_make_lint() -> None:
    lint = re.search(r"^lint:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert lint is not None
    tools = set(re.findall(r"\$\(BIN\)/(ruff check|ruff format|mypy)", lint[1]))
    hooks = (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
    assert set(re.findall(r"entry: \.venv/bin/(ruff check|ruff format|mypy)", hooks)) == tools
