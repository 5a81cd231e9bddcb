"""A diagnosis with refits on one process and on two, in the same run: seconds by the clock, which
say something on a machine with two idle processors only; seconds of the processor; and the same
answer."""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.parallel import available  # noqa: E402
from cvxupdate.study import diagnose  # noqa: E402
from validation.generate import make  # noqa: E402

SEED = 2  # a frame, for development


def used() -> float:
    """Seconds of the processor, of this process and of its children."""
    both = (resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in both)


def test_two_processes(tmp_path: Path) -> None:
    make(SEED, tmp_path)
    answers, clock, processor = [], [], []
    diagnose(tmp_path / "problem.toml", jobs=1)  # what loads on use is loaded
    for jobs in (1, 2):
        begin, before = time.perf_counter(), used()
        answers.append(diagnose(tmp_path / "problem.toml", jobs=jobs).to_json())
        clock.append(time.perf_counter() - begin)
        processor.append(used() - before)
    for one in answers:
        one.pop("time")
    assert answers[0] == answers[1]
    load = os.getloadavg()[0]
    print(
        f"\none process {clock[0]:.1f} s ({processor[0]:.1f} of the processor), two "
        f"{clock[1]:.1f} s ({processor[1]:.1f}): {clock[0] / clock[1]:.2f} times, on {available()} "
        f"processors at a load of {load:.1f}"
    )
