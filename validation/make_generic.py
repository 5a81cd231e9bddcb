# ruff: noqa: E501 - the notes are prose for source.md
"""Writes the case studies of chapter 7: problems/generic.
``python -m validation.make_generic`` again gives the same files (seeds are fixed)."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PROBLEMS = Path(__file__).resolve().parents[1] / "problems" / "generic"
E, NU, ETA = 207e9, 0.3, 0.01
ROD = {"L": 1.0, "d": 0.02, "rho": 7850.0, "elements": 10}
BEAM = {"L": 1.0, "width": 0.03, "height": 0.02, "rho": 7850.0, "elements": 10}
PLATE = {"side": 0.15, "thickness": 0.001, "rho": 7800.0}
BEAM_A = (500, 690, 900, 1000, 1145, 1600, 1700, 1883, 2200, 2750)
BEAM_B = (*BEAM_A, 3290, 3710, 3900, 4000, 4100, 4200, 4600)
PLATE_LINES = (50, 110, 170, 230, 300, 350, 450, 500, 600, 700)
LIGHT, STIFF = (1, 3, 5, 7, 9), (2, 4, 6, 8)


@dataclass(frozen=True)
class Line:
    """A uniform rod or beam in closed form: exact dynamic stiffness between ``n`` + 1 equidistant
    points, so its receptances at them are Bishop and Johnson's."""

    L: float
    n: int
    EA: float
    rhoA: float
    EI: float = 0.0

    def receptances(self, frequency, force: int, held: bool):
        """Of the displacement at every point (lines, points) under a unit force at ``force``."""
        k = 2 if self.EI else 1
        out = np.zeros((len(frequency), self.n + 1), dtype=complex)
        free = np.arange(k if held else 0, k * (self.n + 1))
        load = np.zeros(k * (self.n + 1))
        load[k * force] = 1.0
        for row, f in zip(out, frequency, strict=True):
            Z = np.zeros((len(load), len(load)), dtype=complex)
            D = self._bending(f) if self.EI else self._axial(f)
            for e in range(self.n):
                Z[k * e : k * e + 2 * k, k * e : k * e + 2 * k] += D
            u = np.zeros(len(load), dtype=complex)
            u[free] = np.linalg.solve(Z[np.ix_(free, free)], load[free])
            row[:] = u[::k]
        return out

    def _axial(self, f: float):
        EA = self.EA * (1 + 1j * ETA)
        b, h = 2 * np.pi * f * np.sqrt(self.rhoA / EA), self.L / self.n
        return EA * b / np.sin(b * h) * np.array([[np.cos(b * h), -1.0], [-1.0, np.cos(b * h)]])

    def _bending(self, f: float):
        EI = self.EI * (1 + 1j * ETA)
        b, h = (self.rhoA * (2 * np.pi * f) ** 2 / EI) ** 0.25, self.L / self.n
        x = np.array([0.0, h])

        def rows(d: int):
            signs = [1, 1, -1, -1]
            t = [np.cos(b * x), np.sin(b * x), np.cosh(b * x), np.sinh(b * x)]
            derived = [
                t,
                [-t[1], t[0], t[3], t[2]],
                [-t[0], -t[1], t[2], t[3]],
                [t[1], -t[0], t[3], t[2]],
            ]
            assert len(signs) == 4
            return b**d * np.array(derived[d]).T

        w, s, m, q = (rows(d) for d in range(4))
        moved = np.array([w[0], s[0], w[1], s[1]])
        forces = EI * np.array([q[0], -m[0], -q[1], m[1]])
        return forces @ np.linalg.inv(moved)


def model_text(dofs: str, nodes, materials: dict, section: str, blocks: str, held: str = "") -> str:
    """A [model]."""
    rows = ",\n".join(
        f"  {{ id = {i}, x = {x:.10g}, y = {y:.10g} }}" for i, (x, y) in nodes.items()
    )
    steel = "".join(
        f"[model.materials.{name}]\nE = {e:.10g}\nnu = {NU}\nrho = {rho:.10g}\neta = {eta:.10g}\n\n"
        for name, (e, rho, eta) in materials.items()
    )
    return f"[model]\ndofs = [{dofs}]\nnodes = [\n{rows},\n]\n\n{steel}{section}\n{blocks}{held}"


def line_text(kind: str, rho: float, height: float) -> str:
    """The rod or the beam of ten elements, masses lumped."""
    g = ROD if kind == "rod" else BEAM
    n = g["elements"]
    # The rod's node 1 is at 0.1 m, its held end node 0; the beam's nodes are 1 to 11.
    first = 0 if kind == "rod" else 1
    nodes = {first + i: (g["L"] * i / n, 0.0) for i in range(n + 1)}
    rows = ",\n".join(
        f"  {{ id = {i + 1}, nodes = [{first + i}, {first + i + 1}] }}" for i in range(n)
    )
    section = (
        f'[model.sections.bar]\nshape = "circle"\ndiameter = {ROD["d"]}\n'
        if kind == "rod"
        else f'[model.sections.bar]\nshape = "rectangle"\nwidth = {height:.10g}\nheight = {BEAM["width"]}\n'
    )
    name = "rod" if kind == "rod" else "beam2d"
    blocks = (
        f'[[model.elements]]\ntype = "{name}"\nmass = "lumped"\nmaterial = "steel"\nsection = "bar"\n'
        f"rows = [\n{rows},\n]\n"
    )
    dofs = '"x"' if kind == "rod" else '"y", "rz"'
    held = '\n[[model.supports]]\nnodes = [0]\ndofs = ["x"]\n' if kind == "rod" else ""
    return model_text(dofs, nodes, {"steel": (E, rho, ETA)}, section, blocks, held)


def plate_text(n: int, errors: bool = False) -> str:
    """The free plate of n × n elements; ``errors``: those of case A."""
    a, rho = PLATE["side"], PLATE["rho"]
    nodes = {
        1 + i + (n + 1) * j: (a * i / n, a * j / n) for j in range(n + 1) for i in range(n + 1)
    }
    rows = []
    for j in range(n):
        for i in range(n):
            e, c = 1 + i + n * j, 1 + i + (n + 1) * j
            name = "light" if e in LIGHT else "stiff"
            rows.append(
                f"  {{ id = {e}, nodes = [{c}, {c + 1}, {c + n + 2}, {c + n + 1}]"
                + (f', material = "{name}"' if errors else "")
                + " }"
            )
    # D = ηK stays that of the target where K is 10 % high: K and D are matrices of their own (3.22).
    materials = {"steel": (E, rho, ETA)}
    if errors:
        materials |= {"light": (E, 0.9 * rho, ETA), "stiff": (1.1 * E, rho, ETA)}
    return model_text(
        '"z", "rx", "ry"',
        nodes,
        materials,
        f'[model.sections.sheet]\nshape = "plate"\nthickness = {PLATE["thickness"]}\n',
        '[[model.elements]]\ntype = "plate"\nmaterial = "steel"\nsection = "sheet"\nrows = [\n'
        + ",\n".join(rows)
        + ",\n]\n",
    )


def build(text: str):
    """The package's model of a [model] table."""
    from cvxupdate.study import open_problem

    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return open_problem(path)[1]


def plate_receptances(n: int, frequency, force: tuple[int, int], step: int):
    """z at every ``step``-th node each way under a force at node (i, j) of those, of a plate of
    n × n: (lines, nodes)."""
    from cvxupdate.fe.responses import matrices_with_damping
    from cvxupdate.fe.synthesis import DirectLines

    model = build(plate_text(n))
    at = [1 + i + (n + 1) * j for j in range(0, n + 1, step) for i in range(0, n + 1, step)]
    places = np.array([model.place[f"n{k}.z"] for k in at])
    i, j = force
    source = model.place[f"n{1 + step * i + (n + 1) * step * j}.z"]
    X = DirectLines(matrices_with_damping(model), np.array([source])).at(
        2j * np.pi * np.asarray(frequency, dtype=float)
    )
    return X[places][:, :, 0].T
