"""Plates and frames whose truth CalculiX computes, diagnosed and judged: ``make plates``.

``python -m validation.plates [--seed 0] [--count 30] [--cases]`` tries the half for development,
``--evaluation`` the other one, of which only totals are printed. What CalculiX answered is kept in
validation/plates/kept; ``--remember`` computes it anew where ``ccx`` is (Debian's calculix-ccx).
Each case is one file in out/plates/cases, written when it is done: an interrupted run goes on
where it was. Seconds are those of the processor.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation import calibrate
from validation.parallel import workers
from validation.plates.attempts import tried
from validation.plates.cases import COUNT, EVALUATION
from validation.plates.files import KEPT, kept, make, remember

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "out" / "plates"
SEEN = 1.0  # what nuisance parameters leave of an effect, in noise and discretisation: visible


def visible(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Those with an effect of which nuisance parameters leave something to see."""
    return [r for r in rows if r["words"] and max(r["left"]) >= SEEN]


def lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the issue asks: visible ones right, by family, sizes, seconds."""
    out = []
    seen = visible(rows)
    for family in sorted({str(r["family"]) for r in rows if r["family"]}):
        mine = [r for r in seen if r["family"] == family]
        nulls = [r for r in rows if r["family"] == family and not r["words"]]
        right = calibrate.rate(sum(r["outcome"] == "right" for r in mine), len(mine))
        alarms = calibrate.rate(sum(r["outcome"] == "false alarm" for r in nulls), len(nulls))
        out.append(f"{family}: visible and right {right}, false alarms {alarms}")
    right = calibrate.rate(sum(r["outcome"] == "right" for r in seen), len(seen))
    out.append(f"together: visible and right {right}")
    late = sum(r["seconds"] > 90.0 for r in rows)
    out.append(f"longer than 90 s of the processor: {late}")
    return out


def told(row: Mapping[str, Any]) -> str:
    """A case on one line."""
    said = "; ".join(f"{f['physics']} at {f['place']} ({f['confidence']})" for f in row["findings"])
    left = max(row["left"], default=0.0)
    return (
        f"{row['seed']:>5} {row['outcome']:<13} {row['seconds']:>6.1f} s  {row['truth']}  "
        f"[left {left:.2g}]  {row['verdict']}: {said or row.get('why', '')}"
    )


def files() -> list[Path]:
    """What a case depends on beside the package."""
    own = [p for p in sorted(HERE.glob("*.py")) if p.name != "__main__.py"]
    generated = [HERE.parent / "timed.py", *sorted((HERE.parent / "generated").glob("*.py"))]
    return [*own, *generated, HERE.parent / "proof.py", HERE.parent / "calibrate.py"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or go on; exit status 130 after an interruption, which keeps what is finished."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--evaluation", action="store_true", help="the seeds never looked at")
    parser.add_argument("--seed", type=int, default=0, help="first seed (default 0)")
    parser.add_argument("--count", type=int, default=COUNT, help=f"seeds (default {COUNT})")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--scheduler", default=None, help=calibrate.SCHEDULER)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds of the processor each")
    parser.add_argument("--keep", action="store_true", help="take results of other states too")
    parser.add_argument("--cases", action="store_true", help="print each case")
    parser.add_argument("--remember", action="store_true", help="ask CalculiX for the bodies")
    parser.add_argument("--generate", action="store_true", help="only write folders, to look at")
    parser.add_argument("--out", type=Path, default=OUT, help="default out/plates")
    o = parser.parse_args(arguments)
    start = EVALUATION if o.evaluation else o.seed
    seeds = list(range(start, start + o.count))
    if seeds[-1] >= EVALUATION and (o.cases or o.generate):
        parser.error(f"seeds from {EVALUATION} on are the evaluation's: only totals are looked at")
    if o.remember:
        if o.jobs == 1:
            done = [remember(s) for s in seeds]
        else:
            with workers(o.jobs) as pool:
                done = list(pool.map(remember, seeds))
        print(f"{len(done)} cases in {KEPT}")
        return 0
    if o.generate:
        for seed in seeds:
            folder = o.out / "generated" / f"p{seed}"
            make(seed, folder)
            print(folder)
        return 0
    there = [s for s in seeds if kept(s).exists() or shutil.which("ccx")]
    if len(there) < len(seeds):
        print(f"{len(seeds) - len(there)} cases are not kept, and CalculiX (ccx) is not here.")
    rows, complete = calibrate.run(
        there, o.out, o.jobs, o.limit, o.keep, tried, files(), o.scheduler
    )
    totals = calibrate.summary(rows)
    text = [*calibrate.say(totals), *lines(rows)]
    print("\n".join([*(told(r) for r in rows if o.cases), *text]))
    name = "evaluation" if start >= EVALUATION else "development"
    calibrate.save(o.out / f"{name}.json", json.dumps({"lines": text}, indent=1) + "\n")
    return 0 if complete else 130


if __name__ == "__main__":
    sys.exit(main())
