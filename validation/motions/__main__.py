"""The motion laboratory: ``python -m validation.motions [--seed 0] [--count 24] [--cases]``.

Structures in time, marched by scipy: chains, cantilevers and frames that touch, rub, harden, damp
or drift, or have something linear concealed, or nothing. ``--evaluation`` takes seeds 1000 to 1119,
of which only totals are printed; ``--simulated`` those 500 above, whose records are as simulations
write them. Each case is one file in out/motions, written when it is done: an interrupted run goes
on where it was.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from validation import calibrate
from validation.motions.attempts import attempted
from validation.motions.cases import COUNT, EVALUATION, draw, secret
from validation.motions.drives import SIMULATED
from validation.motions.effects import graded
from validation.motions.files import make
from validation.proof import NONLINEAR
from validation.rigs.__main__ import procedure, rows_of
from validation.rigs.judge import STATED
from validation.rigs.totals import say, summary, told

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "out" / "motions"
FEW = 24  # cases of a run for development
CLOCK = "follows the clock"  # what a diagnosis says of drift


def files() -> list[Path]:
    """What a case depends on beside the package."""
    own = [p for p in sorted(HERE.glob("*.py")) if p.name != "__main__.py"]
    return [*own, *procedure()]


def drifts(raw: Sequence[dict[str, Any]]) -> str:
    """How often drift was said in words, of structures that drift and of others."""

    def said(row: dict[str, Any]) -> bool:
        text = " ".join([row["said"].get("says", ""), *row["said"].get("evidence", ())])
        return CLOCK in text

    with_, without = ([r for r in raw if bool(r["truth"]["drift"]) == d] for d in (True, False))
    return (
        f"Drift said in words: {calibrate.rate(sum(map(said, with_)), len(with_))} that drift, "
        f"{calibrate.rate(sum(map(said, without)), len(without))} others"
    )


def nonlinear_words(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How often an internal force was told (with a confidence of 0.5 or more) of structures that
    have none: nothing concealed, something linear, or drift."""
    linear = [r for r in rows if not any(e["physics"] in NONLINEAR for e in r["effects"])]
    wrong = sum(
        any(f["physics"] in NONLINEAR and f["confidence"] >= STATED for f in r["findings"])
        for r in linear
    )
    return {"linear": len(linear), "told": wrong, "interval": calibrate.wilson(wrong, len(linear))}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or go on; exit status 130 after an interruption, which keeps what is finished."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--evaluation", action="store_true", help="the seeds never looked at")
    parser.add_argument("--simulated", action="store_true", help="records as simulations have them")
    parser.add_argument("--seed", type=int, default=0, help="first seed (default 0)")
    parser.add_argument("--count", type=int, default=None, help="how many seeds")
    parser.add_argument("--only", nargs="+", default=[], help="only what is concealed so")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--scheduler", default=None, help=calibrate.SCHEDULER)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds of the processor each")
    parser.add_argument("--keep", action="store_true", help="take results of other states too")
    parser.add_argument("--cases", action="store_true", help="print each case")
    parser.add_argument(
        "--generate", action="store_true", help="only write the folders, to look at"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="default out/motions")
    o = parser.parse_args(arguments)
    start = (EVALUATION if o.evaluation else o.seed) + (SIMULATED if o.simulated else 0)
    seeds = list(range(start, start + (o.count or (COUNT if o.evaluation else FEW))))
    if any(map(secret, seeds)) and (o.cases or o.generate or o.only):
        parser.error(f"seeds from {EVALUATION} on are the evaluation's: only totals are looked at")
    seeds = [s for s in seeds if not o.only or draw(s).what in o.only]
    if o.generate:
        for seed in seeds:
            print(
                o.out / "generated" / f"m{seed}", make(seed, o.out / "generated" / f"m{seed}").what
            )
        return 0
    raw, complete = calibrate.run(
        seeds, o.out, o.jobs, o.limit, o.keep, attempted, files(), o.scheduler
    )
    rows = rows_of(raw, graded)
    if o.cases:
        for r in rows:
            print(told(r))
    s = summary(rows)
    words = s["nonlinear_words"] = nonlinear_words(rows)
    said = calibrate.rate(words["told"], words["linear"])
    for line in (*say(s), drifts(raw), f"Nonlinear words on linear structures: {said}"):
        print(line)
    kept = s if any(map(secret, seeds)) else {**s, "rows": rows}
    name = f"{'evaluation' if o.evaluation else 'development'}{'_simulated' * o.simulated}.json"
    text = json.dumps(kept, indent=1, ensure_ascii=False, allow_nan=False)
    calibrate.save(o.out / name, text + "\n")
    picture = o.out / name.replace(".json", ".svg")
    calibrate.save(picture, calibrate.picture(s))
    print(f"Totals: {o.out / name}; confidence against hit rate: {picture}")
    return 0 if complete else 130


if __name__ == "__main__":
    sys.exit(main())
