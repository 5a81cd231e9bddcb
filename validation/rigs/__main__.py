"""The rig laboratory: ``make rigs``, or ``python -m validation.rigs``.

``--laboratory tables`` (120 tables of modes) or ``rigs`` (90 structures with a rig that the model
lacks, FRFs and tables; with ``--reference`` the recordings of the healthy state are there too).
``--evaluation`` takes the other seeds, of which only totals are printed. Each case is one file in
out/rigs, written when it is done: an interrupted run goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation import calibrate
from validation.rigs.attempts import attempt, attempt_reference
from validation.rigs.cases import COUNT, FIRST, LABORATORIES, labels, secret
from validation.rigs.judge import Grade, judged
from validation.rigs.totals import say, summary, told

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "out" / "rigs"
JUDGES = ("__main__.py", "judge.py", "totals.py")  # a case is judged anew each time


def procedure() -> list[Path]:
    """The files that a case's recordings depend on."""
    return [p for p in sorted(HERE.glob("*.py")) if p.name not in JUDGES]


def rows_of(raw: Sequence[Mapping[str, Any]], grade: Grade | None = None) -> list[dict[str, Any]]:
    """Finished cases, judged; ``grade`` as in `judged`."""
    return [
        {
            "seed": r["seed"],
            "seconds": r["seconds"],
            "cpu": r["cpu"],
            "why": r["why"],
            **judged(r["said"], r["truth"], grade),
        }
        for r in raw
    ]


def chosen(seeds: Sequence[int], only: Sequence[str]) -> list[int]:
    """The seeds whose family or kind of recording is named; all where none is."""
    return [s for s in seeds if not only or {*labels(s)} & set(only)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or go on; exit status 130 after an interruption, which keeps what is finished."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--laboratory", choices=LABORATORIES, default="tables")
    parser.add_argument("--reference", action="store_true", help="with the reference state (rigs)")
    parser.add_argument("--evaluation", action="store_true", help="the seeds never looked at")
    parser.add_argument("--seed", type=int, default=None, help="first seed")
    parser.add_argument("--count", type=int, default=None, help="how many seeds")
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help="only these families and recordings"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--scheduler", default=None, help=calibrate.SCHEDULER)
    parser.add_argument(
        "--limit", type=float, default=300.0, help="seconds of the processor a case may take"
    )
    parser.add_argument("--keep", action="store_true", help="take results of other states too")
    parser.add_argument("--cases", action="store_true", help="print each case")
    parser.add_argument(
        "--totals", action="store_true", help="diagnose nothing: totals of what is finished"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="default out/rigs")
    o = parser.parse_args(arguments)
    if o.reference and o.laboratory == "tables":
        parser.error("only the laboratory of rigs records a reference state")
    start = FIRST[o.laboratory][1 if o.evaluation else 0] if o.seed is None else o.seed
    seeds = chosen(range(start, start + (o.count or COUNT[o.laboratory])), o.only)
    folder = o.out / (f"{o.laboratory}_reference" if o.reference else o.laboratory)
    if o.totals:
        found = calibrate.finished(folder / "cases", seeds, "", True)
        raw, complete = [found[s] for s in seeds if s in found], len(found) == len(seeds)
    else:
        one = attempt_reference if o.reference else attempt
        raw, complete = calibrate.run(
            seeds, folder, o.jobs, o.limit, o.keep, one, procedure(), o.scheduler
        )
    rows = rows_of(raw)
    shown = o.cases or not any(map(secret, seeds))
    if o.cases:
        for r in rows:
            print(told(r))
    s = summary(rows)
    for line in say(s):
        print(line)
    kept = {**s, "rows": rows} if shown else s
    name = "evaluation.json" if o.evaluation else "development.json"
    text = json.dumps(kept, indent=1, ensure_ascii=False, allow_nan=False)
    calibrate.save(folder / name, text + "\n")
    print(f"Totals: {folder / name}")
    return 0 if complete else 130


if __name__ == "__main__":
    sys.exit(main())
