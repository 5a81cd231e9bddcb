"""What the package says of itself: its dependencies, its extras, its citation; that its tests are
the same every time."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    assert set(extras) == {"formats", "fast", "parallel", "solvers", "bench", "docs", "test"}
    of_the_package = ("formats", "fast", "parallel", "solvers")
    wanted = names([n for extra in of_the_package for n in extras[extra]])
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


@pytest.mark.slow
def test_examples_are_the_same_whatever_was_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two workers draw the same, though one has loaded more of the package than the other."""

    def drawn() -> list[int]:
        some: list[int] = []

        @settings(derandomize=True, database=None, max_examples=200)
        @given(st.integers(0, 10**6))
        def keep(number: int) -> None:
            some.append(number)

        keep()
        return some

    first = drawn()
    (tmp_path / "loaded_later.py").write_text(f"NUMBERS = {tuple(range(1000, 1900))}\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert len(importlib.import_module("loaded_later").NUMBERS) == 900
    assert drawn() == first and len(set(first)) > 100


@pytest.mark.slow
def test_the_wheel_works_by_itself(tmp_path: Path) -> None:
    """Built, put into an environment that has nothing but the dependencies, and used there, far
    from the checkout: templates and commands are in it."""
    source = tmp_path / "source"
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        source.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    shutil.copytree(
        ROOT / "cvxupdate", source / "cvxupdate", ignore=shutil.ignore_patterns("__pycache__")
    )
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    made = ["--no-deps", "--no-build-isolation", "--wheel-dir", str(tmp_path), str(source)]
    subprocess.run([*pip, "wheel", *made], check=True)
    (wheel,) = tmp_path.glob("cvxupdate-*.whl")
    home = tmp_path / "env"
    venv.create(home, with_pip=False, symlinks=True)
    (site,) = home.glob("lib/python*/site-packages")
    subprocess.run(
        [*pip, "--python", str(home), "install", "--no-deps", "--no-compile", str(wheel)],
        check=True,
    )
    # The dependencies as a plain path: what is installed there as editable stays out of sight.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")
    bare = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "OMP_NUM_THREADS": "1"}

    def call(*words: str) -> str:
        done = subprocess.run(
            [str(home / "bin" / "cvxupdate"), *words],
            cwd=tmp_path,
            env=bare,
            text=True,
            capture_output=True,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert call("--version").strip() == f"cvxupdate {PROJECT['version']}"
    call("new", "beam", "mine")
    assert "mean frequency error" in call("correlate", "mine/problem.toml", "--out", "seen")
    assert "<svg" in (tmp_path / "seen" / "report.html").read_text(encoding="utf-8")
    where = "import cvxupdate; print(cvxupdate.__file__)"
    said = subprocess.run(
        [str(home / "bin" / "python"), "-c", where],
        cwd=tmp_path,
        env=bare,
        text=True,
        capture_output=True,
        check=True,
    )
    assert said.stdout.startswith(str(site))
