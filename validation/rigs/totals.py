"""Totals of judged cases: per family and kind of recording, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from validation.calibrate import rate, reliability, wilson
from validation.rigs.judge import GOOD, RIGHT, STATED

Row = Mapping[str, Any]


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """All totals. A case that failed or took too long has said nothing: its effects are missed."""
    families, kinds = (sorted({r[k] for r in rows}) for k in ("family", "recording"))
    some = {"all": list(rows)}
    some |= {k: [r for r in rows if r["recording"] == k] for k in kinds}
    some |= {f: [r for r in rows if r["family"] == f] for f in families}
    some |= {
        f"{f}, {k}": [r for r in some[f] if r["recording"] == k]
        for f in families
        for k in kinds
        if len(kinds) > 1
    }
    findings = [
        {**f, "right": f["status"] != "wrong", "seed": r["seed"], "truth": r["truth"]}
        for r in rows
        for f in r["findings"]
    ]
    words = sorted({e["physics"] for r in rows for e in r["effects"]})
    effects = [e for r in rows for e in r["effects"]]
    seconds, cpu = (sorted(r[k] for r in rows) for k in ("seconds", "cpu"))
    return {
        "parts": {name: part(mine) for name, mine in some.items() if mine},
        "by_word": {w: named([e for e in effects if e["physics"] == w]) for w in words},
        "verdicts": {
            "nothing concealed": _verdicts([r for r in rows if not r["effects"]]),
            "something concealed": _verdicts([r for r in rows if r["effects"]]),
        },
        "findings": {
            s: sum(f["status"] == s for f in findings)
            for s in ("concealed", "rig", "besides", "scatter", "wrong")
        },
        "wrong_with_truth_among_equivalents": sum(
            f["status"] == "wrong" and f["among"] for f in findings
        ),
        "reliability": reliability(findings),
        "seconds_median": seconds[len(seconds) // 2] if seconds else None,
        "seconds_most": seconds[-1] if seconds else None,
        "cpu_median": cpu[len(cpu) // 2] if cpu else None,
        "cpu_most": cpu[-1] if cpu else None,
    }


def part(rows: Sequence[Row]) -> dict[str, Any]:
    """The rates of some cases."""
    nulls = [r for r in rows if not r["effects"]]
    wrong = sum(r["wrong"] for r in rows)
    return {
        "cases": len(rows),
        "failed": sum(bool(r.get("why")) for r in rows),
        "wrong": wrong,
        "wrong_interval": wilson(wrong, len(rows)),
        "wrong_at_all": sum(r["wrong_at_all"] for r in rows),
        "nulls": len(nulls),
        "false_alarms": sum(r["wrong"] for r in nulls),
        "false_alarms_at_all": sum(r["wrong_at_all"] for r in nulls),
        **named([e for r in rows for e in r["effects"]]),
    }


def named(effects: Sequence[Row]) -> dict[str, Any]:
    """How concealed effects were named: visible ones and faint ones apart."""
    seen = [e for e in effects if e["visible"]]
    faint = [e for e in effects if not e["visible"]]
    hits = [e for e in seen if e["named"] in GOOD]
    judged = [e for e in hits if e["size"] is not None]
    return {
        "visible": len(seen),
        "right": sum(e["named"] == RIGHT for e in seen),
        "named": len(hits),
        "named_interval": wilson(len(hits), len(seen)),
        "named_and_sure": sum(e["confidence"] >= STATED for e in hits),
        "sizes_right": sum(bool(e["size"]) for e in judged),
        "sizes_judged": len(judged),
        "faint": len(faint),
        "faint_named": sum(e["named"] in GOOD for e in faint),
    }


def _verdicts(rows: Sequence[Row]) -> dict[str, int]:
    said = [r["verdict"] or "no answer" for r in rows]
    return {v: said.count(v) for v in sorted(set(said))}


def say(s: Mapping[str, Any]) -> Iterable[str]:
    """The totals as lines of text."""
    yield (
        f"{'95 % intervals':<20}{'cases':>6}{'failed':>7}{'wrong, ≥ 0.5':>20}{'at all':>7}"
        f"{'null: wrong ≥ 0.5':>20}{'visible, named':>22}{'≥ 0.5':>6}{'right':>6}"
        f"{'sizes':>9}{'faint':>8}"
    )
    for name, p in s["parts"].items():
        yield (
            f"{name:<20}{p['cases']:>6}{p['failed']:>7}{rate(p['wrong'], p['cases']):>20}"
            f"{p['wrong_at_all']:>7}{rate(p['false_alarms'], p['nulls']):>20}"
            f"{rate(p['named'], p['visible']):>22}{p['named_and_sure']:>6}{p['right']:>6}"
            f"{p['sizes_right']:>6}/{p['sizes_judged']:<2}{p['faint_named']:>5}/{p['faint']:<2}"
        )
    yield "By what is concealed: visible ones named (right place and word; size right)"
    for word, p in s["by_word"].items():
        yield (
            f"  {word:<22}{rate(p['named'], p['visible']):>22}  ({p['right']} right; "
            f"{p['sizes_right']} of {p['sizes_judged']} sizes)"
        )
    for what, counts in s["verdicts"].items():
        yield f"Verdicts, {what}: " + ", ".join(f"{v} {n}" for v, n in counts.items())
    yield (
        "Findings: "
        + ", ".join(f"{n} {k}" for k, n in s["findings"].items())
        + f"; of the wrong ones {s['wrong_with_truth_among_equivalents']} have the truth among "
        "their equivalents"
    )
    yield "Confidence     not wrong"
    for b in s["reliability"]:
        yield (
            f"{b['from']:.2f}–{b['to']:.2f}      {b['rate']:.2f}  ({b['hits']} of {b['of']}; "
            f"{b['interval'][0]:.2f} to {b['interval'][1]:.2f})"
        )
    if s["seconds_median"] is not None:
        yield (
            f"Seconds a case: median {s['seconds_median']:.1f}, most {s['seconds_most']:.1f}; "
            f"of the processor {s['cpu_median']:.1f} and {s['cpu_most']:.1f}."
        )


def told(row: Row) -> str:
    """One case on a line."""
    found = "; ".join(
        f"{f['physics']} at {_place(f['location'])} {_sizes(f)} ({f['confidence']:.2f}, "
        f"{f['status']}{', part' if f['grade'] == 'part' else ''})"
        for f in row["findings"]
    )
    effects = ", ".join(
        f"{e['margin']:.3g}{'' if e['visible'] else ' faint'} {e['named'] or 'not named'}"
        for e in row["effects"]
    )
    rig = f" | rig: {row['rig']}" if row["rig"] else ""
    return (
        f"{row['seed']} {'WRONG' if row['wrong'] else '     '} {row['family']}, "
        f"{row['recording']}: {row['truth']} [{effects}]{rig} -> "
        f"{row.get('why') or row['verdict']}: {found}  {row['seconds']:.0f} s ({row['cpu']:.0f} s)"
    )


def _place(where: Mapping[str, Any]) -> str:
    names = [
        f"{k} {' '.join(map(str, where[k][:5]))}{'…' if len(where[k]) > 5 else ''}"
        for k in ("nodes", "elements", "groups")
        if where.get(k)
    ]
    return " ".join([*names, where.get("dof") or ""]).strip()


def _sizes(f: Mapping[str, Any]) -> str:
    return ", ".join(
        f"{n} {v:.4g}"
        + (f" ± {f['deviation'][n]:.2g}" if f["deviation"].get(n) is not None else "")
        for n, v in f["parameters"].items()
        if v is not None
    )
