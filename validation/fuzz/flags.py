"""Command lines of words that belong to the commands, and of others."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from validation.fuzz.files import sound_files, sound_problems

COMMANDS = ["run", "diagnose", "correlate", "identify", "solvers", "check", "inspect", "schema"]
COMMANDS += ["nothing"]
OPTIONS = [
    *("--json", "--out", "--help", "--version", "--jobs", "--thorough", "--method", "--normal"),
    *("--band", "--order", "--recording", "--rate", "--damping", "--estimator", "--decay", "--x"),
    *("-h", "--", "-", "--jobs=0", "--order=-3", "--rate=nan", "--decay=inf", "--band=9"),
]
VALUES = [
    *("0", "1", "-1", "nan", "inf", "1e9", "x", "", "é", "out", "plscf", "ssi", "simple", "all"),
    *("viscous", "lpm", "p.toml", "nothing.toml", ".", "..", "p.toml/x", "a.csv", "b.uff", "\t"),
]
SLOW = {"run", "diagnose"}
"""Not given a problem that holds: a fit takes seconds, and is tested elsewhere."""


def flags_case(rng: np.random.Generator) -> None:
    """One command line in a folder of its own. Fails where the status is none of the contract's,
    where a traceback shows, or where a line that was refused left something behind."""
    from cvxupdate.cli import main

    words = [str(rng.choice(COMMANDS))] if rng.random() < 0.9 else []
    pool = OPTIONS + VALUES
    words += [str(rng.choice(pool)) for _ in range(int(rng.integers(0, 6)))]
    if words and words[0] in SLOW:
        words = [w for w in words if w not in ("p.toml", "..", ".")]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _furnish(folder)
        before = {p.relative_to(folder) for p in folder.rglob("*")}
        status, said = _called(main, words, folder)
        after = {p.relative_to(folder) for p in folder.rglob("*")}
    if status not in (0, 2, 3) or "Traceback" in said:
        raise RuntimeError(f"status {status} of {words}: {said[-300:]}")
    if status == 2 and after != before:
        raise RuntimeError(f"{words} was refused and wrote {sorted(map(str, after - before))}")
    if status == 2 and not said.strip():
        raise RuntimeError(f"{words} was refused without a word")


def _furnish(folder: Path) -> None:
    problem, beside = sound_problems()[0]
    for name, blob in beside.items():
        (folder / name).write_bytes(blob)
    (folder / problem).rename(folder / "p.toml")
    for ending, blob in sound_files():
        if ending in (".csv", ".uff"):
            (folder / f"{ending[1]}{ending}").write_bytes(blob)


def _called(main: object, words: list[str], folder: Path) -> tuple[object, str]:
    """(status, standard error) of the command line, as the console script would have it."""
    err, here, argv = io.StringIO(), Path.cwd(), sys.argv
    try:
        os.chdir(folder)
        sys.argv = ["cvxupdate", *words]
        with contextlib.redirect_stderr(err), contextlib.redirect_stdout(io.StringIO()) as out:
            main()  # type: ignore[operator]
    except SystemExit as ended:
        return ended.code, err.getvalue() or out.getvalue()
    finally:
        os.chdir(here)
        sys.argv = argv
    return 0, err.getvalue()
