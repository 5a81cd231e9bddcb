"""Two visible effects at once, of `make calibrate`'s laboratory, diagnosed and judged:
``python -m validation.pairs``.

``[--seed 3300] [--count 30] [--cases]``: the first so many seeds from there on whose case conceals
two effects, recorded as responses, of each of which nuisance parameters leave at least `SEEN`.
Seeds from 3300 on are new ones, of which only totals are printed (2000 to 3299 were looked at,
docs/calibration.md). Each case is a file in out/pairs/cases: an interrupted run goes on. Seconds
are those of the processor.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from validation import calibrate, generate
from validation.generated.cases import Case
from validation.generated.laboratory import build, modal
from validation.generated.visible import visibility
from validation.timed import timed

OUT = Path(__file__).resolve().parents[1] / "out" / "pairs"
NEW = 3300  # from here on nobody has looked at a case
SEEN = 2.0  # what nuisance parameters leave of each effect, in noise and discretisation


def visible(case: Case) -> bool:
    """Two effects in responses, both to be seen."""
    if len(case.findings) < 2 or case.kind == "modes":
        return False
    m = modal(build(case.design, case.scatter, case.effects), case.top, case.zeta)
    return all(visibility(case, i, m)[1] >= SEEN for i in range(len(case.findings)))


def pairs(first: int) -> Iterator[int]:
    """Their seeds, from one on."""
    return (s for s in itertools.count(first) if s % 3 and visible(generate.draw(s)))


def tried(seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """One case made, diagnosed and judged; its file."""
    return timed(_written, seed, folder, state, limit)


def _written(seed: int, folder: Path) -> dict[str, Any]:
    generate.make(seed, folder)
    return {}


def lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the issue asks: both named, something wrong said."""
    names = (("right", "both named, nothing wrong"), ("part", "one named, nothing wrong"))
    rest = (("wrong", "something wrong said"), ("undetermined", "undetermined"))
    out = []
    for outcome, text in (*names, *rest, ("missed", "consistent"), ("failed", "failed")):
        hits = sum(r["outcome"] == outcome for r in rows)
        out.append(f"{text}: {calibrate.rate(hits, len(rows))}")
    found = [f for r in rows for f in r["findings"]]
    sure = [f for f in found if f["confidence"] >= 0.85]
    right = sum(f["right"] for f in sure)
    out.append(f"findings with 0.85 or more that are right: {calibrate.rate(right, len(sure))}")
    seconds = sorted(r["seconds"] for r in rows)
    if seconds:
        middle = seconds[len(seconds) // 2]
        out.append(f"CPU seconds: median {middle:.0f}, most {seconds[-1]:.0f}")
    return out


def told(row: Mapping[str, Any]) -> str:
    """A case on one line."""
    said = "; ".join(f"{f['physics']} at {f['place']} ({f['confidence']})" for f in row["findings"])
    return (
        f"{row['seed']:>5} {row['outcome']:<13} {row['seconds']:>6.1f} s  {row['truth']}  "
        f"{row['left']}  {row['verdict']}: {said or row.get('why', '')}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or go on; exit status 130 after an interruption, which keeps what is finished."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=NEW, help=f"first seed (default {NEW})")
    parser.add_argument("--count", type=int, default=30, help="cases (default 30)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds of the processor each")
    parser.add_argument("--keep", action="store_true", help="take results of other states too")
    parser.add_argument("--cases", action="store_true", help="print each case")
    parser.add_argument("--out", type=Path, default=OUT, help="default out/pairs")
    o = parser.parse_args(arguments)
    seeds = list(itertools.islice(pairs(o.seed), o.count))
    if o.cases and seeds[-1] >= NEW:
        parser.error(f"seeds from {NEW} on are new: only totals are looked at")
    own = [Path(__file__), Path(__file__).with_name("timed.py")]
    own += sorted(Path(generate.__file__).parent.glob("generated/*.py"))
    procedure = [*own, Path(calibrate.__file__), Path(calibrate.__file__).with_name("proof.py")]
    rows, complete = calibrate.run(seeds, o.out, o.jobs, o.limit, o.keep, tried, procedure)
    print("\n".join([*(told(r) for r in rows if o.cases), *lines(rows)]))
    return 0 if complete else 130


if __name__ == "__main__":
    sys.exit(main())
