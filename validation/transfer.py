"""Does the family of element matrices that 7.7.3B finds on one plate hold on others of the same
mesh density? ``python -m validation.transfer`` prints the table of docs/generic-elements.md (two
minutes)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.fe.synthesis import DirectLines
from cvxupdate.spec import read_text
from cvxupdate.spec.write import to_toml
from cvxupdate.study import run

PLATE_B = Path(__file__).resolve().parents[1] / "problems" / "generic" / "plate_b"
LEARNT = ("problem", "beside", "two_drives")
E, NU, RHO, ETA = 207e9, 0.3, 7800.0, 0.01
FINER = 2  # the target's mesh: that of the plate on which the family was found
EDGES = ("left", "right", "bottom", "top")
CORNER = ("left", "bottom")


@dataclass(frozen=True)
class Plate:
    """``nx`` × ``ny`` elements of ``dx`` × ``dy`` m, ``thickness`` m, lines up to ``top`` Hz;
    ``held`` edge → DOFs."""

    name: str
    nx: int = 3
    ny: int = 3
    dx: float = 0.05
    dy: float = 0.05
    thickness: float = 0.001
    top: float = 800.0
    held: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def node(self, i: int, j: int, finer: int) -> int:
        """The number of node (i, j) of this mesh in one ``finer``."""
        return 1 + finer * i + (finer * self.nx + 1) * finer * j

    def tables(self, finer: int) -> dict[str, Any]:
        """[model], each element in ``finer`` × ``finer``."""
        nx, ny, dx, dy = (finer * self.nx, finer * self.ny, self.dx / finer, self.dy / finer)
        corner = [(1 + i + (nx + 1) * j) for j in range(ny) for i in range(nx)]
        edges = {
            "left": [1 + (nx + 1) * j for j in range(ny + 1)],
            "right": [1 + nx + (nx + 1) * j for j in range(ny + 1)],
            "bottom": list(range(1, nx + 2)),
            "top": [1 + i + (nx + 1) * ny for i in range(nx + 1)],
        }
        rows = [
            {"id": e + 1, "nodes": [c, c + 1, c + nx + 2, c + nx + 1]} for e, c in enumerate(corner)
        ]
        return {
            "dofs": ["z", "rx", "ry"],
            "nodes": [
                {"id": 1 + i + (nx + 1) * j, "x": dx * i, "y": dy * j}
                for j in range(ny + 1)
                for i in range(nx + 1)
            ],
            "materials": {"steel": {"E": E, "nu": NU, "rho": RHO, "eta": ETA}},
            "sections": {"sheet": {"shape": "plate", "thickness": self.thickness}},
            "elements": [{"type": "plate", "material": "steel", "section": "sheet", "rows": rows}],
            "supports": [{"nodes": edges[e], "dofs": list(dofs)} for e, dofs in self.held],
        }

    def model(self, finer: int = 1, families: Sequence[dict[str, Any]] = ()) -> Model:
        """With every element another member of the ``families`` (rows of [[model.families]])."""
        rows = [{**row, "elements": "all"} for row in families]
        text = to_toml({"model": {**self.tables(finer), "families": rows}})
        return build_model(read_text(text, Path("transfer.toml")))

    def free_nodes(self) -> list[tuple[int, int]]:
        """Nodes of the coarse mesh whose z is free."""
        gone = {e for e, dofs in self.held if "z" in dofs}
        ends = {
            "left": (0, None),
            "right": (self.nx, None),
            "bottom": (None, 0),
            "top": (None, self.ny),
        }
        return [
            (i, j)
            for j in range(self.ny + 1)
            for i in range(self.nx + 1)
            if not any(i == ends[e][0] or j == ends[e][1] for e in gone)
        ]

    def responses(self, model: Model, finer: int) -> np.ndarray:
        """z at every free node of the coarse mesh under a force at one of them, (lines, nodes)."""
        nodes = self.free_nodes()
        places = np.array([model.place[f"n{self.node(i, j, finer)}.z"] for i, j in nodes])
        # Above the rigid-body motion, which every element has right; driven beside the diagonals,
        # on which the plate was driven when the family was found.
        lines = np.arange(self.top / 16.0, self.top, self.top / 160.0)
        source = places[1]
        X = DirectLines(matrices_with_damping(model), np.array([source])).at(2j * np.pi * lines)
        return X[places][:, :, 0].T


CLAMPED = ("z", "rx", "ry")
PLATES = (
    Plate("the plate it was found on, another drive"),
    Plate("0.30 × 0.15 m, 6 × 3", nx=6),
    Plate("0.25 × 0.20 m, 5 × 4", nx=5, ny=4),
    Plate("twice as large and thick (similar)", dx=0.1, dy=0.1, thickness=0.002, top=400.0),
    Plate("one edge clamped", held=(("left", CLAMPED),)),
    Plate("0.30 × 0.15 m, a short edge clamped", nx=6, held=(("left", CLAMPED),)),
    Plate("all edges simply supported", held=tuple((e, ("z",)) for e in EDGES)),
    Plate("0.25 × 0.20 m, two edges clamped", nx=5, ny=4, held=tuple((e, CLAMPED) for e in CORNER)),
    Plate("0.25 × 0.20 m, all edges clamped", nx=5, ny=4, held=tuple((e, CLAMPED) for e in EDGES)),
    Plate("elements of 0.067 × 0.05 m", dx=0.2 / 3, top=700.0),
    Plate("a mesh twice as fine, 6 × 6", nx=6, ny=6, dx=0.025, dy=0.025),
    Plate("twice the band", top=1600.0),
)  # fmt: skip


@dataclass(frozen=True)
class Score:
    """Relative error of the responses, and mean error of the flexible frequencies in the band [%];
    ``modes`` how many of them."""

    responses: float
    frequencies: float
    modes: int


def learnt(problem: Path | str) -> list[dict[str, Any]]:
    """The rows of [[model.families]] that `run` writes."""
    written = run(problem).written
    if written is None:
        raise ValueError("the updated model was not written")
    return list(written.tables["model"]["families"])


def errors(plate: Plate, families: Sequence[dict[str, Any]], target: Model) -> Score:
    """The coarse mesh with ``families`` (none: as it is) against the ``target``, twice as fine."""
    true = plate.responses(target, FINER)
    modes = min(24, target.size - 4)
    f = model_modes(target, modes).flexible().frequencies
    f = f[f < plate.top]
    model = plate.model(1, families)
    off = float(np.linalg.norm(plate.responses(model, 1) - true) / np.linalg.norm(true))
    g = model_modes(model, min(modes, model.size)).flexible().frequencies[: len(f)]
    return Score(off, 100.0 * float(np.mean(np.abs(g / f - 1.0))), len(f))


def main() -> None:
    """The table: nominal element, then the families of `LEARNT`."""
    found = [learnt(PLATE_B / f"{name}.toml") for name in LEARNT]
    print("| plate | modes | " + " | ".join(("nominal", *LEARNT)) + " |")
    print("|---" * (len(found) + 3) + "|")
    for plate in PLATES:
        target = plate.model(FINER)
        scores = [errors(plate, rows, target) for rows in ([], *found)]
        cells = [f"{s.responses:.2g}, {s.frequencies:.2g} %" for s in scores]
        print(f"| {plate.name} | {scores[0].modes} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
