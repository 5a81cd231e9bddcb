"""problems/README.md lists every problem, and every included model is used."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

PROBLEMS = Path(__file__).resolve().parents[1] / "problems"
TABLES = {
    path.relative_to(PROBLEMS).as_posix(): tomllib.loads(path.read_text(encoding="utf-8"))
    for path in sorted(PROBLEMS.rglob("*.toml"))
    if path.name != "truth.toml"
}
SHARED = {name for name, tables in TABLES.items() if set(tables) == {"model"}}
PAGE = (PROBLEMS / "README.md").read_text(encoding="utf-8")


def test_the_list_is_that_of_the_folders() -> None:
    listed = dict(re.findall(r"^\| `([^`]+\.toml)` \| (.+) \|$", PAGE, re.MULTILINE))
    assert listed == {n: t["title"] for n, t in TABLES.items() if n not in SHARED}


def test_every_study_has_its_section() -> None:
    studies = {path.name for path in PROBLEMS.iterdir() if path.is_dir()}
    assert set(re.findall(r"^## (\w+)$", PAGE, re.MULTILINE)) == studies


def test_every_shared_model_is_included_by_two_files_and_no_model_stands_twice() -> None:
    used = [
        (PROBLEMS / name).parent.joinpath(tables["model"]["include"]).resolve()
        for name, tables in TABLES.items()
        if "include" in tables["model"]
    ]
    for name in SHARED - {"bay/x1.toml"}:  # x1.toml: the true structure beside its two models
        assert used.count((PROBLEMS / name).resolve()) >= 2, name
    whole = [
        (Path(n).parts[0], str(t["model"]))
        for n, t in TABLES.items()
        if "include" not in t["model"]
    ]
    assert len(set(whole)) == len(whole)


def test_problems_holds_problems_only() -> None:
    assert not list(PROBLEMS.rglob("*.py"))
