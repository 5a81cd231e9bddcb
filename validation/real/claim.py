"""A claim of `cvxupdate diagnose` on real recordings beside what is known, and what the command
says of a problem file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cvxupdate.report.diagnosis import diagnosis_files
from cvxupdate.spec import load_problem
from cvxupdate.spec.write import tables_of, to_toml
from cvxupdate.study import diagnose
from validation.real.table import PROBLEMS

OUT = PROBLEMS.parents[1] / "out" / "proof" / "real"


@dataclass(frozen=True)
class Claim:
    """A row: what was asked, what the tool said, what is true, whether that is right (None: nobody
    knows), error on what was not fitted, seconds."""

    data: str
    case: str
    claimed: str
    truth: str
    right: bool | None
    before: float | None
    after: float | None
    time: float | None
    note: str = ""


def whole(problem: Path) -> str:
    """A problem file without `include`, so that text may be added and the file lie elsewhere."""
    return to_toml(tables_of(load_problem(problem)))


def said_of(problem: Path) -> dict[str, Any]:
    """What the command writes for a problem file; its page goes to out/proof/real/."""
    files, payload = diagnosis_files(diagnose(problem), load_problem(problem))
    folder = folder_of(problem)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return dict(json.loads(payload))


def folder_of(problem: Path) -> Path:
    """Where `said_of` writes."""
    return OUT / f"{problem.parent.name}-{problem.stem.removeprefix('problem_')}"


def held_out(said: dict[str, Any]) -> tuple[float | None, float | None]:
    """(before, after) on what was not fitted; on the fitted recordings where nothing was held
    out."""
    fit = said["fit"]
    key = "hold_out" if fit["hold_out"].get("before") is not None else "fit"
    return fit[key].get("before"), fit[key].get("after")


def found_text(said: dict[str, Any]) -> str:
    """Verdict and findings, briefly."""
    parts = []
    for f in said["findings"]:
        where = ", ".join(
            f"{k} {' '.join(map(str, v[:4]))}{' …' if len(v) > 4 else ''}"
            for k, v in f["location"].items()
            if isinstance(v, list) and v
        )
        size = ", ".join(
            f"{k} = {v:.3g} ± {f['standard_deviation'].get(k) or float('nan'):.2g}"
            for k, v in f["parameters"].items()
        )
        rivals = f"; {len(f['equivalent'])} equivalent" if f["equivalent"] else ""
        parts.append(
            f"{f['physics']} at {where or 'the whole structure'}: {size} (confidence "
            f"{100 * f['confidence']:.0f} %{rivals})"
        )
    return f"{said['verdict']}" + (": " + "; ".join(parts) if parts else "")
