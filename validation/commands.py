"""Every command on every problem file of a folder: none may end in an error of cvxupdate itself.

Run: CVXUPDATE_DATA=/path/to/data python -m validation.commands [folder or file …]

Without a folder: problems/real, whose structures have one node, no force channel or no motion
channel. A diagnosis gets SHORT seconds for its search, a command LONGEST by the clock; one that is
stopped there has not failed. Ends with status 1 where a command did.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from validation.real.table import PROBLEMS

COMMANDS = ("check", "correlate", "run", "solvers", "diagnose")
SHORT = 20.0  # s, computing and clock, of the search of a diagnosis
LONGEST = 240.0  # s by the clock: what a command may take here before it is stopped
STOPPED = -1  # status of one that was


@dataclass(frozen=True)
class Ended:
    """How a command ended: its status (the contract's, STOPPED beside), its last line, its time in
    seconds."""

    file: Path
    command: str
    status: int
    says: str
    seconds: float

    @property
    def failed(self) -> bool:
        """Whether cvxupdate failed: not bad input, not something that did not converge."""
        return self.status not in (0, 2, 3, STOPPED)

    @property
    def line(self) -> str:
        """One row of the table."""
        state = "FAILED" if self.failed else "stopped" if self.status == STOPPED else "ended"
        said = " ".join(self.says.split())[:160]
        return (
            f"{state:8}{self.status:3} {self.seconds:6.1f} s  {self.command:10}{self.file}  {said}"
        )


def problem_files(places: Sequence[Path]) -> Iterator[Path]:
    """The problem files of folders and files: those that have recordings."""
    for place in places:
        for file in sorted(place.rglob("*.toml")) if place.is_dir() else [place]:
            if "[[recordings]]" in file.read_text(encoding="utf-8"):
                yield file


def ended(file: Path, command: str, longest: float = LONGEST) -> Ended:
    """A command in a process of its own, that it may be stopped."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as out:
        order = [sys.executable, "-m", "validation.commands", "--one", command, str(file), out]
        try:
            done = subprocess.run(order, capture_output=True, text=True, timeout=longest)
            status, says = done.returncode, done.stderr or done.stdout
        except subprocess.TimeoutExpired:
            status, says = STOPPED, f"not done after {longest:.0f} s"
    last = next((s for s in reversed(says.splitlines()) if s.strip()), "")
    return Ended(file, command, status, last, time.perf_counter() - begin)


@contextmanager
def hurried(seconds: float) -> Iterator[None]:
    """Searches of diagnoses begin nothing new after so long, by the clock and of the processor."""
    from cvxupdate.diagnose.budget import Budget

    usual = Budget.of
    Budget.of = staticmethod(  # type: ignore[method-assign]
        lambda thorough, jobs=None: Budget(seconds, seconds)
    )
    try:
        yield
    finally:
        Budget.of = usual  # type: ignore[method-assign]


def one(command: str, file: str, out: str, short: float = SHORT) -> int:
    """The command in this process, the search of a diagnosis cut short; its exit status."""
    from cvxupdate import cli

    given = sys.argv
    sys.argv = ["cvxupdate", command, file, *(["--out", out] if command != "check" else [])]
    try:
        with hurried(short):
            cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = given
    return 0


def main(arguments: Sequence[str]) -> int:
    """Status 1 where a command failed."""
    if arguments[:1] == ["--one"]:
        return one(*arguments[1:4])
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    failed = 0
    for file in problem_files([Path(a) for a in arguments] or [PROBLEMS]):
        for command in COMMANDS:
            how = ended(file, command)
            failed += how.failed
            print(how.line, flush=True)
    print(f"{failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
