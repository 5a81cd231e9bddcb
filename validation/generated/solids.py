"""Plates as solid bodies, computed by CalculiX (``ccx``; Dhondt, The Finite Element Method for
Three-Dimensional Thermomechanical Applications, 2004): twenty-node bricks with reduced integration,
one through the thickness, each element of the analyst's mesh in several. SI units."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from validation.generated.laboratory import Complex, Design, Effect, Element, Real

PARTS = 4  # of an edge of an element
MODES = 80
# corners of a brick, then the middles of its edges, in halves of its size (CalculiX 2.20, C3D20R)
BRICK = (
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1),
)  # fmt: skip


@dataclass(frozen=True)
class SolidModal:
    """The body in its lowest modes: ``omega`` (m,) rad/s, ``shapes`` (nodes of the drawing, m)
    along z, normalised in mass, ``zeta`` (m,)."""

    number: Mapping[int, int]
    omega: Real
    shapes: Real
    zeta: Real

    def rows(self, places: Sequence[tuple[int, str]]) -> list[int]:
        """Rows of (node, "z")."""
        return [self.number[n] for n, _ in places]

    def damped(self) -> tuple[Real, Real]:
        """Natural frequencies (Hz) and damping ratios."""
        return self.omega / (2.0 * np.pi), self.zeta

    def accelerance(self, s: Complex, sensors: Sequence[int], drives: Sequence[int]) -> Complex:
        """(m/s²)/N at points ``s``, (points, sensors, drives)."""
        poles = s[:, None] ** 2 + 2.0 * self.zeta * self.omega * s[:, None] + self.omega**2
        read, force = self.shapes[list(sensors)], self.shapes[list(drives)]
        return np.asarray(
            s[:, None, None] ** 2 * np.einsum("im,jm,pm->pij", read, force, 1.0 / poles)
        )


@dataclass
class _Deck:
    """An input deck under construction; nodes by their place in halves of bricks and z."""

    xs: Real
    ys: Real
    nodes: dict[tuple[int, int, float], int] = field(default_factory=dict)
    further: int = 0
    lines: list[str] = field(default_factory=list)
    bricks: int = 0

    def node(self, i: int, j: int, z: float) -> int:
        """Number of a node, made when first asked for."""
        key = (i, j, round(z, 9))
        return self.nodes.setdefault(key, len(self.nodes) + 1)

    def brick(self, i: int, j: int, low: float, high: float) -> str:
        """One more, at halves (i, j) of the mesh."""
        self.bricks += 1
        n = [self.node(i + u, j + v, low + (high - low) * w / 2.0) for u, v, w in BRICK]
        first, rest = n[:10], n[10:]
        return f"{self.bricks},{','.join(map(str, first))},\n{','.join(map(str, rest))}"

    def coordinates(self) -> list[str]:
        """The nodes' lines."""
        return [
            f"{k},{self.xs[i]:.12g},{self.ys[j]:.12g},{z:.12g}"
            for (i, j, z), k in self.nodes.items()
        ]


def solid_modes(
    design: Design,
    scatter: Mapping[int, tuple[float, float]],
    effects: Sequence[Effect],
    zeta: Real,
    folder: Path,
) -> SolidModal:
    """The modes of a plate with what is concealed in it; ``folder`` for the deck and its answer."""
    text, at = _written(design, scatter, effects)
    (folder / "body.inp").write_text("\n".join(text) + "\n", encoding="ascii")
    subprocess.run(["ccx", "-i", "body"], cwd=folder, check=True, capture_output=True, timeout=600)
    f, shapes = _read(folder / "body.dat", at)
    ratios = np.resize(zeta, len(f)).astype(float)
    for e in effects:
        if e["physics"] == "mass_proportional_damping":
            ratios = ratios + e["alpha"] / (4.0 * np.pi * f)
    return SolidModal({n: k for k, n in enumerate(at)}, 2.0 * np.pi * f, shapes, ratios)


def _levels(
    design: Design, effects: Sequence[Effect]
) -> tuple[list[tuple[float, float]], set[int]]:
    """Layers through the thickness, the middle one last, and the elements that have the outer
    ones."""
    (h,) = design.section
    change = next((e for e in effects if e["physics"] == "thickness_change"), None)
    if change is None:
        return [(-h / 2.0, h / 2.0)], set()
    thin, thick = sorted((h, h * change["factor"]))
    patch = set(change["elements"])
    everywhere = {e.id for e in design.elements}
    outer = patch if change["factor"] > 1.0 else everywhere - patch
    layers = [(-thick / 2.0, -thin / 2.0), (thin / 2.0, thick / 2.0), (-thin / 2.0, thin / 2.0)]
    return layers, outer


def _written(
    design: Design, scatter: Mapping[int, tuple[float, float]], effects: Sequence[Effect]
) -> tuple[list[str], dict[int, int]]:
    xs = sorted({x[0] for x in design.nodes.values()})
    ys = sorted({x[1] for x in design.nodes.values()})
    deck = _Deck(_halves(xs), _halves(ys))
    layers, outer = _levels(design, effects)
    blocks: list[str] = []
    for e in design.elements:
        blocks += _element(deck, design, e, scatter[e.id], effects, layers, outer)
    place = {
        n: (2 * PARTS * int(np.argmin(np.abs(np.subtract(xs, x[0])))),
            2 * PARTS * int(np.argmin(np.abs(np.subtract(ys, x[1])))))
        for n, x in design.nodes.items()
    }  # fmt: skip
    at = {n: deck.node(i, j, 0.0) for n, (i, j) in place.items()}
    held = sorted({place[n][0] for n, d in design.held if d == "z"})
    fixed = [k for (i, _, _), k in deck.nodes.items() if held and i == held[0]]
    bounds = [f"{k},1,3" for k in fixed]
    if not fixed:  # in its plane it must stand still
        corners = [at[n] for n in (min(at), max(at))]
        bounds = [f"{corners[0]},1,2", f"{corners[1]},2,2"]
    local, further = _local(deck, effects, at)
    nodes = [*deck.coordinates(), *further]
    sense = [f"{k}," for k in at.values()]
    text = ["*NODE,NSET=ALL", *nodes, *blocks, *local, "*BOUNDARY", *bounds]
    text += ["*NSET,NSET=SENSE", *sense, "*STEP", "*FREQUENCY", str(MODES)]
    text += ["*NODE PRINT,NSET=SENSE", "U", "*END STEP"]
    return text, at


def _halves(lines: Sequence[float]) -> Real:
    """The nodes' places along an edge: every element in `PARTS` bricks of two halves."""
    count = 2 * PARTS * (len(lines) - 1) + 1
    return np.interp(np.arange(count) / (2.0 * PARTS), np.arange(len(lines)), lines)


def _element(
    deck: _Deck,
    design: Design,
    e: Element,
    factors: tuple[float, float],
    effects: Sequence[Effect],
    layers: Sequence[tuple[float, float]],
    outer: set[int],
) -> list[str]:
    E, rho = design.E * factors[0], design.rho * factors[1]
    for x in effects:
        if e.id in x.get("elements", ()):
            E *= x["factor"] if x["physics"] == "stiffness_change" else 1.0
            rho *= x["factor"] if x["physics"] == "mass_change" else 1.0
    left, near = (min(design.nodes[n][k] for n in e.nodes) for k in (0, 1))
    i, j = int(np.argmin(np.abs(deck.xs - left))), int(np.argmin(np.abs(deck.ys - near)))
    bricks = [
        deck.brick(i + 2 * p, j + 2 * q, low, high)
        for low, high in (layers if e.id in outer else layers[-1:])
        for q in range(PARTS)
        for p in range(PARTS)
    ]
    out = [f"*ELEMENT,TYPE=C3D20R,ELSET=E{e.id}", *bricks]
    out += [f"*MATERIAL,NAME=M{e.id}", "*ELASTIC", f"{E:.10g},{design.nu}"]
    return [*out, "*DENSITY", f"{rho:.10g}", f"*SOLID SECTION,ELSET=E{e.id},MATERIAL=M{e.id}"]


def _local(
    deck: _Deck, effects: Sequence[Effect], at: Mapping[int, int]
) -> tuple[list[str], list[str]]:
    """Lumps, springs and hidden masses; the lines of the nodes that these bring."""
    out: list[str] = []
    further: list[str] = []
    number = deck.bricks
    for x in effects:
        if x["physics"] not in ("added_mass", "grounding_spring", "attached_resonator"):
            continue
        number += 1
        node, name = at[x["node"]], f"X{number}"
        if x["physics"] == "added_mass":
            out += [f"*ELEMENT,TYPE=MASS,ELSET={name}", f"{number},{node}"]
            out += [f"*MASS,ELSET={name}", f"{x['m']:.9e}"]
        elif x["physics"] == "grounding_spring":
            out += [f"*ELEMENT,TYPE=SPRING1,ELSET={name}", f"{number},{node}"]
            out += [f"*SPRING,ELSET={name}", "3", f"{x['k']:.9e}"]
        else:
            own = len(deck.nodes) + len(further) + 1
            further.append(f"{own},0.,0.,1.")
            out += [f"*ELEMENT,TYPE=SPRING2,ELSET={name}", f"{number},{node},{own}"]
            out += [f"*SPRING,ELSET={name}", "3,3", f"{x['k']:.9e}"]
            out += [f"*ELEMENT,TYPE=MASS,ELSET=M{name}", f"{number + 1},{own}"]
            out += [f"*MASS,ELSET=M{name}", f"{x['m']:.10g}", "*BOUNDARY", f"{own},1,2"]
            number += 1
    return out, further


def _read(path: Path, at: Mapping[int, int]) -> tuple[Real, Real]:
    """(frequencies Hz, shapes (nodes, modes) along z) of an answer."""
    row = {k: r for r, k in enumerate(at.values())}
    text = path.read_text(encoding="ascii").splitlines()
    f: list[float] = []
    blocks: list[Real] = []
    table = 0  # of the file: eigenvalues first
    for line in text:
        words = line.split()
        if "E I G E N V A L U E" in line:
            table = 1
        elif "P A R T I C I P A T I O N" in line:
            table = 0
        elif line.strip().startswith("displacements"):
            blocks.append(np.zeros(len(row)))
            table = 2
        elif table == 1 and len(words) == 5 and words[0].isdigit():
            f.append(float(words[3]))
        elif table == 2 and len(words) == 4 and words[0].isdigit():
            blocks[-1][row[int(words[0])]] = float(words[3])
    return np.array(f), np.array(blocks).T
