"""One frame diagnosed twice: with its mesh of beams, and with exact members between the nodes that
are measured, held or where members meet. ``python -m validation.exact_cases [SEED …]`` prints the
table of docs/exact-elements.md: the bay of chapter 3 with a lump (measured by exact members, 1 %
noise), and portals of ``make calibrate`` by their seeds (measured by the laboratory, which shares
no code with the package).
"""

from __future__ import annotations

import sys
import tempfile
import time
import tomllib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.fe.build import build_model
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.spec import read_text
from cvxupdate.spec.write import tables_of, to_toml
from cvxupdate.study import open_problem
from validation.generate import make

BAY = Path(__file__).resolve().parents[1] / "problems" / "bay"
SEEDS = (14, 43, 55, 80)
LUMP, AT = 0.08, 15  # kg, about 3 % of the bay; node
SENSORS, DRIVE = (1, 5, 9, 12, 15, 17), 1
LINES, NOISE, ETA = np.linspace(20.0, 300.0, 281), 0.01, 0.01
Z = 3  # the number of a translation along z in recordings
BEAMS = ("beam2d", "beam3d")


def with_exact(tables: Mapping[str, Any], kept: set[int]) -> dict[str, Any]:
    """[model] with one exact member for every straight run of beams of one group between nodes that
    are ``kept``, held, or where anything else is."""
    model = dict(tables)
    places = {n["id"]: np.array([n.get(k, 0.0) for k in "xyz"]) for n in model["nodes"]}
    kept = kept | {n for s in model.get("supports", ()) for n in s["nodes"]}
    meeting: dict[int, list[tuple[Any, int]]] = defaultdict(list)
    for block in model["elements"]:
        for row in block["rows"]:
            if block["type"] not in BEAMS:
                kept |= set(row["nodes"])
                continue
            a, b = row["nodes"]
            same = {k: v for k, v in row.items() if k not in ("id", "nodes")}
            meeting[a].append((same, b))
            meeting[b].append((same, a))
    for n, ends in meeting.items():
        straight = len(ends) == 2 and ends[0][0] == ends[1][0]
        if straight:
            u, v = (places[e] - places[n] for _, e in ends)
            straight = np.linalg.norm(np.cross(u, v)) < 1e-6 * np.linalg.norm(u) * np.linalg.norm(v)
        if not straight:
            kept.add(n)
    blocks = []
    for block in model["elements"]:
        if block["type"] not in BEAMS:
            blocks.append(block)
            continue
        rows, seen, number = [], set(), 0
        for a in sorted(kept & set(meeting)):
            for same, b in meeting[a]:
                last, at = a, b
                while at not in kept:
                    last, at = at, next(e for _, e in meeting[at] if e != last)
                if (at, last) in seen:
                    continue
                seen.add((a, b))
                number += 1
                rows.append({"id": number, "nodes": [a, at], **same})
        other = {k: v for k, v in block.items() if k not in ("rows", "mass", "type")}
        blocks.append({**other, "type": "exact_beam", "rows": rows})
    model["elements"] = blocks
    model["nodes"] = [n for n in model["nodes"] if n["id"] in kept]
    return model


def said(name: str, kind: str, size: int, found: Diagnosis, took: float) -> str:
    """A row of the table."""
    what = "; ".join(
        f"{f.title}: "
        + ", ".join(f"{k} {v:.4g}" for k, v in f.parameters.items())
        + f" ({f.confidence:.2f})"
        for f in found.findings
    )
    mesh = [line for line in found.evidence if "mesh" in line.lower() or "exact member" in line]
    fit = found.fit
    return (
        f"| {name} | {kind} | {size} | {what or found.verdict} | {fit['fit']['before']:.3g} → "
        f"{fit['fit']['after']:.3g} | {took:.0f} | {' '.join(mesh)[:160] or 'none'} |"
    )


def both(name: str, path: Path, folder: Path) -> None:
    """Diagnose a problem file as it is and with exact members."""
    spec, _, recordings = open_problem(path)
    measured = {
        c.node
        for r in recordings
        for c in (*getattr(r, "responses", ()), *getattr(r, "references", ()))
    }
    tables = tables_of(spec)
    tables["model"] = with_exact(tables["model"], measured)
    other = folder / "exact.toml"
    other.write_text(to_toml(tables), encoding="utf-8")
    for kind, file in (("exact", other), ("mesh", path)):
        spec, model, recordings = open_problem(file)
        begin = time.process_time()
        found = diagnose_problem(spec, model, recordings)
        print(said(name, kind, model.size, found, time.process_time() - begin), flush=True)


def bay(folder: Path) -> Path:
    """The bay with a lump, measured by exact members."""
    tables = tomllib.loads((BAY / "frame.toml").read_text(encoding="utf-8"))["model"]
    beams = tomllib.loads((BAY / "x1.toml").read_text(encoding="utf-8"))["model"]
    model = {**tables, **{k: v for k, v in beams.items() if k != "include"}}
    model["damping"] = {"kind": "structural", "eta": ETA}
    for block in model["elements"]:  # one strip, whose numbers scatter together
        block["group"] = "strip"
    drawn: dict[str, Any] = {"title": "bay", "source": "exact members", "model": model}
    real = with_exact(model, {*SENSORS, DRIVE, AT})
    lump = {"type": "mass", "rows": [{"id": 900, "nodes": [AT], "m": LUMP}]}
    real["elements"] = [*real["elements"], lump]
    exact = build_model(read_text(to_toml({"model": real}), folder / "real.toml"))
    rng = np.random.default_rng(8)
    drawn["recordings"] = []
    for use, drive in (("fit", DRIVE), ("hold-out", SENSORS[3])):
        at = np.array([exact.place[f"n{n}.z"] for n in SENSORS])
        H = frequency_responses(exact, LINES, at, np.array([exact.place[f"n{drive}.z"]]))
        size = NOISE * np.sqrt(np.mean(np.abs(H) ** 2, axis=0) / 2.0)
        H = H + size * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
        np.savez(
            folder / f"{use}.npz",
            frequency=LINES,
            H=H,
            response_node=np.array(SENSORS),
            response_dof=np.full(len(SENSORS), Z),
            reference_node=np.array([drive]),
            reference_dof=np.array([Z]),
            variance=np.broadcast_to(2.0 * size**2, H.shape),
        )
        row = {"kind": "frf", "use": use, "name": use, "file": f"{use}.npz"}
        drawn["recordings"].append({**row, "response": "displacement"})
    path = folder / "problem.toml"
    path.write_text(to_toml(drawn), encoding="utf-8")
    return path


def main(seeds: Sequence[int]) -> None:
    """Print the table."""
    print("| frame | elements | DOFs | finding | error before → after | CPU s | mesh |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        if not seeds or 0 in seeds:
            both("bay", bay(Path(folder)), Path(folder))
        for seed in [s for s in seeds or SEEDS if s]:
            place = Path(folder) / f"g{seed}"
            make(seed, place)
            both(f"portal {seed}", place / "problem.toml", place)


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]])
