"""Families of element matrices where a real structure has what its model lacks, beside the effect
that `diagnose` names there: which is better held out? ``python -m validation.generic_real`` prints
the figures of docs/generic-elements.md (CVXUPDATE_DATA is not needed: medians and tables are
published ones).

Structure B (Table 9.3): every mode is left out once and foreseen from the other twelve. Cantilever
with six masses: found on the medians of the odd layouts, foreseen are those of the even ones, and
of the state whose mass nearest to the clamp was taken off.
"""

from __future__ import annotations

import csv
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.report.as_json import run_data
from cvxupdate.spec import read_text
from cvxupdate.spec.write import to_toml
from cvxupdate.study import run

ROOT = Path(__file__).resolve().parents[1] / "problems"
PLATE, BEAM = ROOT / "structure_b", ROOT / "real" / "beam-six-masses-frf"
L1 = 101  # the mass nearest to the clamp
WITHOUT_L1 = (21.85, 139.1, 385.2, 754.3, 1169.0)  # Hz, medians of 70 layouts (source.md)


def plate_text(name: str, left_out: int | None) -> str:
    """A problem of Structure B; ``left_out`` the mode that is held out."""
    with (PLATE / "modes.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    parts = (PLATE / f"{name}.toml").read_text(encoding="utf-8").split("# modes\n")
    assert len(parts) == 3
    tables = []
    for use, some in (
        ("fit", [r for r in rows if int(r["mode"]) != left_out]),
        ("hold-out", [r for r in rows if int(r["mode"]) == left_out]),
    ):
        given = ", ".join(f"{{ frequency = {r['frequency']}, mode = {r['mode']} }}" for r in some)
        if some:
            tables.append(
                f'[[recordings]]\nkind = "modes"\nuse = "{use}"\nname = "{use}"\nrows = [{given}]\n'
            )
    return parts[0] + "\n".join(tables) + parts[2]


def figures(updated: Any) -> Mapping[str, Any]:
    """`fit` of result.json."""
    return dict(run_data(updated)["fit"])


def percent(fit: Mapping[str, Any], use: str, when: str) -> float:
    """Mean error of the frequencies."""
    return float(fit[use]["frequency_error_percent_mean"][when])


def plate(name: str) -> str:
    """One row: fitted on all thirteen, then each foreseen from the others."""
    whole = run(read_text(plate_text(name, None), PLATE / f"{name}.toml"))
    fit = figures(whole)
    missed = []
    for mode in range(1, 14):
        one = run(read_text(plate_text(name, mode), PLATE / f"{name}.toml"))
        missed.append(percent(figures(one), "hold_out", "after"))
    return (
        f"| {name} | {len(whole.parameters)} | {percent(fit, 'fit', 'before'):.2f} → "
        f"{percent(fit, 'fit', 'after'):.2f} | {np.mean(missed):.2f} (worst {max(missed):.1f}) |"
    )


def without_mass(updated: Any) -> Any:
    """Errors of the first five frequencies (%) of an updated beam without the mass L1.

    Raises
    ------
    SystemExit
        Where the update is infeasible.
    """
    if updated.written is None:
        raise SystemExit(f"{updated.problem}: infeasible")
    tables = tomllib.loads(updated.written.text)
    assert any(row["id"] == L1 for block in tables["model"]["elements"] for row in block["rows"])
    for block in tables["model"]["elements"]:
        block["rows"] = [row for row in block["rows"] if row["id"] != L1]
    text = to_toml({"model": tables["model"]})
    model = build_model(read_text(text, BEAM / "x.toml"))
    found = model_modes(model, 8).flexible().frequencies[: len(WITHOUT_L1)]
    return 100.0 * np.abs(found / np.array(WITHOUT_L1) - 1.0)


def beam(name: str) -> str:
    """One row: fitted, the even layouts, and the state without the mass L1."""
    updated = run(BEAM / f"{name}.toml")
    fit, other = figures(updated), without_mass(updated)
    return (
        f"| {name} | {len(updated.parameters)} | {percent(fit, 'fit', 'before'):.2f} → "
        f"{percent(fit, 'fit', 'after'):.2f} | {percent(fit, 'hold_out', 'after'):.2f} | "
        f"{other.mean():.2f} (worst {other.max():.1f}) |"
    )


def main(chosen: tuple[str, ...]) -> None:
    """Print both tables."""
    if not chosen or "plate" in chosen:
        print("| structure B | unknowns | fitted, mean error % | each mode from the others, % |")
        print("|---|---|---|---|")
        for name in ("generic_named", "generic_factors", "generic"):
            print(plate(name), flush=True)
    if not chosen or "beam" in chosen:
        print("| six masses | unknowns | fitted, % | even layouts, % | without L1, % |")
        print("|---|---|---|---|---|")
        for name in (
            "problem_root_springs",
            "problem_exact",
            "problem_root_factors",
            "problem_root_family",
            "problem_root_family_mass",
        ):
            print(beam(name), flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]))
