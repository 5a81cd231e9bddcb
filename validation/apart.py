"""Is what ``plan --diagnosis`` proposes worth measuring? ``python -m validation.apart``.

Generated problems of sparsely measured structures (two sensors, FRFs) are diagnosed; where a
finding has equivalents, the laboratory makes the set of responses that is proposed, and as many
others chosen at random among those that were compared, and the problem is diagnosed again with
each; ``--singles`` likewise with one response instead of a set. Where the plan's headline is
another boundary, the laboratory makes that, and another one at random, and the structure is
diagnosed there; left is what both diagnoses list. What counts is how often one
explanation is left, and whether that is the true one. The first diagnosis of each seed lies in
out/apart/first, one file a case in out/apart/cases; the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.commands.plan import plan
from cvxupdate.commands.planned import Diagnosed
from cvxupdate.diagnose.apart import Apart, Measurement
from cvxupdate.errors import CvxupdateError
from validation.boundary import left_of, under
from validation.calibrate import diagnose, judged, rate, save
from validation.generated.cases import Case, draw
from validation.generated.files import modal, write
from validation.generated.laboratory import build
from validation.generated.recordings import frf

OUT = Path(__file__).resolve().parent.parent / "out" / "apart"
FIRST, COUNT = 600, 60  # seeds for development
SENSORS = 2  # with so few, much is alike
SETS, SINGLES = ("together", "random set"), ("proposed", "random")
HEADLINE, ANY = "headline", "random like it"  # what the plan proposes first; another of the kind


def sparse(seed: int) -> Case | None:
    """The case of a seed with `SENSORS` sensors and FRFs; None where nothing is concealed, or a
    sensor is at fault."""
    case = draw(seed)
    if not case.findings or any(f.effect["physics"] == "sensor_fault" for f in case.findings):
        return None
    rng = np.random.default_rng([20261123, seed])
    some = rng.choice(len(case.sensors), min(SENSORS, len(case.sensors)), replace=False)
    sensors = tuple(case.sensors[int(i)] for i in some)
    return replace(case, kind="frf", sensors=sensors, drives=(sensors[0], sensors[0]))


def first(seed: int, problem: Path) -> dict[str, Any]:
    """The diagnosis of a case as it is, kept whole."""
    path = OUT / "first" / f"{seed}.json"
    if not path.is_file():
        save(path, json.dumps(diagnose(problem), ensure_ascii=False) + "\n")
    return dict(json.loads(path.read_text(encoding="utf-8")))


def attempt(seed: int, ways: Sequence[str]) -> dict[str, Any]:
    """Diagnosed as it is; with what is proposed; with other measurements."""
    case = sparse(seed)
    if case is None:
        return {"seed": seed, "skipped": True}
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(case, folder)
        truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
        said = first(seed, folder / "problem.toml")
        row = {
            "seed": seed,
            "first": _row(said, truth),
        }
        if not any(f["equivalent"] for f in row["first"]["findings"]):
            return row
        try:
            found = plan(folder / "problem.toml", None, Diagnosed(said, "diagnosis"))
        except CvxupdateError as err:
            return {**row, "why": str(err)}
        assert found.apart is not None
        further = [m for m in found.apart.measurements if m.kind == "response"]
        several = found.apart.together
        if not further or several is None:
            return row
        rng = np.random.default_rng([20261124, seed])
        one = further[int(rng.integers(len(further)))]
        size = len(several.measurements)
        other = rng.choice(len(further), size, replace=False)
        chosen: dict[str, Sequence[Measurement]] = {
            "together": several.measurements,
            "random set": [further[int(k)] for k in other],
            "proposed": further[:1],
            "random": [one],
        }
        least = {"together": several.least, "proposed": further[0].least}
        row["explanations"] = [e.title for e in found.apart.explanations]
        row["foretold"] = [several.before, several.after, several.left]
        # nothing tells what is one and the same to everything that was tried: said so, not counted
        row["same"] = set(found.apart.pairs) == set(found.apart.same)
        row |= headline(case, found.apart, folder, row, truth)
        for way in ways:
            row[way] = {"says": "; ".join(m.says for m in chosen[way]), "least": least.get(way)}
            again = measured(case, chosen[way], folder, way)
            said = diagnose(again)
            row[way] |= _row(said, truth)
            row[way]["alike"] = not row[way]["one"] and alike(again, said)
    return {**row, "seconds": round(time.perf_counter() - begin, 1)}


def headline(
    case: Case, apart: Apart, folder: Path, row: Mapping[str, Any], truth: Mapping[str, Any]
) -> dict[str, Any]:
    """Another boundary where that is proposed first, and one at random; nothing else."""
    best = apart.proposed[0]
    changes = [m for m in apart.measurements if m.is_boundary]
    if not best.is_boundary or under(case, best) is None:
        return {}
    rng = np.random.default_rng([20261126, case.seed])
    made = [m for m in changes if under(case, m) is not None]
    out: dict[str, Any] = {}
    for way, change in ((HEADLINE, best), (ANY, made[int(rng.integers(len(made)))])):
        there = under(case, change)
        assert there is not None
        write(there, folder / way)
        said = _row(diagnose(folder / way / "problem.toml"), truth)
        left = left_of(row["first"]["findings"], said["findings"])
        one = all(len(names) == 1 for names in left)
        out[way] = said | {"says": change.says, "left": left, "one": one, "alike": False}
    return out


def alike(problem: Path, said: Mapping[str, Any]) -> bool:
    """Whether what is still listed is one and the same to all that could be measured, as the plan
    then says."""
    if not said["findings"]:
        return False
    try:
        found = plan(problem, None, Diagnosed(said, "diagnosis")).apart
    except CvxupdateError:
        return False
    return found is not None and bool(found.pairs) and set(found.pairs) == set(found.same)


def measured(case: Case, chosen: Sequence[Measurement], folder: Path, name: str) -> Path:
    """The problem with further FRFs made in the laboratory, one file for each drive."""
    rng = np.random.default_rng([20261125, case.seed])
    bench = modal(build(case.design, case.scatter, case.effects), case.top, case.zeta)
    text = (folder / "problem.toml").read_text(encoding="utf-8")
    stem = name.replace(" ", "_")
    for k, at in enumerate(dict.fromkeys(m.drive for m in chosen)):
        drive = _dof(at)
        sensors = tuple(_dof(m.sensor) for m in chosen if m.drive == at)
        arrays = frf(rng, bench, replace(case, sensors=sensors, drives=(drive, drive)), drive)
        averages = int(arrays.pop("averages"))
        np.savez(folder / f"{stem}_{k}.npz", **arrays)
        text += (
            f'[[recordings]]\nkind = "frf"\nuse = "fit"\nfile = "{stem}_{k}.npz"\n'
            f'response = "acceleration"\naverages = {averages}\n'
        )
    path = folder / f"{stem}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _dof(label: str) -> tuple[int, str]:
    node, _, dof = label[1:].partition(".")
    return int(node), dof


def _row(said: Mapping[str, Any], truth: Mapping[str, Any]) -> dict[str, Any]:
    row = judged(said, truth)
    kept = ("outcome", "family", "words", "truth", "verdict", "findings")
    left = [len(f["equivalent"]) for f in row["findings"]]
    return {**{k: row[k] for k in kept}, "one": bool(left) and not any(left)}


def ruled_out(rows: Sequence[Mapping[str, Any]], way: str) -> tuple[int, int]:
    """How many of the equivalents at first are none any more, and of how many: further ones may
    have come up that were not compared."""
    gone = whole = 0
    for r in rows:
        now = [q for f in r[way]["findings"] for q in (f, *f["equivalent"])]
        left = {(q["physics"], q["place"]) for q in now}
        before = [q for f in r["first"]["findings"] for q in f["equivalent"]]
        whole += len(before)
        gone += sum((q["physics"], q["place"]) not in left for q in before)
    return gone, whole


def told(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """The totals, line by line."""
    out = [f"{len(rows)} cases, {sum('explanations' in r for r in rows)} with equivalents"]
    for way in (*SETS, *SINGLES, HEADLINE, ANY):
        asked = [r for r in rows if way in r and not r["same"]]
        if not asked:
            continue
        one = [r for r in asked if r[way]["one"]]
        right = [r for r in one if r[way]["outcome"] == "right"]
        wrong = [r for r in asked if r[way]["outcome"] == "wrong"]
        out.append(
            f"{way:10s} one explanation left {rate(len(one), len(asked))}, the true one "
            f"{len(right)}; others that nothing tells {sum(r[way]['alike'] for r in asked)}; "
            f"something wrong said {len(wrong)}; "
            f"equivalents ruled out {rate(*ruled_out(asked, way))}"
        )
    asked = [r for r in rows if "together" in r and not r["same"]]
    for name, way, instead in (("proposed", "together", HEADLINE), ("random", "random set", ANY)):
        one = [r for r in asked if r.get(instead, r[way])["one"]]
        out.append(f"{name}, as the headline has it: one left {rate(len(one), len(asked))}")
    sure = [r for r in rows if "together" in r and r["foretold"][1] <= 0.5]
    one = [r for r in sure if r["together"]["one"]]
    out.append(f"of those foretold to leave half another or less: {rate(len(one), len(sure))}")
    none = sum("together" in r and r["same"] for r in rows)
    out.append(f"{none} more where the plan says that nothing tells them")
    return out


def main(arguments: Sequence[str] | None = None) -> int:
    """Try seeds, and print the totals."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=FIRST, help="the first")
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--singles", action="store_true", help="one response as well")
    options = parser.parse_args(arguments)
    ways = (*SETS, *SINGLES) if options.singles else SETS
    (OUT / "cases").mkdir(parents=True, exist_ok=True)
    rows = []
    for seed in range(options.seed, options.seed + options.count):
        path = OUT / "cases" / f"{seed}.json"
        if not path.is_file():
            save(path, json.dumps(attempt(seed, ways), ensure_ascii=False, indent=1) + "\n")
        rows.append(json.loads(path.read_text(encoding="utf-8")))
    print("\n".join(told([r for r in rows if not r.get("skipped")])))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
