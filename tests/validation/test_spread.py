"""What a laboratory hands to its processes can be found again in each of them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("laboratory", "arguments"),
    [
        ("rigs", ["--laboratory", "tables", "--seed", "3000", "--only", "chain", "--count", "60"]),
        ("motions", ["--seed", "24", "--count", "2"]),  # marched in short time
        ("plates", ["--seed", "0", "--count", "2"]),
    ],
)
def test_two_processes_do_the_cases(tmp_path: Path, laboratory: str, arguments: list[str]) -> None:
    """Each has less time than a diagnosis takes, and most say so in their files."""
    command = [sys.executable, "-m", f"validation.{laboratory}", *arguments, "--jobs", "2"]
    done = subprocess.run(
        [*command, "--limit", "0.01", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=300,
    )
    # where the signal comes within a callback of an import Python says that it is lost there
    lost = re.compile(r"Exception ignored in: .*?TooLong: ?\n", re.DOTALL)
    assert "Traceback" not in lost.sub("", done.stderr), done.stderr[-2000:]
    cases = [json.loads(p.read_text(encoding="utf-8")) for p in tmp_path.rglob("cases/*.json")]
    # an import that is cut short may fail in its own words, and a case whose signal was lost has
    # until the next one, in which a chain may be diagnosed
    whys = [c["why"] for c in cases]
    assert len(whys) > 1 and sum("than 0 s" in w for w in whys) > len(whys) / 2
