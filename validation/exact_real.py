"""Two real structures by exact members and by meshes, with few numbers and with one for each
element: ``python -m validation.exact_real [six] [roller]`` prints the tables of
docs/exact-elements.md (medians and frequencies are in the problem files; CVXUPDATE_DATA is not
needed).

Cantilever with six masses: found on the odd layouts, foreseen are the even ones and the state whose
mass nearest to the clamp was taken off. Cantilever on a roller: found at three rests, foreseen are
three others.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cvxupdate.spec import read_text
from cvxupdate.study import run
from validation.generic_real import BEAM, figures, percent, without_mass

ROLLER = BEAM.parent / "dropbear-moving-support" / "problem_exact_rests.toml"
E = '{ group = "beam", of = "E", lower = -0.5, upper = 0.5 }'
EACH = E.replace('"E"', '"E", each = "element"')
KZ = '{ group = "clamp z", of = "k", lower = -0.95, upper = 20.0 }'
KR = KZ.replace("clamp z", "clamp ry")
M = '{ group = "clamp mass", of = "m", lower = -0.95, upper = 5.0 }'
MOVED = '{ group = "bar", of = "E" }'
HELD = '{ group = "roller", of = "k", lower = -0.95, upper = 20.0 }'
CLAMPS: tuple[tuple[str, tuple[str, ...], bool], ...] = (
    ("rotation", (KR,), True),
    ("E, rotation", (E, KR), True),
    ("spring, rotation", (KZ, KR), False),
    ("E, spring, rotation", (E, KZ, KR), False),
    ("spring, rotation, mass", (KZ, KR, M), False),
    ("E of each element, rotation", (EACH, KR), True),
)
"""What is free of the clamp and the beam; whether the clamp is held along z."""


@dataclass(frozen=True)
class Row:
    """One update: its name, its text and the file that it stands beside."""

    name: str
    text: str
    path: Path


def clamped(text: str, rows: Sequence[str], held: bool) -> str:
    """A problem of the six masses with the parameters ``rows``; without the mass of the clamp where
    it is not one of them, without its spring along z where the clamp is ``held``."""
    text = re.sub(r"parameters = \[\n.*?\n\]\n", _parameters(rows), text, flags=re.S)
    if M not in rows:
        lump = r'\[\[model\.elements\]\]\ntype = "mass"\nrows = \[\n  \{ id = 303.*?\]\n'
        text = re.sub(lump, "", text, flags=re.S)
    if held:
        text = re.sub(r"  \{ id = 301.*\n", "", text)
        support = '[[model.supports]]\nnodes = [1]\ndofs = ["z"]\n\n[[recordings]]'
        text = text.replace("[[recordings]]", support, 1)
    return text


def _parameters(rows: Sequence[str]) -> str:
    return "parameters = [\n" + "".join(f"  {row},\n" for row in rows) + "]\n"


def meshed(text: str, parts: int) -> str:
    """The bar at each rest as ``parts`` beams up to the roller and twice as many beyond."""
    places = {
        int(i): (float(x), y)
        for i, x, y in re.findall(r"\{ id = (\d+), x = ([\d.]+), y = ([\d.]+) \}", text)
    }
    nodes = [f"  {{ id = {i}, x = {x}, y = {y} }},\n" for i, (x, y) in places.items()]
    rows, number = list[str](), 1000
    for first in sorted(i for i in places if i % 10 == 0):
        for a, n in ((first, parts), (first + 1, 2 * parts)):
            (x, y), (end, _), last = places[a], places[a + 1], a
            for k in range(1, n + 1):
                number += 1
                at = a + 1 if k == n else number
                if k < n:
                    nodes.append(f"  {{ id = {at}, x = {x + (end - x) * k / n:.7f}, y = {y} }},\n")
                rows.append(f"  {{ id = {number}, nodes = [{last}, {at}] }},\n")
                last = at
    text = re.sub(r"nodes = \[\n(  \{ id.*\n)+\]", f"nodes = [\n{''.join(nodes)}]", text, count=1)
    beams = f'type = "beam2d"\\1rows = [\n{"".join(rows)}]'
    return re.sub(r'type = "exact_beam"(.*?)rows = \[\n.*?\n\]', beams, text, count=1, flags=re.S)


def of_six() -> list[Row]:
    """Exact members and the mesh, with each set of numbers."""
    out = []
    for kind, name in (("exact", "problem_exact"), ("mesh", "problem_root_springs")):
        path = BEAM / f"{name}.toml"
        text = path.read_text(encoding="utf-8")
        for free, rows, held in CLAMPS:
            out.append(Row(f"{kind}: {free}", clamped(text, rows, held), path))
    return out


def of_roller() -> list[Row]:
    """Exact members, meshes, and a modulus for each beam."""
    text = ROLLER.read_text(encoding="utf-8")
    both = [Row("exact: E, roller", text, ROLLER)]
    both += [Row(f"{3 * n} beams: E, roller", meshed(text, n), ROLLER) for n in (1, 2, 4)]
    own = MOVED.replace('"E"', '"E", each = "element"')
    return [
        *both,
        Row("6 beams: E of each, roller", meshed(text, 2).replace(MOVED, own), ROLLER),
        Row("exact: E of each, roller", text.replace(MOVED, own), ROLLER),
        Row("exact: E", text.replace(f"  {HELD},\n", ""), ROLLER),
        Row("exact: roller", text.replace(f"  {MOVED},\n", ""), ROLLER),
    ]


def line(row: Row, other: bool) -> str:
    """A row of the table; ``other``: with the state without a mass."""
    updated: Any = run(read_text(row.text, row.path))
    fit = figures(updated)
    cells = [row.name, str(updated.model["dofs"]), str(len(updated.parameters))]
    for use in ("fit", "hold_out"):
        before, after = (percent(fit, use, when) for when in ("before", "after"))
        cells.append(f"{before:.2f} → {after:.3f}")
    if other:
        missed = without_mass(updated)
        cells.append(f"{missed.mean():.2f} (worst {missed.max():.2f})")
    return f"| {' | '.join(cells)} |"


def main(chosen: tuple[str, ...]) -> None:
    """Print both tables, or the one that is named."""
    if not chosen or "six" in chosen:
        print("| six masses | DOFs | parameters | fitted, % | even layouts, % | other state, % |")
        print("|---|---|---|---|---|---|")
        for row in of_six():
            print(line(row, True), flush=True)
    if not chosen or "roller" in chosen:
        print("| roller | DOFs | parameters | fitted, % | other rests, % |")
        print("|---|---|---|---|---|")
        for row in of_roller():
            print(line(row, False), flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]))
