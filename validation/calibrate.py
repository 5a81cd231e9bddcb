"""Diagnosis tried on generated problems: false alarms, hits, and confidence against hit rate.
``make calibrate``.

``python -m validation.calibrate [--seed 1000] [--count 200] [--only WORD …] [--jobs 2]``. Each case
is one file in out/calibrate/cases, written whole when the case is done: an interrupted run keeps
what is finished, and the same command goes on from there. Results of another state of the package
are done again (``--keep`` takes them as they are). Totals go to the terminal,
out/calibrate/calibration.json and out/calibrate/index.html.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import json
import math
import os
import signal
import sys
import tempfile
import threading
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cvxupdate.parallel import Where, spread
from validation import generate
from validation.proof import named, place_text, short, sizes

HERE = Path(__file__).resolve().parent
EVALUATION = 1000  # first seed of the evaluation; below it are the seeds for development
OUT = HERE.parent / "out" / "calibrate"
BINS = (0.0, 0.5, 0.7, 0.85, 0.95, 1.0001)
STRENGTHS = (
    (0.0, 1.0),
    (1.0, 3.0),
    (3.0, 10.0),
    (10.0, math.inf),
)  # of what nuisance parameters leave of an effect (generated/visible.py)
SCHEDULER = "address of a dask cluster that does the cases in place of processes"
SURE = 0.8  # a wrong sentence with at least this confidence is listed
OUTCOMES = (
    "right",
    "part",
    "wrong",
    "missed",
    "undetermined",
    "silent",
    "doubt",
    "false alarm",
    "failed",
)


class TooLong(Exception):
    """A case took longer than it may."""


def fingerprint(procedure: Sequence[Path] = ()) -> str:
    """Of the package that is imported and of a procedure's files (this one's): results belong to
    one state of both."""
    import cvxupdate

    root = Path(str(cvxupdate.__file__)).parent
    digest = hashlib.sha256()
    own = [*sorted((HERE / "generated").glob("*.py")), HERE / "proof.py", HERE / "calibrate.py"]
    for path in [*sorted(root.rglob("*.py")), *(procedure or own)]:
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:12]


# ----------------------------------------------------------------------------------------- one case


AGAIN = 5.0  # seconds after which a signal is sent again


@contextmanager
def alarmed(limit: float, processor: bool = False) -> Iterator[None]:
    """Raise TooLong in what takes longer than ``limit`` seconds, by the clock or of the processor;
    in a thread (of a worker of dask), where no signal comes, nothing is limited. What is raised in
    a callback of the interpreter is lost, so it is sent again."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    timer, sent = (
        (signal.ITIMER_PROF, signal.SIGPROF) if processor else (signal.ITIMER_REAL, signal.SIGALRM)
    )

    def alarm(number: int, frame: object) -> None:
        raise TooLong

    before = signal.signal(sent, alarm)
    signal.setitimer(timer, limit, AGAIN)
    try:
        yield
    finally:
        signal.setitimer(timer, 0.0)
        signal.signal(sent, before)


def attempt(seed: int, folder: Path, state: str, limit: float) -> dict[str, Any]:
    """Generate, diagnose and judge one case, and write its file; a case that fails or takes longer
    than ``limit`` seconds is an outcome too."""
    begin = time.perf_counter()
    try:
        with alarmed(limit), tempfile.TemporaryDirectory() as name:
            generate.make(seed, Path(name))
            truth = tomllib.loads((Path(name) / "truth.toml").read_text(encoding="utf-8"))
            row = judged(diagnose(Path(name) / "problem.toml"), truth)
    except TooLong:
        row = failed(f"longer than {limit:.0f} s")
    except (
        Exception
    ) as error:  # whatever goes wrong in one case is reported with it and leaves the others alone
        row = failed(f"{type(error).__name__}: {error}")
    row = {"seed": seed, "state": state, "seconds": round(time.perf_counter() - begin, 2), **row}
    save(
        folder / f"{seed}.json",
        json.dumps(row, ensure_ascii=False, indent=1, allow_nan=False) + "\n",
    )
    return row


def diagnose(problem: Path) -> dict[str, Any]:
    """What the command says, as ``diagnosis.json`` has it; its page is not drawn."""
    from cvxupdate.report.as_json import dumps, plain
    from cvxupdate.study import diagnose as do

    return dict(json.loads(dumps(plain(do(problem).to_json()))))


def failed(why: str) -> dict[str, Any]:
    """A case without a verdict."""
    return {
        "outcome": "failed",
        "why": why,
        "family": "",
        "recording": "",
        "words": [],
        "visible": [],
        "left": [],
        "noise": None,
        "truth": "",
        "verdict": "",
        "right_verdict": False,
        "says": "",
        "findings": [],
        "fit": {},
    }


def save(path: Path, text: str) -> None:
    """Write a whole file or none."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(f".{os.getpid()}.part")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)


def described(effect: Mapping[str, Any]) -> str:
    """A true effect, briefly."""
    sizes_of = ", ".join(f"{p['name']} {short(p['value'])}" for p in effect.get("parameters", ()))
    return f"{effect['physics']} at {place_text(effect['location'])}" + (
        f" ({sizes_of})" if sizes_of else ""
    )


def names(finding: Mapping[str, Any], effect: Mapping[str, Any]) -> bool:
    """Word and place of an effect, or of what is equivalent to it; what acts between two nodes is
    not told by one of them."""
    if not all(named(finding, effect)[:2]):
        return False
    same = [
        x["location"]
        for x in (effect, *effect.get("equivalent", ()))
        if x["physics"] == finding["physics"]
    ]
    pairs = [set(x["nodes"]) for x in same if len(x["nodes"]) == 2 and not x["elements"]]
    return len(pairs) < len(same) or set(finding["location"].get("nodes", ())) in pairs


def fresh(finding: Mapping[str, Any], effect: Mapping[str, Any], told: set[int] | None) -> bool:
    """Whether a finding says something of an effect that was not said before: nothing was (``told``
    None), or it names another part of it (the elements named before are ``told``). A second
    sentence in other words about the same thing is one too many."""
    elements = set(finding["location"].get("elements", ()))
    return told is None or (
        finding["physics"] == effect["physics"] and bool(elements) and not elements & told
    )


def judged(said: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    """A diagnosis beside its truth.

    Each finding is right when it names a true effect at its place, or what truth lists as
    equivalent to it (once: see `fresh`); ``among`` when the truth is at least among the finding's
    own equivalents. The case is ``right`` when all effects are found and nothing else is said,
    ``part`` when one of two is, ``wrong`` when any finding is wrong, ``missed`` when nothing is
    found to be missing, ``undetermined`` when only that something is; without an effect ``silent``,
    ``doubt`` or ``false alarm``.
    """
    effects = list(truth.get("findings", ()))
    claimed = (
        list(said["findings"]) if said["verdict"] in ("missing_physics", "parameter_error") else []
    )
    findings: list[dict[str, Any]] = []
    found: dict[int, set[int]] = {}
    for f in claimed:
        among = any(names(q, e) for e in effects for q in (f, *f.get("equivalent", ())))
        hit = next(
            (i for i, e in enumerate(effects) if names(f, e) and fresh(f, e, found.get(i))), None
        )
        if hit is not None:
            found.setdefault(hit, set()).update(f["location"].get("elements", ()))
        mine = (
            sizes(f, effects[hit])
            if hit is not None and f["physics"] == effects[hit]["physics"]
            else []
        )
        findings.append(
            {
                "physics": f["physics"],
                "place": place_text(f["location"]),
                "location": f["location"],
                "parameters": f["parameters"],
                "confidence": f["confidence"],
                "right": hit is not None,
                "among": among,
                "says": f["says"],
                "size": all(s["right"] for s in mine if s["required"]) if mine else None,
                "equivalent": [
                    {"physics": q["physics"], "place": place_text(q["location"])}
                    for q in f.get("equivalent", ())
                ],
            }
        )
    wrong = any(not f["right"] for f in findings)
    if not effects:
        outcome = (
            "false alarm" if claimed else "silent" if said["verdict"] == "consistent" else "doubt"
        )
    elif not claimed:
        outcome = "missed" if said["verdict"] == "consistent" else "undetermined"
    else:
        outcome = "wrong" if wrong else "right" if len(found) == len(effects) else "part"
    laboratory = truth["laboratory"]
    return {
        "outcome": outcome,
        "family": truth["family"],
        "recording": truth["recording"],
        "words": [str(e["physics"]) for e in effects],
        "visible": laboratory["visible"],
        "left": laboratory["left"],
        "noise": laboratory["noise"],
        "truth": "; ".join(map(described, effects)) or "nothing",
        "verdict": said["verdict"],
        "right_verdict": said["verdict"] in truth["accept"],
        "says": said["says"],
        "findings": findings,
        "fit": said.get("fit", {}),
        "standing": said.get("standing"),
        "misfit": said.get("misfit"),
    }


# ------------------------------------------------------------------------------------------- totals


def wilson(hits: int, of: int, z: float = 1.959964) -> tuple[float, float]:
    """95 % interval of a rate (Wilson 1927); (0, 1) of nothing."""
    if of == 0:
        return 0.0, 1.0
    p, n = hits / of, float(of)
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1.0 - p) / n + z * z / (4 * n * n))
    return max(0.0, (middle - half) / (1.0 + z * z / n)), min(
        1.0, (middle + half) / (1.0 + z * z / n)
    )


def reliability(findings: Sequence[Mapping[str, Any]], key: str = "right") -> list[dict[str, Any]]:
    """Confidence against hit rate, bin by bin; empty bins are left out."""
    out = []
    for low, high in itertools.pairwise(BINS):
        inside = [f for f in findings if low <= f["confidence"] < high]
        if inside:
            hits = sum(bool(f[key]) for f in inside)
            out.append(
                {
                    "from": low,
                    "to": min(high, 1.0),
                    "confidence": sum(f["confidence"] for f in inside) / len(inside),
                    "hits": hits,
                    "of": len(inside),
                    "rate": hits / len(inside),
                    "interval": wilson(hits, len(inside)),
                }
            )
    return out


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """All totals of finished cases."""
    nulls = [r for r in rows if not r["words"] and r["outcome"] != "failed"]
    effects = [r for r in rows if r["words"] and r["outcome"] != "failed"]
    findings = [{**f, "seed": r["seed"], "truth": r["truth"]} for r in rows for f in r["findings"]]
    alarms = sum(r["outcome"] == "false alarm" for r in nulls)
    claimed = [r for r in effects if r["findings"]]
    right = sum(r["outcome"] in ("right", "part") for r in claimed)
    words = sorted({w for r in effects for w in r["words"]})
    return {
        "cases": len(rows),
        "nulls": len(nulls),
        "effects": len(effects),
        "failed": sum(r["outcome"] == "failed" for r in rows),
        "false_alarms": alarms,
        "false_alarm_rate": alarms / len(nulls) if nulls else None,
        "false_alarm_interval": wilson(alarms, len(nulls)),
        "doubts": sum(r["outcome"] == "doubt" for r in nulls),
        "claimed": len(claimed),
        "claims_right": right,
        "claims_right_interval": wilson(right, len(claimed)),
        "outcomes": {o: sum(r["outcome"] == o for r in rows) for o in OUTCOMES},
        "by_word": {
            w: {o: sum(r["outcome"] == o for r in effects if w in r["words"]) for o in OUTCOMES[:5]}
            for w in words
        },
        "by_strength": {
            f"{a:g} to {b:g}" if b < math.inf else f"above {a:g}": {
                o: sum(r["outcome"] == o for r in effects if a <= max(r["left"]) < b)
                for o in OUTCOMES[:5]
            }
            for a, b in STRENGTHS
        },
        "by_family": _by(rows, "family"),
        "by_recording": _by(rows, "recording"),
        "rates": rates(rows),
        "findings": len(findings),
        "findings_right": sum(f["right"] for f in findings),
        "findings_right_or_named": sum(f["among"] for f in findings),
        "sizes_right": sum(f["size"] is True for f in findings),
        "sizes_judged": sum(f["size"] is not None for f in findings),
        "brier": sum((f["confidence"] - f["right"]) ** 2 for f in findings) / len(findings)
        if findings
        else None,
        "reliability": reliability(findings),
        "reliability_named": reliability(findings, "among"),
        "wrong_and_sure": [f for f in findings if not f["right"] and f["confidence"] >= SURE],
        "seconds_median": sorted(r["seconds"] for r in rows)[len(rows) // 2] if rows else None,
        "seconds_most": max((r["seconds"] for r in rows), default=None),
    }


def _by(rows: Sequence[Mapping[str, Any]], key: str) -> dict[str, dict[str, int]]:
    return {
        str(v): {o: sum(r["outcome"] == o for r in rows if r[key] == v) for o in OUTCOMES}
        for v in sorted({r[key] for r in rows if r[key]})
    }


def rates(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """False alarms and hits with their intervals, for each family, kind of recording, and both: a
    total over all families hides that one of them is bad."""
    kept = [r for r in rows if r["family"]]
    families, kinds = (sorted({r[k] for r in kept}) for k in ("family", "recording"))
    some = {f"{f}": [r for r in kept if r["family"] == f] for f in families}
    some |= {k: [r for r in kept if r["recording"] == k] for k in kinds}
    some |= {
        f"{f}, {k}": [r for r in some[f] if r["recording"] == k] for f in families for k in kinds
    }
    out = {}
    for name, mine in some.items():
        nulls, effects = ([r for r in mine if bool(r["words"]) == e] for e in (False, True))
        alarms = sum(r["outcome"] == "false alarm" for r in nulls)
        hits = sum(r["outcome"] in ("right", "part") for r in effects)
        wrong = sum(r["outcome"] == "wrong" for r in effects)
        out[name] = {
            "nulls": len(nulls),
            "false_alarms": alarms,
            "false_alarm_interval": wilson(alarms, len(nulls)),
            "effects": len(effects),
            "hits": hits,
            "hit_interval": wilson(hits, len(effects)),
            "wrong": wrong,
            "wrong_interval": wilson(wrong, len(effects)),
        }
    return {name: r for name, r in out.items() if r["nulls"] or r["effects"]}


def rate(hits: int, of: int) -> str:
    """So many of so many, with the 95 % interval in per cent."""
    if not of:
        return "–"
    low, high = wilson(hits, of)
    return f"{hits} of {of} ({100 * low:.0f}–{100 * high:.0f} %)"


def say(s: Mapping[str, Any]) -> Iterable[str]:
    """The totals as lines of text."""
    low, high = s["false_alarm_interval"]
    yield (
        f"Nothing concealed: {s['nulls']} cases, {s['false_alarms']} false alarms "
        f"({100 * (s['false_alarm_rate'] or 0):.1f} %, 95 % interval {100 * low:.1f} to "
        f"{100 * high:.1f} %), {s['doubts']} undetermined."
    )
    low, high = s["claims_right_interval"]
    yield (
        f"Something concealed: {s['effects']} cases; a finding in {s['claimed']}, of which "
        f"right {s['claims_right']} ({100 * low:.0f} to {100 * high:.0f} %)."
    )
    yield (
        f"Findings: {s['findings_right']} of {s['findings']} right; "
        f"{s['findings_right_or_named']} right or with the truth among their equivalents; "
        f"size within tolerance {s['sizes_right']} of {s['sizes_judged']}; Brier score "
        f"{short(s['brier'])}."
    )
    yield f"{'':<28}" + "".join(f"{o:>14}" for o in OUTCOMES[:5])
    for word, counts in s["by_word"].items():
        yield f"{word:<28}" + "".join(f"{counts[o]:>14}" for o in OUTCOMES[:5])
    yield f"{'left by nuisance parameters':<28}" + "".join(f"{o:>14}" for o in OUTCOMES[:5])
    for strength, counts in s["by_strength"].items():
        yield f"{strength:<28}" + "".join(f"{counts[o]:>14}" for o in OUTCOMES[:5])
    for kind in ("by_family", "by_recording"):
        yield f"{kind[3:]:<12}" + "".join(f"{o:>13}" for o in OUTCOMES)
        for name, counts in s[kind].items():
            yield f"{name:<12}" + "".join(f"{counts[o]:>13}" for o in OUTCOMES)
    yield f"{'95 % intervals':<18}{'false alarms':>24}{'right or part':>26}{'wrong':>26}"
    for name, r in s["rates"].items():
        yield (
            f"{name:<18}{rate(r['false_alarms'], r['nulls']):>24}"
            f"{rate(r['hits'], r['effects']):>26}{rate(r['wrong'], r['effects']):>26}"
        )
    yield "Confidence     hit rate"
    for b in s["reliability"]:
        yield (
            f"{b['from']:.2f}–{b['to']:.2f}      {b['rate']:.2f}  ({b['hits']} of {b['of']}; "
            f"{b['interval'][0]:.2f} to {b['interval'][1]:.2f})"
        )
    if s["failed"]:
        yield f"Failed: {s['failed']}."
    yield f"Seconds a case: median {short(s['seconds_median'])}, most {short(s['seconds_most'])}."


def diagram(s: Mapping[str, Any]) -> str:
    """Confidence against hit rate, as an SVG element."""
    from cvxupdate.report.svg import AFTER, QUIET, draw

    def paint(axes: Any) -> None:
        axes.plot([0, 1], [0, 1], color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
        bins = s["reliability"]
        x, y = [b["confidence"] for b in bins], [b["rate"] for b in bins]
        if bins:
            reach = [
                [r - b["interval"][0] for r, b in zip(y, bins, strict=True)],
                [b["interval"][1] - r for r, b in zip(y, bins, strict=True)],
            ]
            axes.errorbar(
                x,
                y,
                yerr=[[max(0.0, v) for v in side] for side in reach],
                fmt="o",
                color=AFTER,
                capsize=3,
            )
        for b in bins:
            axes.annotate(
                f"{b['hits']} of {b['of']}",
                (b["confidence"], b["rate"]),
                textcoords="offset points",
                xytext=(8, -4),
            )
        axes.set_xlim(0.0, 1.05)
        axes.set_ylim(0.0, 1.05)
        axes.set_xlabel("confidence stated")
        axes.set_ylabel("fraction that was right")

    return draw(
        "reliability",
        "Confidence stated against the fraction of findings that were right, with 95 % "
        "intervals; the diagonal is perfect calibration.",
        6.0,
        4.5,
        paint,
    )


def picture(s: Mapping[str, Any]) -> str:
    """`diagram` as a file of its own: the colours that a page would say, said in it."""
    style = "svg{background:#fff;--ink:#1a1a1a;--quiet:#777;--line:#ddd;--after:#1f6f8b}"
    head, body = diagram(s).split(">", 1)
    return f"{head}><style>{style}</style>{body}\n"


def write_page(rows: Sequence[Mapping[str, Any]], folder: Path) -> dict[str, Any]:
    """calibration.json and index.html of finished cases."""
    from jinja2 import Environment

    s = summary(rows)
    save(
        folder / "calibration.json",
        json.dumps({**s, "rows": list(rows)}, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
    )
    environment = Environment(autoescape=True)
    environment.filters["short"] = short
    page = (HERE / "calibrate.html").read_text(encoding="utf-8")
    save(
        folder / "index.html",
        environment.from_string(page).render(
            s=s, rows=rows, outcomes=OUTCOMES, diagram=diagram(s), sure=SURE, rate=rate
        ),
    )
    return s


# ---------------------------------------------------------------------------------------------- run


def finished(
    folder: Path, seeds: Sequence[int], state: str, keep: bool
) -> dict[int, dict[str, Any]]:
    """Results on disk for these seeds: of this state of the package, or of any where ``keep``."""
    out = {}
    for seed in seeds:
        path = folder / f"{seed}.json"
        if path.exists():
            row = json.loads(path.read_text(encoding="utf-8"))
            if keep or row["state"] == state:
                out[seed] = row
    return out


def chosen(first: int, count: int, only: Sequence[str]) -> list[int]:
    """Seeds to do; ``only`` keeps those whose effects, family or kind of recording is named
    ("null": nothing concealed)."""
    seeds = list(range(first, first + count))
    if not only:
        return seeds
    kept = []
    for seed in seeds:
        case = generate.draw(seed)
        labels = {str(f.effect["physics"]) for f in case.findings} or {"null"}
        if (labels | {case.design.family, case.kind}) & set(only):
            kept.append(seed)
    return kept


Attempt = Callable[[int, Path, str, float], dict[str, Any]]


def _opened(one: Attempt) -> Attempt:
    """What a worker does its cases by: there is nothing to open."""
    return one


def attempts(
    seeds: Sequence[int], folder: Path, state: str, limit: float, where: Where, one: Attempt
) -> Iterator[dict[str, Any]]:
    """The rows of all cases, as they are finished; those of a cluster that has another disk are
    written down here."""
    tasks = [(s, folder, state, limit) for s in seeds]
    for row in spread(tasks, _opened, {"one": one}, where):
        file = folder / f"{row['seed']}.json"
        if where.scheduler is not None and not file.is_file():
            save(file, json.dumps(row, ensure_ascii=False, indent=1, allow_nan=False) + "\n")
        yield row


def run(
    seeds: Sequence[int],
    folder: Path,
    jobs: int,
    limit: float,
    keep: bool = False,
    one: Attempt = attempt,
    procedure: Sequence[Path] = (),
    scheduler: str | None = None,
) -> tuple[list[dict[str, Any]], bool]:
    """(rows of all finished cases in the order of ``seeds``, whether all are). ``one`` does a case,
    ``procedure`` are the files that its results depend on beside the package; ``scheduler`` is the
    address of a dask cluster that takes the place of ``jobs`` processes."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    state, cases = fingerprint(procedure), folder / "cases"
    done = finished(cases, seeds, state, keep)
    rest = [s for s in seeds if s not in done]
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("calibrate", total=len(seeds), completed=len(done))
        try:
            for row in attempts(rest, cases, state, limit, Where(jobs, scheduler), one):
                done[row["seed"]] = row
                progress.advance(task)
        except KeyboardInterrupt:
            done |= finished(cases, seeds, state, keep)
    return [done[s] for s in seeds if s in done], len(done) == len(seeds)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or go on; exit status 130 after an interruption, which keeps what is finished."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument(
        "--seed",
        type=int,
        default=EVALUATION,
        help=f"first seed (default {EVALUATION}, the evaluation; take one below it while "
        "developing)",
    )
    parser.add_argument("--count", type=int, default=200, help="how many seeds (default 200)")
    parser.add_argument(
        "--only",
        nargs="+",
        default=[],
        metavar="NAME",
        help="only these effects, families or kinds of recording; null: no effect",
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--scheduler", default=None, help=SCHEDULER)
    parser.add_argument(
        "--limit", type=float, default=300.0, help="seconds a case may take (default 300)"
    )
    parser.add_argument(
        "--keep",
        action="store_true",
        help="take results of other states of the package as they are",
    )
    parser.add_argument(
        "--cases", action="store_true", help="print each case (never with the evaluation's seeds)"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="default out/calibrate")
    options = parser.parse_args(arguments)
    rows, complete = run(
        chosen(options.seed, options.count, options.only),
        options.out,
        options.jobs,
        options.limit,
        options.keep,
        scheduler=options.scheduler,
    )
    if options.cases:
        for r in rows:
            print(
                f"{r['seed']:>5} {r['outcome']:<12} {r['family']:<6} {r['recording']:<6} "
                f"{r['truth']} [left {', '.join(map(short, r['left']))}] -> "
                + (
                    r.get("why")
                    or "; ".join(
                        f"{f['physics']} at {f['place']} ({f['confidence']:.2f})"
                        for f in r["findings"]
                    )
                    or r["verdict"]
                )
                + f"  {r['seconds']:.0f} s"
            )
    for line in say(write_page(rows, options.out)):
        print(line)
    print(f"Page: {options.out / 'index.html'}")
    return 0 if complete else 130


if __name__ == "__main__":
    sys.exit(main())
