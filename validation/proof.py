"""Concealed cases, chapter 9 and real recordings diagnosed and compared with their truth: ``make
proof``, or ``python -m validation.proof [case …]``.

Diagnosis sees only ``problem.toml`` and the recordings; ``truth.toml`` is opened here, afterwards.
Writes out/proof/proof.json and index.html. Real recordings are left out where CVXUPDATE_DATA does
not name their folder. A case is that of a folder in problems/concealed, "chapter9" or "real".
"""

from __future__ import annotations

import json
import math
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from jinja2 import Environment

from validation.parallel import workers

HERE = Path(__file__).resolve().parent
PROBLEMS = HERE.parent / "problems"
CASES, OUT = PROBLEMS / "concealed", HERE.parent / "out" / "proof"
NONLINEAR = {"cubic_stiffness", "clearance", "dry_friction", "hysteresis", "quadratic_damping"}
SLOW = 60.0  # seconds a case may take
HALF = 0.5  # what a finding must bring the held-out error down to


def diagnose(case: Path) -> dict[str, Any]:
    """What the command says of a case, as ``diagnosis.json`` has it; its page goes to
    out/proof/<case>/."""
    from cvxupdate.errors import CvxupdateError
    from cvxupdate.report.diagnosis import diagnosis_files
    from cvxupdate.spec import load_problem
    from cvxupdate.study import diagnose as do

    problem = case / "problem.toml"
    try:
        files, payload = diagnosis_files(do(problem), load_problem(problem))
    except CvxupdateError as error:
        return {"verdict": "error", "says": str(error), "findings": [], "fit": {}, "time": None}
    folder = OUT / case.name
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return dict(json.loads(payload))


def right_place(
    found: Mapping[str, Any], truth: Mapping[str, Any], accept: Mapping[str, Any]
) -> bool:
    """Whether a location names what truth names, or a neighbour that truth accepts.

    Elements: at least half of those named are true or accepted ones, and one is. Nodes: all true or
    accepted. A whole group counts for the group.
    """
    dof, kinds = truth.get("dof"), set(accept.get("dofs", ()))
    nodes, elements, groups = (list(found.get(k) or ()) for k in ("nodes", "elements", "groups"))
    true_nodes, true_elements, true_groups = (
        list(truth.get(k) or ()) for k in ("nodes", "elements", "groups")
    )
    if not (true_nodes or true_elements or true_groups):
        return not (nodes or elements or groups)
    if dof and found.get("dof") and found["dof"] != dof and found["dof"] not in kinds:
        return False
    ok_nodes, ok_elements = (
        set(true_nodes) | set(accept.get("nodes", ())),
        set(true_elements) | set(accept.get("elements", ())),
    )
    ok_groups = set(accept.get("groups", ()))
    if groups and (set(groups) & ok_groups):
        return True
    if elements and true_elements:
        close = set(elements) & ok_elements
        return len(close) >= 0.5 * len(elements) and (
            not nodes or not true_nodes or set(nodes) <= ok_nodes
        )
    if nodes and true_nodes:
        return set(nodes) <= ok_nodes and len(set(nodes)) >= min(2, len(set(true_nodes)))
    if elements and accept.get("elements"):
        return set(elements) <= ok_elements
    return bool(groups and true_groups and not true_elements and set(groups) <= set(true_groups))


def named(found: Mapping[str, Any], truth: Mapping[str, Any]) -> tuple[bool, bool, bool]:
    """(physics right, place right, reached only through what truth calls equivalent)."""
    accept = truth.get("accept", {})
    place = right_place(found["location"], truth["location"], accept)
    if found["physics"] == truth["physics"]:
        return True, place, False
    for other in truth.get("equivalent", ()):
        if found["physics"] == other["physics"]:
            return True, right_place(found["location"], other["location"], {}), True
    return False, place, False


def sizes(found: Mapping[str, Any], truth: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Each true parameter beside the one found: value, relative error, within the tolerance or
    not."""
    rows = []
    for q in truth.get("parameters", ()):
        value = next(
            (
                found["parameters"][n]
                for n in (q["name"], *q.get("aliases", ()))
                if n in found["parameters"]
            ),
            None,
        )
        off = None if value is None else abs(value - q["value"]) / abs(q["value"])
        rows.append(
            {
                "name": q["name"],
                "true": q["value"],
                "found": value,
                "off": off,
                "required": bool(q.get("required", True)),
                "right": off is not None and off <= q["tolerance"],
            }
        )
    return rows


def judge(said: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    """A case judged: verdict, physics, place, size, hold-out, time, and all of them together."""
    effects, findings = list(truth.get("findings", ())), list(said["findings"])
    nonlinear = any(e["physics"] in NONLINEAR for e in effects)
    fit = said.get("fit", {})
    key = "hold_out" if fit.get("hold_out", {}).get("before") is not None else "fit"
    before, after = (fit.get(key, {}).get(k) for k in ("before", "after"))
    claimed = bool(findings) and said["verdict"] in ("missing_physics", "parameter_error")
    halved = (
        before is not None and after is not None and after <= HALF * before if claimed else None
    )
    seconds = said.get("time")
    quick = seconds is not None and seconds <= SLOW
    common = {
        "verdict": said["verdict"],
        "true_verdict": truth["verdict"],
        "says": said["says"],
        "score": key,
        "before": before,
        "after": after,
        "halved": halved,
        "time": seconds,
        "quick": quick,
        "nonlinear": nonlinear,
        "claimed": claimed,
        "truth": "; ".join(f"{e['physics']} at {place_text(e['location'])}" for e in effects)
        or "nothing",
        "found": "; ".join(f"{f['physics']} at {place_text(f['location'])}" for f in findings)
        or "nothing",
        "confidence": max((f["confidence"] for f in findings), default=None),
    }
    if nonlinear and not any(f["physics"] in NONLINEAR for f in findings):
        return {
            **common,
            "right_verdict": False,
            "physics": False,
            "place": False,
            "sizes": [],
            "size": None,
            "equivalent": False,
            "linear_sentence": claimed,
            "right": False,
        }
    verdict = said["verdict"] in truth["accept"]
    physics = place = size = True
    equivalent = False
    rows: list[dict[str, Any]] = []
    for effect in effects:
        results = [(*named(f, effect), f) for f in findings]
        best = max(results, key=lambda r: (r[0] and r[1], r[0], r[1]), default=None)
        if best is None:
            physics = place = size = False
            continue
        physics, place, equivalent = physics and best[0], place and best[1], equivalent or best[2]
        mine = sizes(best[3], effect) if best[0] and best[3]["physics"] == effect["physics"] else []
        rows += mine
        size = size and bool(mine) and all(r["right"] for r in mine if r["required"])
    if not effects:
        physics = place = size = said["verdict"] != "missing_physics"
    spurious = bool(effects) and len(findings) > len(
        effects
    )  # one sentence too many is a wrong sentence
    right = verdict and physics and place and halved is not False and not spurious
    return {
        **common,
        "right_verdict": verdict,
        "physics": physics,
        "place": place,
        "sizes": rows,
        "size": size,
        "equivalent": equivalent,
        "spurious": spurious,
        "right": right,
    }


def place_text(location: Mapping[str, Any]) -> str:
    """A location, briefly."""
    nodes, elements, groups = (list(location.get(k) or ()) for k in ("nodes", "elements", "groups"))
    parts = [f"n{'-'.join(map(str, nodes))}"] if nodes else []
    if groups and not nodes:
        parts.append(f"'{', '.join(groups)}'")
    if elements:
        parts.append("e" + ",".join(map(str, elements[:6])) + ("…" if len(elements) > 6 else ""))
    return (
        " ".join(parts + ([str(location["dof"])] if location.get("dof") else []))
        or "the whole structure"
    )


def totals(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[int]]:
    """(right, of how many) of each requirement."""
    linear = [r for r in rows if not r["nonlinear"]]
    bent = [r for r in rows if r["nonlinear"]]
    effects = [r for r in linear if r["true_verdict"] != "consistent"]

    def share(of: Sequence[Mapping[str, Any]], key: str) -> list[int]:
        return [sum(bool(r[key]) for r in of), len(of)]

    return {
        "linear physics: verdict, physics and place right": share(linear, "right"),
        "verdict right": share(linear, "right_verdict"),
        "physics named": share(effects, "physics"),
        "place found": share(effects, "place"),
        "size within tolerance": share(effects, "size"),
        "nothing found where nothing is": share(
            [r for r in linear if r["true_verdict"] == "consistent"], "right"
        ),
        "nonlinear physics: verdict, physics and place right": share(bent, "right"),
        "nonlinear: no linear sentence claimed": [
            sum(not r.get("linear_sentence", False) for r in bent),
            len(bent),
        ],
        "held-out error halved where something is claimed": share(
            [r for r in rows if r["claimed"]], "halved"
        ),
        f"within {SLOW:.0f} s": share(rows, "quick"),
    }


def short(value: float | None) -> str:
    """Three digits; a dash for nothing."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.3g}"


def concealed(wanted: Sequence[str]) -> list[dict[str, Any]]:
    """The concealed cases, judged."""
    cases = sorted(
        p.parent for p in CASES.glob("*/truth.toml") if not wanted or p.parent.name in wanted
    )
    rows = []
    with workers(2) as pool:
        for case, said in zip(cases, pool.map(diagnose, cases), strict=True):
            row = {
                "case": case.name,
                **judge(said, tomllib.loads((case / "truth.toml").read_text(encoding="utf-8"))),
            }
            rows.append(row)
            print(
                f"{row['case']}  {'right' if row['right'] else 'WRONG'}  {row['verdict']}: "
                f"{row['found']}  [true: {row['truth']}]  {short(row['before'])} -> "
                f"{short(row['after'])}, {short(row['time'])} s",
                flush=True,
            )
    return rows


def chapter9() -> list[dict[str, Any]]:
    """Structures A and B."""
    from validation.proof_chapter9 import PLATES, judge, truth_of

    rows = []
    with workers(2) as pool:
        for name, said in zip(
            PLATES, pool.map(diagnose, [PROBLEMS / n for n in PLATES]), strict=True
        ):
            row = {"case": name, **judge(said, truth_of(name))}
            rows.append(row)
            print(
                f"{name}  {'right' if row['right'] else 'WRONG'}  {row['says']}  mean error "
                f"{short(row['before'])} -> {short(row['after'])} % with {row['parameters']} "
                f"parameters, {short(row['time'])} s",
                flush=True,
            )
    return rows


def real() -> list[dict[str, Any]]:
    """The claims on real recordings; empty where they are not there."""
    from validation.real import table

    if table.data_root() is None:
        print("Real recordings: CVXUPDATE_DATA names no folder, left out.")
        return []
    from validation.real import diagnoses

    rows = [asdict(c) for c in diagnoses.claims()]
    for r in rows:
        print(
            f"{r['data']}  {r['case']}  "
            f"{({True: 'right', False: 'WRONG'}).get(r['right'], 'not known')}  {r['claimed']}",
            flush=True,
        )
    return rows


def main(wanted: Sequence[str]) -> int:
    """Diagnose, compare, write the page, print the totals; exit status 0 whatever they are."""
    known = {p.parent.name for p in CASES.glob("*/truth.toml")} | {"chapter9", "real"}
    if not set(wanted) <= known:
        print(
            f"no such case: {', '.join(sorted(set(wanted) - known))}. There are "
            f"{', '.join(sorted(known))}.",
            file=sys.stderr,
        )
        return 2
    OUT.mkdir(parents=True, exist_ok=True)
    rows = concealed(wanted) if not wanted or set(wanted) & (known - {"chapter9", "real"}) else []
    plates = chapter9() if not wanted or "chapter9" in wanted else []
    claims = real() if not wanted or "real" in wanted else []
    counted = totals(rows) if rows else {}
    if plates:
        counted["chapter 9: effects, place, fit"] = [sum(r["right"] for r in plates), len(plates)]
    if claims:
        judged = [r for r in claims if r["right"] is not None]
        counted["real recordings: claims that can be checked, right"] = [
            sum(r["right"] for r in judged),
            len(judged),
        ]
    environment = Environment(autoescape=True)
    environment.filters["short"] = short
    payload = {"totals": counted, "cases": rows, "chapter9": plates, "real": claims}
    (OUT / "proof.json").write_text(
        json.dumps(payload, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )
    page = (HERE / "proof.html").read_text(encoding="utf-8")
    (OUT / "index.html").write_text(
        environment.from_string(page).render(
            rows=rows, plates=plates, claims=claims, totals=counted
        ),
        encoding="utf-8",
    )
    print()
    for name, (good, of) in counted.items():
        print(f"{name:<52} {good:>3} of {of}")
    print(f"Page: {OUT / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
