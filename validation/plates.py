"""Plates as an analyst draws them, four to seven elements a side, whose truth CalculiX computes as
a solid body (``ccx``, Debian's calculix-ccx): problem folders like those of
``validation.generate``, diagnosed and judged like those of ``make calibrate``.

``python -m validation.plates SEED … [--diagnose] [--out DIR] [--limit S]``. Two seeds of ten have
nothing concealed. Seeds below 1000 are for development. With ``--diagnose`` each folder gets a
``judged.json``; ``--limit`` counts seconds of the processor.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from validation.calibrate import TooLong, alarmed, diagnose, failed, judged, save
from validation.generated.cases import Case, instruments
from validation.generated.drawings import Generator, between, design_of, figures, frequencies
from validation.generated.effects import MAKERS, Finding, Scene
from validation.generated.files import model_text, recordings_text, truth_text
from validation.generated.laboratory import Design, Element, Modal
from validation.generated.solids import solid_modes

CONCEALED = (
    "",
    "added_mass",
    "thickness_change",
    "grounding_spring",
    "attached_resonator",
    "stiffness_change",
    "",
    "mass_change",
    "added_mass",
    "thickness_change",
)  # by the last digit of the seed; "": nothing


def draw(seed: int) -> Case:
    """The case of a seed: a plate clamped at one edge or on cords, steel or aluminium."""
    rng = np.random.default_rng([20261123, seed])
    word = CONCEALED[seed % len(CONCEALED)]
    design = _coarse(rng, design_of(rng, "plate", word))
    f = frequencies(design)
    count = int(rng.integers(5, 8))
    top = float(f[count - 1] + rng.uniform(0.3, 0.7) * (f[count] - f[count - 1]))
    sensors, drives = instruments(rng, design)
    scene = Scene(design, f, top, "frf", sensors)
    findings: tuple[Finding, ...] = (MAKERS[word](rng, scene, word),) if word else ()
    k, m = (
        1.0 + float(np.clip(s * rng.standard_normal(), -2.5 * s, 2.5 * s)) for s in (8e-3, 4e-3)
    )
    scatter = {
        e.id: (k * (1.0 + 6e-4 * rng.standard_normal()), m * (1.0 + 6e-4 * rng.standard_normal()))
        for e in design.elements
    }
    common = np.clip(0.25 * rng.standard_normal(), -0.5, 0.5)
    zeta = design.eta / 2.0 * np.exp(common + np.clip(0.22 * rng.standard_normal(200), -0.5, 0.5))
    noise = between(rng, 0.003, 0.01)
    return Case(
        seed, design, scatter, zeta, findings, "frf", float(f[0]), top, sensors, drives, noise
    )


def _coarse(rng: Generator, design: Design) -> Design:
    """The same plate on a mesh of four to seven by three to five."""
    nx, ny = int(rng.integers(4, 8)), int(rng.integers(3, 6))
    a, b = (max(x[k] for x in design.nodes.values()) for k in (0, 1))
    nodes = {
        1 + i + j * (nx + 1): (figures(a * i / nx, 6), figures(b * j / ny, 6), 0.0)
        for j in range(ny + 1)
        for i in range(nx + 1)
    }
    corners = [1 + i + j * (nx + 1) for j in range(ny) for i in range(nx)]
    elements = tuple(
        Element(k + 1, "plate", (c, c + 1, c + nx + 2, c + nx + 1), "plate")
        for k, c in enumerate(corners)
    )
    held = tuple(
        (n, d) for n, x in nodes.items() if design.held and x[0] == 0.0 for d in design.dofs
    )
    return replace(design, nodes=nodes, elements=elements, held=held)


def make(seed: int, folder: Path) -> Case:
    """Draw a case, compute and write it."""
    case = draw(seed)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        body = solid_modes(case.design, case.scatter, case.effects, case.zeta, Path(name))
    m = cast(Modal, body)  # which has all that frequency responses ask of one
    rng = np.random.default_rng([20261124, seed])
    out = [f'title = "Plate {seed}"', 'source = "CalculiX, C3D20R"', "", *model_text(case.design)]
    out += recordings_text(rng, m, case, folder)
    (folder / "problem.toml").write_text("\n".join(out) + "\n", encoding="utf-8")
    truth = truth_text(case, m)
    (folder / "truth.toml").write_text("\n".join(truth) + "\n", encoding="utf-8")
    return case


def tried(folder: Path, limit: float) -> dict[str, Any]:
    """A folder diagnosed and judged."""
    begin = time.process_time()
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    try:
        with alarmed(limit, processor=True):
            row = judged(diagnose(folder / "problem.toml"), truth)
    except TooLong:
        row = failed(f"longer than {limit:.0f} s of the processor")
    row = {"seconds": round(time.process_time() - begin, 1), **row}
    save(folder / "judged.json", json.dumps(row, ensure_ascii=False, indent=1) + "\n")
    return row


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the folders of seeds; diagnose them on request."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("seeds", type=int, nargs="+", help="one folder each")
    parser.add_argument("--diagnose", action="store_true", help="and judge what is said")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for a diagnosis")
    parser.add_argument("--out", type=Path, default=Path("out/plates"), help="folder")
    options = parser.parse_args(arguments)
    for seed in options.seeds:
        folder = options.out / f"p{seed}"
        if not (folder / "truth.toml").exists():
            make(seed, folder)
        line = str(folder)
        if options.diagnose:
            row = tried(folder, options.limit)
            line += f"  {row['outcome']}  {row['seconds']} s  {row['verdict']}  [{row['truth']}]"
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
