"""Plates as solid bodies: decks for CalculiX of twenty-node bricks with reduced integration, one
through the thickness, each element of the analyst's mesh in several. SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from validation.generated.cases import Case
from validation.generated.laboratory import Design, Effect, Element, Real
from validation.plates.bodies import Body, matrices, points_of, reduced

LOCAL = ("added_mass", "grounding_spring", "attached_resonator")
FIRMER = 0.5  # the material whose stiffness tells what a part of the body does
# along a side of a plate, about: thin bricks converge with the square of their length (28 are 0.1 %
# of a frequency stiffer than 36), so frequencies are taken to the limit of two meshes
BRICKS = (16, 22)
# corners of a brick, then the middles of its edges, in halves of its size (CalculiX 2.20, C3D20R)
BRICK = (
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1),
)  # fmt: skip


@dataclass
class _Deck:
    """An input deck under construction; nodes by their place in halves of bricks and z."""

    xs: Real
    ys: Real
    parts: tuple[int, int]  # of an element along x and y
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


def body_of(case: Case, folder: Path) -> Body:
    """The modes of a plate with what is concealed in it, of the finer of two meshes with
    frequencies extrapolated (Richardson 1911); ``folder`` for the decks and their matrices."""
    coarse, fine = (_meshed(case, folder, n) for n in BRICKS)
    few = min(len(coarse.omega), len(fine.omega))
    a, b = (float(n) ** 2 for n in BRICKS)
    omega = fine.omega.copy()
    omega[:few] = (b * fine.omega[:few] - a * coarse.omega[:few]) / (b - a)
    return replace(fine, omega=omega)


def _meshed(case: Case, folder: Path, bricks: int) -> Body:
    """Of one mesh. The stiffness of elements that lose energy is the difference that a stiffer
    material makes, for stiffness is linear in it."""
    text, at = written(case.design, case.scatter, case.effects, bricks)
    K, M, dofs = matrices(text, folder)
    place = {dof: k for k, dof in enumerate(dofs)}
    points = [p for p in dict.fromkeys(points_of(case)) if f"{at[p[0]]}.3" in place]
    rows = [place[f"{at[n]}.3"] for n, _ in points]
    lossy = None
    zone = {n for x in case.effects if x["physics"] == "structural_damping" for n in x["elements"]}
    if zone and bricks == BRICKS[-1]:
        firm = {
            n: (k * (1.0 + FIRMER if n in zone else 1.0), m) for n, (k, m) in case.scatter.items()
        }
        stiffer = matrices(written(case.design, firm, case.effects, bricks)[0], folder)[0]
        lossy = sp.csc_array((stiffer - K) / FIRMER)
    return reduced(K, M, rows, points, case.top, lossy)


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


def written(
    design: Design,
    scatter: Mapping[int, tuple[float, float]],
    effects: Sequence[Effect],
    bricks: int = BRICKS[-1],
) -> tuple[list[str], dict[int, int]]:
    """(the deck without its step, the body's node of each of the drawing's)."""
    xs = sorted({x[0] for x in design.nodes.values()})
    ys = sorted({x[1] for x in design.nodes.values()})
    parts = tuple(max(2, round(bricks / (len(lines) - 1))) for lines in (xs, ys))
    px, py = parts
    deck = _Deck(_halves(xs, px), _halves(ys, py), (px, py))
    layers, outer = _levels(design, effects)
    blocks: list[str] = []
    for e in design.elements:
        blocks += _element(deck, design, e, scatter[e.id], effects, layers, outer)
    place = {
        n: (2 * px * int(np.argmin(np.abs(np.subtract(xs, x[0])))),
            2 * py * int(np.argmin(np.abs(np.subtract(ys, x[1])))))
        for n, x in design.nodes.items()
    }  # fmt: skip
    at = {n: deck.node(i, j, 0.0) for n, (i, j) in place.items()}
    held = sorted({place[n][0] for n, d in design.held if d == "z"})
    bounds, springs = _edge(deck, design, effects, held[0]) if held else ([], [])
    if not held:  # in its plane it must stand still
        corners = [at[n] for n in (min(at), max(at))]
        bounds = [f"{corners[0]},1,2", f"{corners[1]},2,2"]
    local, further = _local(deck, effects, at)
    nodes = [*deck.coordinates(), *further]
    return ["*NODE,NSET=ALL", *nodes, *blocks, *local, *springs, "*BOUNDARY", *bounds], at


def _halves(lines: Sequence[float], parts: int) -> Real:
    """The nodes' places along an edge: every element in so many bricks of two halves."""
    count = 2 * parts * (len(lines) - 1) + 1
    return np.interp(np.arange(count) / (2.0 * parts), np.arange(len(lines)), lines)


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
        for q in range(deck.parts[1])
        for p in range(deck.parts[0])
    ]
    out = [f"*ELEMENT,TYPE=C3D20R,ELSET=E{e.id}", *bricks]
    rigidities = next((x for x in effects if x["physics"] == "orthotropy"), None)
    out += [f"*MATERIAL,NAME=M{e.id}", *_elastic(E, design.nu, rigidities)]
    return [*out, "*DENSITY", f"{rho:.10g}", f"*SOLID SECTION,ELSET=E{e.id},MATERIAL=M{e.id}"]


def _elastic(E: float, nu: float, rigidities: Effect | None) -> list[str]:
    """The material: isotropic, or with four rigidities of a plate as factors on those."""
    if rigidities is None:
        return ["*ELASTIC", f"{E:.10g},{nu}"]
    D = E / (1.0 - nu**2)  # plane stress: D_x etc. times 12 / h³
    Dx, Dy, D1, Dxy = (
        rigidities[k] * D * g
        for k, g in zip(("Dx", "Dy", "D1", "Dxy"), (1.0, 1.0, nu, (1.0 - nu) / 2.0), strict=True)
    )
    rest = 1.0 - D1**2 / (Dx * Dy)
    G = E / (2.0 * (1.0 + nu))
    numbers = [Dx * rest, Dy * rest, E, D1 / Dy, nu, nu, Dxy, G, G]
    text = [f"{v:.10g}" for v in numbers]
    return ["*ELASTIC,TYPE=ENGINEERING CONSTANTS", ",".join(text[:8]) + ",", text[8]]


def _edge(
    deck: _Deck, design: Design, effects: Sequence[Effect], column: int
) -> tuple[list[str], list[str]]:
    """(boundary lines, further lines) of an edge that is held: rigidly, or free to turn on springs
    spread over it, which work on its upper and lower faces (a quadratic line's lumps: a sixth and
    four of its length)."""
    there = {k: (j, z) for (i, j, z), k in deck.nodes.items() if i == column}
    soft = next((x for x in effects if "kappa" in x), None)
    if soft is None:
        return [f"{k},1,3" for k in there], []
    half = max(z for _, z in there.values())
    bounds = [f"{k},2,3" for k in there] + [f"{k},1,1" for k, (_, z) in there.items() if z == 0.0]
    lump = np.zeros(len(deck.ys))
    for j in range(0, len(deck.ys) - 2, 2):
        lump[j : j + 3] += (deck.ys[j + 2] - deck.ys[j]) * np.array([1.0, 4.0, 1.0]) / 6.0
    lines: list[str] = []
    faces = [(k, j) for k, (j, z) in there.items() if abs(abs(z) - half) < 1e-9]
    for n, (k, j) in enumerate(faces):
        number, each = 10_000_000 + n, soft["kappa"] * lump[j] / (2.0 * half**2)
        lines += [f"*ELEMENT,TYPE=SPRING1,ELSET=Y{n}", f"{number},{k}"]
        lines += [f"*SPRING,ELSET=Y{n}", "1", f"{each:.9e}"]
    return bounds, lines


def _local(
    deck: _Deck, effects: Sequence[Effect], at: Mapping[int, int]
) -> tuple[list[str], list[str]]:
    """Lumps, springs and hidden masses; the lines of the nodes that these bring."""
    out: list[str] = []
    further: list[str] = []
    number = deck.bricks
    for x in effects:
        if x["physics"] not in LOCAL or "kappa" in x:
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
