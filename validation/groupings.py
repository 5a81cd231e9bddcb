"""Macro elements that the recordings choose, measured: ``python -m validation.groupings [beam]
[plate] [real]`` prints the tables of problems/physical/source.md and docs/generic-elements.md.

FE2 (8.3) and the plate of Table 8.1 at 0, 1 and 5 % noise, from the files of problems/physical with
`grouping` in their rows; Structure B, whose 140 elements each have a thickness and whose measured
frequencies (Table 9.3) are left out one by one.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cvxupdate.spec import read_text
from cvxupdate.study import run
from cvxupdate.update.result import Grouping, Updated
from validation import generic_real as real
from validation import make_bay as bay
from validation import make_physical as made

KINDS = ("subset", "clusters", "total-variation")
NOISES = (0.0, 0.01, 0.05)
KEPT = 0.02
"""Change of p below which an element counts as sound; the smallest error is 0.074."""


def problem(model: str, data: str, rows: str, noise: float) -> str:
    """An [update] of responses."""
    known = f"noise = {noise / np.sqrt(3):.4g}\n" if noise else ""
    return (
        f'title = "groups"\nsource = "validation/groupings.py"\n\n{model}\n[[recordings]]\n'
        f'kind = "frf"\nfile = "{data}"\nresponse = "displacement"\n\n[update]\nmethod = "rfm"\n'
        f'frequency_points = "all"\n{known}parameters = [\n{rows}]\n{made.BOUNDS}'
    )


def row(of: str, grouping: str | None) -> str:
    """Single parameters, or the groups of them that the recordings choose."""
    more = f', grouping = "{grouping}"' if grouping else ""
    return f'  {{ elements = "all", of = "{of}", each = "element"{more} }},\n'


def fitted(text: str, folder: Path) -> tuple[Updated, float]:
    """The update, and its CPU seconds with the choice of groups."""
    begin = time.process_time()
    updated = run(read_text(text, folder / "problem.toml"))
    return updated, time.process_time() - begin


def changes(updated: Updated, of: str, count: int) -> np.ndarray:
    """p of one property by element; 0 where it is in no group."""
    out = np.zeros(count)
    for q in updated.parameters:
        if q.of == of:
            out[[e - 1 for e in q.elements]] = q.p
    return out


def mixed(found: Grouping, wrong: Sequence[int]) -> int:
    """Groups that join an element in error with one that is not."""
    return sum(bool(set(g) & set(wrong)) and bool(set(g) - set(wrong)) for g in found.elements)


def beam() -> None:
    """FE2 by its second moments, all coordinates and ten."""
    print("| coordinates, lines | grouping | noise | groups | mixed | iterations | worst p |")
    print("|---|---|---|---|---|---|---|")
    reference = bay.build("X1")
    truth = np.array([1 / 1.3 - 1 if e in bay.THICK else 0.0 for e in range(1, 21)])
    model = f'[model]\ninclude = "{made.FOLDER.parent}/bay/fe2.toml"\n'
    for places, lines in ((made.ALL, made.BEAM_LINES), (bay.TEN, made.CLOSE_LINES)):
        H = bay.receptance(reference, lines, places, [made.FORCE])
        for kind in (None, *KINDS):
            for noise in NOISES:
                with tempfile.TemporaryDirectory() as folder:
                    noisy = bay.noisy(H, noise, 1) if noise else H
                    bay.save_frf(Path(folder) / "frf.npz", lines, noisy, places, [made.FORCE])
                    text = problem(model, "frf.npz", row("I", kind), noise)
                    (Path(folder) / "problem.toml").write_text(text, encoding="utf-8")
                    updated, _ = fitted(text, Path(folder))
                some = updated.groupings
                print(
                    f"| {len(places)}, {len(lines)} | {kind or 'none'} | {noise:.0%} | "
                    f"{len(updated.parameters)} | {sum(mixed(g, bay.THICK) for g in some)} | "
                    f"{updated.iterations} {updated.status} | "
                    f"{np.abs(changes(updated, 'I', 20) - truth).max():.2g} |",
                    flush=True,
                )


def seen(updated: Updated) -> dict[str, np.ndarray]:
    """What recordings see of each plate element (8.4) over its true value, less 1."""
    now = {}
    for of, (factor, some) in made.PLATE_ERRORS.items():
        wrong = np.where(np.isin(np.arange(1, 46), list(some)), factor, 1.0)
        now[of] = wrong * (1.0 + changes(updated, of, 45))
    h = now["thickness"]
    return {"E h³": now["E"] * h**3 - 1, "nu": now["nu"] - 1, "rho h": now["rho"] * h - 1}


def located(updated: Updated) -> tuple[int, int, int, int]:
    """Of the elements with one wrong property: in how many that one alone changes, how many there
    are; of those without an error: how many change, how many there are."""
    errors = {
        e: {of for of, (_, some) in made.PLATE_ERRORS.items() if e in some} for e in range(46)
    }
    moved = {of: np.abs(changes(updated, of, 45)) > KEPT for of in made.PLATE_ERRORS}
    said = {e: {of for of in moved if moved[of][e - 1]} for e in range(1, 46)}
    single = [e for e in said if len(errors[e]) == 1]
    sound = [e for e in said if not errors[e]]
    false = sum(bool(said[e]) for e in sound)
    return sum(said[e] == errors[e] for e in single), len(single), false, len(sound)


def plate() -> None:
    """Table 8.1."""
    print(
        "| choice | noise | groups h, E, ρ, ν | mixed | one error, named alone | sound, changed "
        "| iterations | largest error E h³, ν, ρh (r.m.s.) % | time |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    kinds = made.PLATE_ERRORS
    H = made.measured(
        made.built(made.plate_toml({})), made.PLATE_LINES, made.PLATE_POINTS, made.FORCE
    ).real
    rows = {
        "four macro elements": "".join(
            f'  {{ elements = {list(some)}, of = "{of}" }},\n' for of, (_, some) in kinds.items()
        ),
        "all 180": "".join(row(of, None) for of in kinds),
        **{kind: "".join(row(of, kind) for of in kinds) for kind in KINDS},
    }
    first: dict[float, float] = {}
    for name, wanted in rows.items():
        for noise in NOISES:
            with tempfile.TemporaryDirectory() as folder:
                noisy = bay.noisy(H, noise, 1) if noise else H
                path = Path(folder)
                bay.save_frf(
                    path / "frf.npz", made.PLATE_LINES, noisy, made.PLATE_POINTS, [made.FORCE]
                )
                text = problem(made.plate_toml(kinds), "frf.npz", wanted, noise)
                updated, took = fitted(text, path)
                if name == "four macro elements":  # once more: the first loads libraries
                    updated, took = fitted(text, path)
            first.setdefault(noise, took)
            groups = ", ".join(str(sum(q.of == of for q in updated.parameters)) for of in kinds)
            joined = sum(mixed(g, list(kinds[g.of][1])) for g in updated.groupings)
            right, single, false, sound = located(updated)
            errors = ", ".join(
                f"{100 * np.abs(v).max():.2g} ({100 * np.sqrt(np.mean(v**2)):.2g})"
                for v in seen(updated).values()
            )
            print(
                f"| {name} | {noise:.0%} | {groups} | {joined} | {right} of {single} | {false} of "
                f"{sound} | {updated.iterations} {updated.status} | {errors} | "
                f"{took / first[noise]:.1f} × |",
                flush=True,
            )


def plate_b() -> None:
    """Structure B by measured frequencies."""
    print("| choice | parameters | fitted, mean error % | each mode from the others, % |")
    print("|---|---|---|---|")
    for kind in KINDS:

        def text(mode: int | None, kind: str = kind) -> str:
            return real.plate_text("grouped", mode).replace('"clusters"', f'"{kind}"')

        updated, _ = fitted(text(None), real.PLATE)
        fit, missed = real.figures(updated), []
        for mode in range(1, 14):
            one, _ = fitted(text(mode), real.PLATE)
            missed.append(real.percent(real.figures(one), "hold_out", "after"))
        print(
            f"| {kind} | {len(updated.parameters)} | {real.percent(fit, 'fit', 'before'):.2f} → "
            f"{real.percent(fit, 'fit', 'after'):.2f} | {np.mean(missed):.2f} (worst "
            f"{max(missed):.1f}) |",
            flush=True,
        )


if __name__ == "__main__":
    for which in sys.argv[1:] or ["beam", "plate", "real"]:
        {"beam": beam, "plate": plate, "real": plate_b}[which]()
