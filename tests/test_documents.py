"""The documentation does what it says: tutorials run as they are written, links lead somewhere, and
every page is in the site's list."""

from __future__ import annotations

import doctest
import json
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cvxupdate import cli
from docs.notebooks import NAMED, SITE, notebook, path_of

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
BLOCK = re.compile(r"```(\w+)([^\n]*)\n(.*?)```", re.DOTALL)
KEY = re.compile(r"^(\w+) = ", re.MULTILINE)


def blocks(page: Path) -> Iterator[tuple[str, str, str]]:
    """(language, what stands beside it, text) of every fenced block."""
    for language, beside, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        yield language, beside.strip(), text


def squeezed(text: str) -> str:
    return " ".join(text.split())


def written(beside: str, text: str) -> None:
    """A block with ``title="FILE"`` is the file, one with ``title="in FILE, instead"`` its new
    lines."""
    name = NAMED.search(beside)
    if name is None:
        return
    path = Path(name[2])
    if not name[1]:
        path.write_text(text, encoding="utf-8")
        return
    old = path.read_text(encoding="utf-8")
    for line in text.strip().splitlines():
        (key,) = KEY.findall(line)
        old, count = re.subn(rf"(?m)^{key} = .*$", lambda _, new=line: new, old)
        assert count == 1, f"{path}: {key} stands there {count} times"
    path.write_text(old, encoding="utf-8")


def check_commands(text: str, monkeypatch, capsys) -> None:
    """Runs every line after ``$``; what stands below it is said by it, but for what "…" cuts."""
    for part in re.split(r"(?m)^\$ ", text)[1:]:
        command, _, expected = part.partition("\n")
        if not command.startswith("cvxupdate "):
            subprocess.run(shlex.split(command), check=True)
            continue
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", shlex.split(command))
        with pytest.raises(SystemExit) as left:
            cli.main()
        said = capsys.readouterr()
        assert left.value.code in (0, None), said.err
        whole = squeezed(said.out + said.err)
        for line in filter(None, map(squeezed, expected.splitlines())):
            shown = ".*".join(map(re.escape, line.split("…")))
            assert re.search(shown, whole), f"{command}: {line!r} is not in\n{said.out}{said.err}"


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda p: p.stem)
@pytest.mark.slow
def test_a_tutorial_runs_as_it_is_written(page, tmp_path, monkeypatch, capsys):
    files = page.parent / "files" / page.stem
    folder = tmp_path / "mine"
    if files.is_dir():
        shutil.copytree(files, folder)
    else:
        folder.mkdir()
    monkeypatch.chdir(folder)
    names: dict = {}
    said: list[str] = []
    ran = 0
    for language, beside, text in blocks(page):
        if language == "toml":
            written(beside, text)
        elif language == "console":
            check_commands(text, monkeypatch, capsys)
            ran += 1
        elif language == "python":
            found = doctest.DocTestParser().get_doctest(text, names, page.name, page.name, 0)
            doctest.DocTestRunner().run(found, out=said.append, clear_globs=False)
            names = found.globs
            ran += 1
    assert ran >= 2 and not said, "".join(said)


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda p: p.stem)
def test_a_notebook_is_its_tutorial(page) -> None:
    """Its cells are the steps that the test above takes. It is downloaded: links lead to files
    beside it or to the site, and not to itself."""
    text = notebook(page)
    assert path_of(page).read_text(encoding="utf-8") == text, "run python -m docs.notebooks"
    cells = json.loads(text)["cells"]
    sources = ["".join(c["source"]) for c in cells]
    for cell, source in zip(cells, sources, strict=True):
        for link in re.findall(r"\]\((?!https?:|#)([^)#\s]+)", source):
            beside = path_of(page).parent / link
            assert cell["cell_type"] == "code" or (beside.is_file() and "/" not in link), link
        for name in re.findall(rf"\]\({re.escape(SITE)}/([^)#\s]+)", source):
            assert (DOCS / name).is_file(), name
        assert f"{page.stem}.ipynb" not in source
        if cell["cell_type"] == "code" and source[0] not in "!%":
            compile(source, page.stem, "exec")
    ran = "\n".join(s for c, s in zip(cells, sources, strict=True) if c["cell_type"] == "code")
    for language, _, block in blocks(page):
        lines = [x[4:] for x in block.splitlines() if x.startswith((">>> ", "... "))]
        lines += ["!" + x[2:] for x in block.splitlines() if x.startswith("$ ")]
        assert language == "toml" or (lines and all(line in ran for line in lines))


def test_every_block_is_drawn_as_one() -> None:
    """The site knows a title beside a block's language; anything else makes prose of the block, and
    of what follows."""
    for page in DOCS.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        for beside in re.findall(r"(?m)^```(.+)$", text):
            assert re.fullmatch(r'\w+( title="[^"]+")?', beside), (page.name, beside)


def test_links_lead_somewhere() -> None:
    for page in DOCS.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        for link in re.findall(r"\]\((?!https?:|#)([^)#\s]+)", text):
            target = (page.parent / link).resolve()
            assert target.exists() and DOCS in target.parents, (page.name, link)


def test_every_page_is_in_the_list_of_the_site() -> None:
    listed = set(re.findall(r"([\w/-]+\.md)", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")))
    assert listed == {p.relative_to(DOCS).as_posix() for p in DOCS.rglob("*.md")}


def test_the_reference_has_every_public_name() -> None:
    import cvxupdate

    text = (DOCS / "api.md").read_text(encoding="utf-8")
    listed = {name.rpartition(".")[2] for name in re.findall(r"^::: ([\w.]+)", text, re.MULTILINE)}
    errors = {n for n in cvxupdate.__all__ if n.endswith(("Error", "Warning"))} | {"Fault"}
    said_elsewhere = {
        "ModeResult",
        "ParameterResult",
        "Spec",
        "Updated",
        "__version__",
        "schema",
        "solvers_files",
    }  # types of fields and texts, which the pages of results and problem files describe
    assert set(cvxupdate.__all__) - errors - said_elsewhere <= listed and "errors" in listed


def test_every_command_is_in_the_table_of_commands() -> None:
    from typer.main import get_command

    text = (DOCS / "commands.md").read_text(encoding="utf-8")
    for command in get_command(cli.app).commands:
        assert f"`cvxupdate {command}" in text, command
