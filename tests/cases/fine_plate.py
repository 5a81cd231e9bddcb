"""Plates as an analyst draws them, four to eight elements a side, and a laboratory on a mesh many
times as fine and of another aspect: FRFs or tables of modes of one with a lump, a thicker patch, an
edge that gives way, or nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import load_problem

ZETA = 0.006
TEXT = """title = "Plate"
[model]
dofs = ["z", "rx", "ry"]
nodes = [{nodes}]
[model.materials.steel]
E = {E}
nu = 0.3
rho = 7850.0
[model.sections.skin]
shape = "plate"
thickness = {h}
[model.sections.patch]
shape = "plate"
thickness = {patch}
[[model.elements]]
type = "plate"
material = "steel"
rows = [{elements}]
{extra}
[model.damping]
kind = "modal"
zeta = {zeta}
{recordings}
"""


@dataclass(frozen=True)
class Plate:
    """``a`` × ``b`` m, ``h`` thick, ``nx`` × ``ny`` elements, clamped at x = 0 where ``held``."""

    a: float = 0.48
    b: float = 0.33
    h: float = 0.003
    nx: int = 5
    ny: int = 4
    held: bool = True

    def node(self, i: int, j: int, nx: int = 0) -> int:
        """Number of node (i, j) of the mesh."""
        return 1 + i + ((nx or self.nx) + 1) * j

    def text(
        self,
        times: tuple[int, int] = (1, 1),
        E: float = 207e9,
        lump: tuple[int, int, float] | None = None,
        patch: tuple[frozenset[tuple[int, int]], float] = (frozenset(), 1.0),
        edge: float | None = None,
        recordings: str = "",
    ) -> str:
        """The problem, each element in ``times`` parts. ``lump`` (i, j, kg) at a node, ``patch``
        (elements (i, j), factor on thickness), ``edge`` N·m/rad a metre with which the clamp turns,
        all of the analyst's mesh."""
        px, py = times
        nx, ny = self.nx * px, self.ny * py
        nodes = ", ".join(
            f"{{ id = {self.node(i, j, nx)}, x = {self.a * i / nx:.9g}, "
            f"y = {self.b * j / ny:.9g} }}"
            for j in range(ny + 1)
            for i in range(nx + 1)
        )
        rows = []
        for j in range(ny):
            for i in range(nx):
                n = [self.node(i + u, j + v, nx) for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
                section = "patch" if (i // px, j // py) in patch[0] else "skin"
                rows.append(
                    f'{{ id = {len(rows) + 1}, nodes = {n}, section = "{section}", '
                    'group = "plate" }'
                )
        side = [self.node(0, j, nx) for j in range(ny + 1)]
        extra = ""
        if self.held:
            dofs = '["z", "rx"]' if edge else '["z", "rx", "ry"]'
            extra += f"[[model.supports]]\nnodes = {side}\ndofs = {dofs}\n"
        top = len(rows)
        if edge:
            k = [edge * self.b / ny * (0.5 if j in (0, ny) else 1.0) for j in range(ny + 1)]
            springs = ", ".join(
                f"{{ id = {top + 1 + j}, nodes = [{n}], k = {k[j]:.9g} }}"
                for j, n in enumerate(side)
            )
            extra += f'[[model.elements]]\ntype = "spring"\ndof = "ry"\nrows = [{springs}]\n'
            top += len(side)
        if lump:
            at = self.node(lump[0] * px, lump[1] * py, nx)
            row = f"{{ id = {top + 1}, nodes = [{at}], m = {lump[2]} }}"
            extra += f'[[model.elements]]\ntype = "mass"\nrows = [{row}]\n'
        return TEXT.format(
            nodes=nodes,
            elements=", ".join(rows),
            E=E,
            h=self.h,
            patch=self.h * patch[1],
            extra=extra,
            zeta=ZETA,
            recordings=recordings,
        )


def real(folder: Path, plate: Plate, times: tuple[int, int] = (5, 7), **concealed: object) -> Model:
    """The laboratory's model; the stiffness of its steel is 1 % off."""
    path = folder / "real.toml"
    path.write_text(plate.text(times, 209e9, **concealed), encoding="utf-8")  # type: ignore[arg-type]
    return build_model(load_problem(path))


def drawn(folder: Path, plate: Plate, recordings: str) -> Path:
    """The analyst's problem file."""
    path = folder / "problem.toml"
    path.write_text(plate.text(recordings=recordings), encoding="utf-8")
    return path


def frf(
    folder: Path, plate: Plate, model: Model, times: tuple[int, int], modes: int = 7, seed: int = 0
) -> str:
    """Accelerances of a grid of sensors to one force (to fit) and to another (held out), with half
    a per cent of noise; the [[recordings]] of the files that it writes."""
    px, py = times
    nx = plate.nx * px
    places = [(i, j) for j in range(0, plate.ny + 1, 2) for i in range(1, plate.nx + 1)]
    sensors = [plate.node(*p) for p in places]
    rows = [model.place[f"n{plate.node(i * px, j * py, nx)}.z"] for i, j in places]
    found = model_modes(model, 4 * modes)
    f = found.frequencies[found.rigid :]
    top = 0.5 * (f[modes - 1] + f[modes])
    lines = np.linspace(0.5 * f[0], top, 400)
    s = 2j * np.pi * lines
    omega = 2.0 * np.pi * found.frequencies
    poles = s[:, None] ** 2 + 2.0 * ZETA * omega * s[:, None] + omega**2
    rng = np.random.default_rng(seed)
    out = ""
    for k, (drive, use) in enumerate(((len(rows) - 1, "fit"), (plate.nx // 2, "hold-out"))):
        phi = found.shapes[rows]
        H = s[:, None] ** 2 * np.einsum("im,m,lm->li", phi, phi[drive], 1.0 / poles)
        size = 0.005 * np.sqrt(np.mean(np.abs(H) ** 2, axis=0))
        H = H + size * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2.0)
        name = f"frf{k}.npz"
        np.savez(
            folder / name,
            frequency=lines,
            H=H[:, :, None],
            coherence=np.full((*H.shape, 1), 0.99999),
            response_node=np.array(sensors),
            response_dof=np.full(len(sensors), 3),
            reference_node=np.array([sensors[drive]]),
            reference_dof=np.array([3]),
        )
        out += (
            f'[[recordings]]\nkind = "frf"\nuse = "{use}"\nfile = "{name}"\n'
            'response = "acceleration"\n'
        )
    return out


def table(model: Model, modes: int = 8) -> str:
    """Frequencies with a deviation of 0.05 %; every fourth is held out."""
    f = model_modes(model, modes + 2).flexible().frequencies[:modes]
    rng = np.random.default_rng(3)
    f = f * (1.0 + 5e-4 * rng.normal(size=modes))
    parts: dict[str, list[str]] = {"fit": [], "hold-out": []}
    for k, v in enumerate(f):
        use = "hold-out" if k % 4 == 3 else "fit"
        parts[use].append(f"{{ frequency = {v:.8g}, frequency_std = {5e-4 * v:.4g} }}")
    return "".join(
        f'[[recordings]]\nkind = "modes"\nuse = "{use}"\nrows = [{", ".join(rows)}]\n'
        for use, rows in parts.items()
    )
