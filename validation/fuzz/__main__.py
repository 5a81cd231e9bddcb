"""`python -m validation.fuzz [--kind KIND …] [--count N] [--seconds S]`: random input by the
hundred thousand.

Case n of a kind is drawn from the seed n, so that a campaign goes on where it stopped (the counts
lie in out/fuzz/counts.json) and a failure is drawn again by its number (``--only n``). A failure is
anything but an answer or an error of the input: another exception, a warning of numpy, a case that
takes longer than `HANG`, a file left behind by a command that refused. They are listed in
out/fuzz/failures.txt; each becomes a test.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cvxupdate.errors import CvxupdateError
from validation.fuzz.arguments import arguments_case
from validation.fuzz.files import problem_case, reader_case, unit_case
from validation.fuzz.flags import flags_case

FOLDER = Path("out/fuzz")
HANG, ASLEEP = 60, 1200
"""Seconds of computing that one case may take (the slowest known takes three), and by the clock:
other jobs on a machine are no hang."""
KINDS = {
    "units": unit_case,
    "readers": reader_case,
    "problems": problem_case,
    "arguments": arguments_case,
    "flags": flags_case,
}


class Hang(Exception):
    """A case that did not end."""


@contextlib.contextmanager
def limited() -> Iterator[None]:
    """`Hang` after `HANG` seconds of computing, or `ASLEEP` by the clock."""

    def ended(*_: object) -> None:
        raise Hang(f"no answer after {HANG} s of computing, or {ASLEEP} s by the clock")

    clocks = (
        (signal.ITIMER_PROF, signal.SIGPROF, HANG),
        (signal.ITIMER_REAL, signal.SIGALRM, ASLEEP),
    )
    before = [signal.signal(word, ended) for _, word, _ in clocks]
    for clock, _, seconds in clocks:
        signal.setitimer(clock, seconds)
    try:
        yield
    finally:
        for (clock, word, _), own in zip(clocks, before, strict=True):
            signal.setitimer(clock, 0)
            signal.signal(word, own)


def failure(kind: str, number: int) -> str | None:
    """What goes wrong in one case, None where nothing does."""
    rng = np.random.default_rng((sum(kind.encode()), number))
    try:
        with limited(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            KINDS[kind](rng)
    except CvxupdateError:
        return None
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {last.filename}:{last.lineno}: {str(error)[:300]!r}"
    return None


def campaign(kind: str, count: int, until: float) -> tuple[int, list[str]]:
    """(cases so far, failures of this run); the counts are kept after every hundred cases."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    kept = FOLDER / "counts.json"
    counts = json.loads(kept.read_text()) if kept.is_file() else {}
    done, found = int(counts.get(kind, 0)), []
    while done < count and time.monotonic() < until:
        said = failure(kind, done)
        if said is not None:
            found.append(f"{kind} {done}: {said}")
            with (FOLDER / "failures.txt").open("a") as file:
                file.write(found[-1] + "\n")
        done += 1
        if done % 100 == 0 or done == count:
            kept.write_text(json.dumps(counts | {kind: done}))
    kept.write_text(json.dumps(counts | {kind: done}))
    return done, found


def main() -> int:
    """Status 1 where anything failed."""
    ask = argparse.ArgumentParser(prog="python -m validation.fuzz", description=__doc__)
    ask.add_argument("--kind", action="append", choices=list(KINDS), help="default: all")
    ask.add_argument("--count", type=int, default=20_000, help="cases of each kind, in all")
    ask.add_argument("--seconds", type=float, default=float("inf"), help="for all kinds together")
    ask.add_argument("--only", type=int, help="one case, with its traceback")
    asked = ask.parse_args()
    kinds = asked.kind or list(KINDS)
    if asked.only is not None:
        KINDS[kinds[0]](np.random.default_rng((sum(kinds[0].encode()), asked.only)))
        return 0
    until, bad = time.monotonic() + asked.seconds, 0
    for k, kind in enumerate(kinds):
        share = time.monotonic() + (until - time.monotonic()) / (len(kinds) - k)
        done, found = campaign(kind, asked.count, share)
        print(f"{kind}: {done} cases so far, {len(found)} failures in this run", flush=True)
        bad += len(found)
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
