"""Problems of our own making: from a seed a folder with ``problem.toml``, recordings and ``truth.toml``, in the form of ``problems/concealed``.

``python problems/generate.py SEED [--out DIR]``. The same seed gives the same folder, byte for byte. A seed divisible by three has nothing concealed in it.
Seeds below 1000 are for development; 1000 to 1199 are the evaluation, of which only totals are looked at (docs/calibration.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from laboratory import Design, Effect, Element, Modal, build, modal, natural

Generator = np.random.Generator

WORDS: dict[str, tuple[str, ...]] = {  # which families of structure can show a word
    "stiffness_change": ("chain", "bar", "rod", "frame", "plate"),
    "mass_change": ("bar", "rod", "frame", "plate"),
    "thickness_change": ("bar", "frame", "plate"),
    "orthotropy": ("plate",),
    "added_mass": ("chain", "bar", "rod", "frame", "plate"),
    "grounding_spring": ("chain", "bar", "rod", "frame", "plate"),
    "soft_support": ("bar", "frame"),  # a grounding_spring where the model is rigid
    "joint_flexibility": ("bar", "frame"),
    "shear_deformation": ("bar",),
    "axial_preload": ("bar",),
    "attached_resonator": ("chain", "bar", "rod", "frame", "plate"),
    "viscous_damper": ("chain", "bar", "frame"),
    "structural_damping": ("chain", "bar", "frame"),
    "mass_proportional_damping": ("chain", "bar", "rod", "frame", "plate"),
    "sensor_fault": ("chain", "bar", "rod", "frame", "plate"),
}
FAMILIES = ("chain", "bar", "rod", "frame", "plate")
SHARES = {"chain": 0.28, "bar": 0.32, "rod": 0.08, "frame": 0.2, "plate": 0.12}
LOSSES = ("viscous_damper", "structural_damping", "mass_proportional_damping")
NOT_IN_TABLES = ("attached_resonator", "viscous_damper", "structural_damping", "sensor_fault")  # a table of modes does not tell
SECOND = ("added_mass", "stiffness_change", "grounding_spring", "attached_resonator", "mass_proportional_damping", "sensor_fault")
MESH = 0.005  # an analyst's mesh has its frequencies within this of the converged ones
RATIO = 4000.0  # of the band's top to the first frequency, per loss factor: what 16384 samples or 6000 lines resolve
CODES = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}
STEEL, ALUMINIUM = (207e9, 0.3, 7850.0), (70e9, 0.33, 2700.0)


@dataclass(frozen=True)
class Finding:
    """A concealed effect: what the laboratory does, and what ``truth.toml`` says of it."""

    effect: Effect
    location: dict[str, Any]
    parameters: tuple[tuple[str, float, float], ...]  # name, value, relative tolerance
    accept: dict[str, Any]
    equivalent: tuple[dict[str, Any], ...] = ()
    verdicts: tuple[str, ...] = ("missing_physics",)


@dataclass(frozen=True)
class Case:
    """All of a generated problem that its files are written from."""

    seed: int
    design: Design
    scatter: dict[int, tuple[float, float]]
    zeta: np.ndarray
    findings: tuple[Finding, ...]
    kind: str
    first: float
    top: float
    sensors: tuple[tuple[int, str], ...]
    drives: tuple[tuple[int, str], ...]
    noise: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What the laboratory does besides the drawing; soft cords included."""
        return (*cords(self.design), *(f.effect for f in self.findings))


def between(rng: Generator, low: float, high: float) -> float:
    """Even on a logarithmic scale."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def figures(x: float, digits: int = 4) -> float:
    """Rounded to so many digits, as a drawing gives it."""
    return float(f"{x:.{digits}g}")


# ------------------------------------------------------------------------------------------------------------------------------------------ structures


def design_of(rng: Generator, family: str, word: str) -> Design:
    """A drawing of the given family on which ``word`` can stand."""
    return {"chain": _chain, "bar": _bar, "rod": _rod, "frame": _frame, "plate": _plate}[family](rng, word)


def _chain(rng: Generator, word: str) -> Design:
    n = int(rng.integers(3, 9))
    k, m = between(rng, 2e4, 2e6), between(rng, 0.5, 10.0)
    elements, number = [], 101
    both = rng.random() < 0.4
    for i in range(n + 1):
        if i == n and not both:
            break
        nodes = (1,) if i == 0 else (n,) if i == n else (i, i + 1)
        elements.append(Element(number, "spring", nodes, f"spring {i + 1}", figures(k * rng.uniform(0.7, 1.4), 3)))
        number += 1
    if n > 3 and rng.random() < 0.3:  # a spring past a neighbour
        i = int(rng.integers(1, n - 1))
        elements.append(Element(number, "spring", (i, i + 2), f"spring {number - 100}", figures(k * rng.uniform(0.3, 0.8), 3)))
    elements += [Element(201 + i, "mass", (i + 1,), f"mass {i + 1}", figures(m * rng.uniform(0.7, 1.4), 3)) for i in range(n)]
    nodes_at = {i + 1: (float(i + 1), 0.0, 0.0) for i in range(n)}
    return Design("chain", ("x",), nodes_at, tuple(elements), (), 1.0, 0.3, 1.0, (), figures(between(rng, 6e-3, 4e-2), 2))


def _sections(rng: Generator, n: int, most: int, name: str = "bar") -> list[str]:
    """Group names of n elements in a row: one group, or sections of unequal length."""
    parts = int(rng.integers(1, most + 1))
    if parts == 1:
        return [name] * n
    cuts = np.sort(rng.choice(np.arange(2, n - 1), parts - 1, replace=False))
    return [f"section {'ABCD'[int(np.searchsorted(cuts, i, side='right'))]}" for i in range(n)]


def _line(rng: Generator, length: float, n: int) -> dict[int, tuple[float, float, float]]:
    return {i + 1: (figures(length * i / n, 5), 0.0, 0.0) for i in range(n + 1)}


def _bar(rng: Generator, word: str) -> Design:
    E, nu, rho = STEEL if rng.random() < 0.6 else ALUMINIUM
    n = int(rng.integers(10, 21))
    length = figures(rng.uniform(0.5, 2.0), 3)
    slender = rng.uniform(6.0, 12.0) if word == "shear_deformation" else between(rng, 60.0, 200.0)
    height = figures(length / slender, 3)
    groups = _sections(rng, n, 3)
    if word == "structural_damping" and len(set(groups)) == 1:
        groups = ["section A" if i < n // 2 + 1 else "section B" for i in range(n)]
    kinds = {"axial_preload": ("pinned", "clamped both"), "soft_support": ("cantilever", "pinned", "clamped both"),
             "shear_deformation": ("free", "pinned", "cantilever")}
    ends = str(rng.choice(kinds.get(word, ("cantilever", "free", "pinned", "clamped both"))))
    last = n + 1
    held = {"free": [], "cantilever": [(1, "z"), (1, "ry")], "pinned": [(1, "z"), (last, "z")],
            "clamped both": [(1, "z"), (1, "ry"), (last, "z"), (last, "ry")]}[ends]
    return Design("bar", ("z", "ry"), _line(rng, length, n), tuple(Element(i + 1, "bar", (i + 1, i + 2), groups[i]) for i in range(n)), tuple(held),
                  E, nu, rho, (figures(height * rng.uniform(1.0, 4.0), 3), height), figures(between(rng, 5e-3, 2.5e-2), 2))


def _rod(rng: Generator, word: str) -> Design:
    E, nu, rho = STEEL if rng.random() < 0.6 else ALUMINIUM
    n = int(rng.integers(24, 41))
    length = figures(rng.uniform(0.8, 3.0), 3)
    groups = _sections(rng, n, 3)
    held = ((1, "x"),) if rng.random() < 0.7 else ()
    return Design("rod", ("x",), _line(rng, length, n), tuple(Element(i + 1, "rod", (i + 1, i + 2), groups[i]) for i in range(n)), held,
                  E, nu, rho, (0.03, 0.02), figures(between(rng, 5e-3, 2e-2), 2))


def _frame(rng: Generator, word: str) -> Design:
    """A portal, a portal with a second storey, or an angle: members of four to six elements, each a group."""
    E, nu, rho = STEEL if rng.random() < 0.6 else ALUMINIUM
    w, h = figures(rng.uniform(0.4, 1.2), 3), figures(rng.uniform(0.3, 0.9), 3)
    shape = str(rng.choice(("portal", "two storeys", "angle")))
    corners: list[tuple[float, float]]
    if shape == "angle":
        corners, members, feet = [(0.0, 0.0), (0.0, h), (w, h)], [("leg", 0, 1), ("arm", 1, 2)], [0]
    else:
        corners = [(0.0, 0.0), (0.0, h), (w, figures(h * rng.uniform(0.9, 1.1), 3)), (w, 0.0)]
        members, feet = [("left leg", 0, 1), ("beam", 1, 2), ("right leg", 3, 2)], [0, 3]
        if shape == "two storeys":
            corners += [(0.0, 2.0 * h), (w, figures(1.9 * h, 3))]
            members += [("upper left leg", 1, 4), ("upper beam", 4, 5), ("upper right leg", 2, 5)]
    nodes = {i + 1: (x, 0.0, z) for i, (x, z) in enumerate(corners)}
    elements: list[Element] = []
    for group, a, b in members:
        parts = int(rng.integers(4, 7))
        p, q = np.array(corners[a]), np.array(corners[b])
        chain = [a + 1]
        for k in range(1, parts):
            number = len(nodes) + 1
            x, z = p + (q - p) * k / parts
            nodes[number] = (figures(float(x), 6), 0.0, figures(float(z), 6))
            chain.append(number)
        chain.append(b + 1)
        elements += [Element(len(elements) + 1 + k, "bar", (chain[k], chain[k + 1]), group) for k in range(parts)]
    height = figures(min(w, h) / rng.uniform(30.0, 60.0), 3)
    held = tuple((f + 1, d) for f in feet for d in ("x", "z", "ry"))
    return Design("frame", ("x", "z", "ry"), nodes, tuple(elements), held, E, nu, rho, (figures(height * rng.uniform(1.0, 3.0), 3), height),
                  figures(between(rng, 6e-3, 2.5e-2), 2))


def _plate(rng: Generator, word: str) -> Design:
    E, nu, rho = STEEL if rng.random() < 0.4 else ALUMINIUM
    nx, ny = int(rng.integers(6, 9)), int(rng.integers(5, 7))
    a, b = figures(rng.uniform(0.4, 0.9), 3), figures(rng.uniform(0.3, 0.6), 3)
    nodes = {1 + i + j * (nx + 1): (figures(a * i / nx, 6), figures(b * j / ny, 6), 0.0) for j in range(ny + 1) for i in range(nx + 1)}
    elements = []
    for j in range(ny):
        for i in range(nx):
            corner = 1 + i + j * (nx + 1)
            elements.append(Element(1 + i + j * nx, "plate", (corner, corner + 1, corner + nx + 2, corner + nx + 1), "plate"))
    clamped = rng.random() < 0.5
    held = tuple((n, d) for n, x in nodes.items() if clamped and x[0] == 0.0 for d in ("z", "rx", "ry"))
    return Design("plate", ("z", "rx", "ry"), nodes, tuple(elements), held, E, nu, rho, (figures(min(a, b) / rng.uniform(60.0, 150.0), 2),),
                  figures(between(rng, 6e-3, 3e-2), 2))


def mass_of(design: Design) -> float:
    """Total mass of the drawing, kg."""
    total = 0.0
    for e in design.elements:
        if e.kind == "mass":
            total += e.value
        elif e.kind == "plate":
            x = np.array([design.nodes[n] for n in e.nodes])
            total += float(np.ptp(x[:, 0]) * np.ptp(x[:, 1])) * design.section[0] * design.rho
        elif e.kind in ("bar", "rod"):
            total += float(np.linalg.norm(np.subtract(*(design.nodes[n] for n in e.nodes)))) * design.section[0] * design.section[1] * design.rho
    return total


def cords(design: Design) -> tuple[Effect, ...]:
    """Soft cords of a free structure: rigid modes near a sixtieth of the first flexible frequency."""
    if design.held or design.family == "chain":
        return ()
    dof = design.dofs[0]
    flexible = _first(design)
    ends = list(design.nodes)
    at = [ends[0], ends[-1]] if design.family != "plate" else [n for n in ends if all(design.nodes[n][k] in _rim(design, k) for k in (0, 1))]
    k = mass_of(design) / len(at) * (2.0 * np.pi * flexible / 60.0) ** 2
    return tuple({"physics": "grounding_spring", "node": n, "dof": dof, "k": k} for n in at)


def _rim(design: Design, k: int) -> tuple[float, float]:
    values = [x[k] for x in design.nodes.values()]
    return min(values), max(values)


def _first(design: Design) -> float:
    """First flexible natural frequency of the drawing, Hz."""
    s = build(design, {}, [] if design.held or design.family == "chain" else _ballast(design))
    f = natural(s, 0.0, 6)[0] / (2.0 * np.pi)
    rigid = 0 if design.held or design.family == "chain" else {"bar": 2, "rod": 1, "plate": 3}[design.family]
    return float(f[rigid])


def _ballast(design: Design) -> list[Effect]:
    """A support of almost nothing, so that the matrices are definite."""
    nodes = list(design.nodes)
    k = 1e-9 * design.E * design.section[-1] ** 3
    return [{"physics": "grounding_spring", "node": n, "dof": design.dofs[0], "k": k} for n in (nodes[0], nodes[-1], nodes[len(nodes) // 2])]


# --------------------------------------------------------------------------------------------------------------------------------------------- effects


@dataclass(frozen=True)
class Scene:
    """What an effect is drawn on: the drawing, natural frequencies (Hz) and shapes of its structure, the band's top."""

    design: Design
    f: np.ndarray
    top: float
    kind: str
    sensors: tuple[tuple[int, str], ...]

    def free(self) -> list[tuple[int, str]]:
        """(node, dof) of free translations."""
        held = set(self.design.held)
        return [(n, d) for n in self.design.nodes for d in self.design.dofs if d in ("x", "y", "z") and (n, d) not in held]


def _pick(rng: Generator, items: Sequence[Any]) -> Any:
    return items[int(rng.integers(len(items)))]


def place(nodes: Sequence[int] = (), elements: Sequence[int] = (), groups: Sequence[str] = (), dof: str | None = None) -> dict[str, Any]:
    """A location in the contract's form."""
    return {"nodes": list(nodes), "elements": list(elements), "groups": list(groups), **({"dof": dof} if dof else {})}


def neighbours(design: Design, ids: Sequence[int]) -> list[int]:
    """Elements that share a node with any of these (and these)."""
    nodes = {n for e in design.elements if e.id in ids for n in e.nodes}
    kinds = {e.kind for e in design.elements if e.id in ids}
    return [e.id for e in design.elements if e.kind in kinds and nodes & set(e.nodes)]


def _members(rng: Generator, scene: Scene) -> tuple[list[int], list[str]]:
    """Elements that change: one spring, a run of one to four, a patch of a plate, or a group (its name then)."""
    d = scene.design
    if d.family == "chain":
        e = _pick(rng, [e for e in d.elements if e.kind == "spring"])
        return [e.id], [e.group]
    groups = sorted({e.group for e in d.elements})
    if rng.random() < 0.25 and len(groups) > 1:
        g = str(_pick(rng, groups))
        return [e.id for e in d.elements if e.group == g], [g]
    if d.family == "plate":
        xs = sorted({x[0] for x in d.nodes.values()})
        nx, ny = len(xs) - 1, len(d.elements) // (len(xs) - 1)
        w, h = int(rng.integers(1, 4)), int(rng.integers(1, 4))
        i, j = int(rng.integers(0, nx - min(w, nx) + 1)), int(rng.integers(0, ny - min(h, ny) + 1))
        return [1 + i + p + (j + q) * nx for q in range(min(h, ny)) for p in range(min(w, nx))], []
    long = int(rng.integers(1, 5))
    start = _pick(rng, d.elements)
    run = [start.id]
    for k in range(1, long):
        after = next((e for e in d.elements if e.id == start.id + k and e.group == start.group), None)
        if after is None:
            break
        run.append(after.id)
    return run, []


def _change(rng: Generator, small: float, large: float, up: float) -> float:
    """A factor: below one mostly."""
    size = between(rng, small, large)
    return figures(1.0 + 1.5 * size if rng.random() < up else 1.0 - size)


def _factor(rng: Generator, scene: Scene, word: str) -> Finding:
    ids, groups = _members(rng, scene)
    d = scene.design
    factor = {"stiffness_change": lambda: _change(rng, 0.03, 0.6, 0.35), "mass_change": lambda: _change(rng, 0.04, 0.5, 0.7),
              "thickness_change": lambda: _change(rng, 0.02, 0.35, 0.5)}[word]()
    effect = {"physics": word, "elements": ids, "factor": factor}
    whole = bool(groups) and word != "thickness_change"
    near = [] if groups else neighbours(d, ids)
    nodes = sorted({n for e in d.elements if e.id in near or e.id in ids for n in e.nodes})
    equivalent: list[dict[str, Any]] = []
    if d.family == "chain":
        e = next(e for e in d.elements if e.id == ids[0])
        if len(e.nodes) == 1 and factor > 1.0:
            equivalent.append({"physics": "grounding_spring", "location": place(e.nodes, dof="x")})
    elif word == "stiffness_change" and factor < 1.0 and len(ids) <= 2 and d.family in ("bar", "frame"):
        equivalent.append({"physics": "joint_flexibility", "location": place(nodes, near)})
        held = [n for n, _ in d.held if n in nodes]
        if held:
            equivalent.append({"physics": "grounding_spring", "location": place(held)})
    elif word == "mass_change" and len(ids) <= 2:
        equivalent.append({"physics": "added_mass", "location": place(nodes)})
    groups_of = groups or sorted({e.group for e in d.elements if e.id in ids})
    return Finding(effect, place((), ids, groups_of), (("factor", factor, 0.15),), {"elements": near} if near else {}, tuple(equivalent),
                   ("parameter_error",) if whole else ("missing_physics", "parameter_error"))


def _added_mass(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = _pick(rng, scene.free())
    m = between(rng, 0.002, 0.1) * mass_of(d)
    own = next((e for e in d.elements if e.kind == "mass" and e.nodes == (node,)), None)
    equivalent: list[dict[str, Any]] = []
    if own is not None:
        m = -min(m, 0.8 * own.value) if rng.random() < 0.3 else m
        equivalent.append({"physics": "mass_change", "location": place((), [own.id], [own.group])})
    else:
        touching = [e.id for e in d.elements if node in e.nodes]
        equivalent.append({"physics": "mass_change", "location": place((), touching)})
    m = figures(m)
    dofs = [k for k in d.dofs if k in ("x", "y", "z") and (node, k) not in d.held]
    verdicts = ("missing_physics",) if own is None else ("missing_physics", "parameter_error")
    return Finding({"physics": word, "node": node, "dofs": dofs, "m": m}, place([node], dof=dof if len(dofs) == 1 else None), (("m", m, 0.2),), {},
                   tuple(equivalent), verdicts)


def _grounding(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = _pick(rng, scene.free())
    omega = 2.0 * np.pi * scene.f[0]
    k = figures(between(rng, 0.01, 2.0) * omega**2 * mass_of(d) / 4.0)
    own = next((e for e in d.elements if e.kind == "spring" and e.nodes == (node,)), None)
    equivalent = () if own is None else ({"physics": "stiffness_change", "location": place((), [own.id], [own.group])},)
    return Finding({"physics": "grounding_spring", "node": node, "dof": dof, "k": k}, place([node], dof=dof), (("k", k, 0.25),), {}, equivalent,
                   ("missing_physics",) if own is None else ("missing_physics", "parameter_error"))


def _soft_support(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = _pick(rng, d.held)
    element = next(e for e in d.elements if node in e.nodes)
    L = float(np.linalg.norm(np.subtract(*(d.nodes[n] for n in element.nodes))))
    EI = d.E * d.section[0] * d.section[1] ** 3 / 12.0
    along = abs(d.nodes[element.nodes[0]][0] - d.nodes[element.nodes[1]][0]) > 0.5 * L
    scale = 4.0 * EI / L if dof == "ry" else d.E * d.section[0] * d.section[1] / L if (dof == "x") == along else 12.0 * EI / L**3
    k = figures(between(rng, 0.05, 20.0) * scale)
    near = [e.id for e in d.elements if node in e.nodes]
    equivalent = [{"physics": "stiffness_change", "location": place((), near)}]
    if dof == "ry":
        equivalent.append({"physics": "joint_flexibility", "location": place([node, *element.nodes], near)})
    return Finding({"physics": "grounding_spring", "node": node, "dof": dof, "k": k}, place([node], dof=dof), (("k", k, 0.3),), {}, tuple(equivalent))


def _joint(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    count: dict[int, int] = {}
    for e in d.elements:
        for n in e.nodes:
            count[n] = count.get(n, 0) + 1
    node = _pick(rng, [n for n in count if count[n] > 1])
    corners = [n for n in count if count[n] > 1 and len({e.group for e in d.elements if n in e.nodes}) > 1]
    if d.family == "frame" and rng.random() < 0.7:
        node = _pick(rng, corners)
    element = _pick(rng, [e for e in d.elements if node in e.nodes])
    L = float(np.linalg.norm(np.subtract(*(d.nodes[n] for n in element.nodes))))
    k = figures(between(rng, 0.1, 10.0) * 4.0 * d.E * d.section[0] * d.section[1] ** 3 / 12.0 / L)
    touching = [e.id for e in d.elements if node in e.nodes]
    others = [node] if len(touching) == 2 else []
    accept = {"elements": touching if others else [element.id]}
    near = neighbours(d, touching)
    return Finding({"physics": word, "node": node, "elements": [element.id], "k": k}, place([node], [element.id], dof="ry"), (("k", k, 0.3),), accept,
                   ({"physics": "stiffness_change", "location": place((), near if len(touching) == 2 else [element.id])},))


def _shear(rng: Generator, scene: Scene, word: str) -> Finding:
    ids = [e.id for e in scene.design.elements]
    groups = sorted({e.group for e in scene.design.elements})
    return Finding({"physics": word, "elements": ids}, place((), ids, groups), (), {"groups": groups})


def _preload(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    ids = [e.id for e in d.elements]
    groups = sorted({e.group for e in d.elements})
    L = max(x[0] for x in d.nodes.values())
    euler = np.pi**2 * d.E * d.section[0] * d.section[1] ** 3 / 12.0 / L**2
    N = figures(between(rng, 0.02, 0.6) * (1.0 if rng.random() < 0.6 else -1.0) * euler)
    return Finding({"physics": word, "elements": ids, "N": N}, place((), ids, groups), (("N", N, 0.2),), {"groups": groups})


def _resonator(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = _pick(rng, scene.free())
    low = 0.5 * scene.f[0]
    f = between(rng, low, 0.9 * scene.top)
    m = between(rng, 0.002, 0.06) * mass_of(d)
    zeta = rng.uniform(0.005, 0.04)
    k = m * (2.0 * np.pi * f) ** 2
    c = 2.0 * zeta * m * 2.0 * np.pi * f
    m, k, c = figures(m), figures(k), figures(c)
    near = sorted({n for e in d.elements if node in e.nodes for n in e.nodes if d.family != "chain"} | {node})
    effect = {"physics": word, "node": node, "dof": dof, "m": m, "k": k, "c": c}
    return Finding(effect, place([node], dof=dof), (("m", m, 0.25), ("k", k, 0.25)), {"nodes": near})


def _damper(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    c = figures(between(rng, 0.2, 10.0) * d.eta * 2.0 * np.pi * scene.f[0] * mass_of(d) / 4.0)
    springs = [e for e in d.elements if e.kind == "spring" and len(e.nodes) == 2]
    if springs and rng.random() < 0.6:
        e = _pick(rng, springs)
        return Finding({"physics": word, "nodes": list(e.nodes), "dof": "x", "c": c}, place(e.nodes, dof="x"), (("c", c, 0.25),), {},
                       ({"physics": "structural_damping", "location": place((), [e.id], [e.group])},))
    node, dof = _pick(rng, scene.free())
    own = next((e for e in d.elements if e.kind == "spring" and e.nodes == (node,)), None)
    equivalent = () if own is None else ({"physics": "structural_damping", "location": place((), [own.id], [own.group])},)
    return Finding({"physics": word, "nodes": [node], "dof": dof, "c": c}, place([node], dof=dof), (("c", c, 0.25),), {}, equivalent)


def _structural(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    group = _pick(rng, sorted({e.group for e in d.elements if e.kind in ("spring", "bar")}))
    members = [e for e in d.elements if e.group == group]
    ids = [e.id for e in members]
    eta = figures(between(rng, 0.3, 12.0) * d.eta)
    equivalent = ()
    if members[0].kind == "spring":
        equivalent = ({"physics": "viscous_damper", "location": place(members[0].nodes, dof="x")},)
    return Finding({"physics": word, "elements": ids, "eta": eta}, place((), ids, [group]), (("eta", eta, 0.3),), {}, equivalent)


def _proportional(rng: Generator, scene: Scene, word: str) -> Finding:
    alpha = figures(between(rng, 0.3, 10.0) * scene.design.eta * 2.0 * np.pi * scene.f[0])
    return Finding({"physics": word, "alpha": alpha}, place(), (("alpha", alpha, 0.25),), {})


def _fault(rng: Generator, scene: Scene, word: str) -> Finding:
    node, dof = _pick(rng, scene.sensors)
    how = rng.random()
    if how < 0.35:
        delay = figures(between(rng, 0.01, 0.3) / scene.top)
        return Finding({"physics": word, "node": node, "dof": dof, "delay": delay}, place([node], dof=dof), (("delay", delay, 0.25),), {})
    gain = figures(-rng.uniform(0.7, 1.3)) if how < 0.6 else _change(rng, 0.03, 0.6, 0.4)
    return Finding({"physics": word, "node": node, "dof": dof, "gain": gain}, place([node], dof=dof), (("gain", gain, 0.1),), {})


def _orthotropy(rng: Generator, scene: Scene, word: str) -> Finding:
    ids = [e.id for e in scene.design.elements]
    Dx = figures(1.0 + between(rng, 0.05, 1.0))
    Dy, Dxy = figures(rng.uniform(0.8, 1.1)), figures(rng.uniform(0.8, 1.2))
    if rng.random() < 0.5:
        Dx, Dy = Dy, Dx
    groups = sorted({e.group for e in scene.design.elements})
    effect = {"physics": word, "elements": ids, "Dx": Dx, "Dy": Dy, "D1": 1.0, "Dxy": Dxy}
    return Finding(effect, place((), ids, groups), (("Dx", Dx, 0.15), ("Dy", Dy, 0.15)), {"groups": groups})


MAKERS: dict[str, Callable[[Generator, Scene, str], Finding]] = {
    "stiffness_change": _factor, "mass_change": _factor, "thickness_change": _factor, "orthotropy": _orthotropy, "added_mass": _added_mass,
    "grounding_spring": _grounding, "soft_support": _soft_support, "joint_flexibility": _joint, "shear_deformation": _shear, "axial_preload": _preload,
    "attached_resonator": _resonator, "viscous_damper": _damper, "structural_damping": _structural, "mass_proportional_damping": _proportional,
    "sensor_fault": _fault}  # fmt: skip


# ------------------------------------------------------------------------------------------------------------------------------------------------- case


def draw(seed: int, families: Sequence[str] = FAMILIES) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([20261121, seed])
    null = seed % 3 == 0
    word = str(_pick(rng, [w for w in WORDS if set(WORDS[w]) & set(families)]))
    possible = [f for f in families if null or f in WORDS[word]]
    weights = np.array([SHARES[f] for f in possible])
    family = str(rng.choice(possible, p=weights / weights.sum()))
    design = design_of(rng, family, "" if null else word)
    f = _frequencies(design)
    top = _band(rng, design, f)
    kind = str(rng.choice(("frf", "time", "modes"), p=(0.45, 0.4, 0.15)))
    if not null and kind == "modes" and word in NOT_IN_TABLES:
        kind = "frf"
    if not null and word == "structural_damping":
        kind = "frf"  # hysteretic losses are not causal: no exact run from rest exists
    sensors, drives = _instruments(rng, design)
    scene = Scene(design, f, top, kind, sensors)
    findings: list[Finding] = [] if null else [MAKERS[word](rng, scene, word)]
    if findings and rng.random() < 0.15:
        others = [w for w in SECOND if family in WORDS[w] and w != word and not (kind == "modes" and w in NOT_IN_TABLES)]
        findings.append(MAKERS[(second := str(_pick(rng, others)))](rng, scene, second))
    sk, sm = rng.uniform(0.003, 0.012), rng.uniform(0.002, 0.006)
    groups = {e.group: (1.0 + float(np.clip(sk * rng.standard_normal(), -0.025, 0.025)), 1.0 + float(np.clip(sm * rng.standard_normal(), -0.015, 0.015)))
              for e in design.elements}
    scatter = {e.id: (groups[e.group][0] * (1.0 + 6e-4 * rng.standard_normal()), groups[e.group][1] * (1.0 + 6e-4 * rng.standard_normal()))
               for e in design.elements}
    zeta = design.eta / 2.0 * np.exp(np.clip(0.25 * rng.standard_normal(), -0.5, 0.5) + np.clip(0.22 * rng.standard_normal(60), -0.5, 0.5))
    return Case(seed, design, scatter, zeta, tuple(findings), kind, float(f[0]), top, sensors, drives, between(rng, 0.002, 0.02))


def _band(rng: Generator, design: Design, f: np.ndarray) -> float:
    """Top of the band, Hz: so many modes as the mesh carries and as records of a sensible length resolve."""
    elements = len(design.elements)
    most = {"chain": 12, "bar": 10, "rod": elements // 6, "frame": 10, "plate": 7}[design.family]
    if design.family in ("bar", "frame"):
        own = _frequencies(design, coarse=True)[: len(f)]
        most = int(np.argmax(np.append(np.abs(own / f[: len(own)] - 1.0) > MESH, True)))
    count = min(int(rng.integers(4, 11)), most, int(np.sum(f < max(RATIO * design.eta, 8.0) * f[0])))
    if count >= len(f):
        return float(1.3 * f[-1])
    return float(f[count - 1] + rng.uniform(0.3, 0.7) * (f[count] - f[count - 1]))


def _frequencies(design: Design, coarse: bool = False) -> np.ndarray:
    """Flexible natural frequencies of the drawing, Hz."""
    f = natural(build(design, {}, cords(design), coarse), 0.0, 24)[0] / (2.0 * np.pi)
    return f if design.held or design.family == "chain" else f[f > 0.5 * _first(design)]


def _instruments(rng: Generator, design: Design) -> tuple[tuple[tuple[int, str], ...], tuple[tuple[int, str], ...]]:
    """Sensors on a random part of the free translations; one drive for what is fitted, mostly another for what is held out."""
    held = set(design.held)
    free = [(n, d) for n in design.nodes for d in design.dofs if d in ("x", "z") and (n, d) not in held]
    least = min(len(free), max(3, int(np.ceil(0.6 * len(free))) if design.family == "chain" else 4))
    most = len(free) if design.family == "chain" else min(len(free), 14)
    chosen = sorted(rng.choice(len(free), int(rng.integers(least, most + 1)), replace=False).tolist())
    sensors = tuple(free[i] for i in chosen)
    at = rng.permutation(len(free))
    fit = sensors[int(rng.integers(len(sensors)))] if rng.random() < 0.7 else free[int(at[0])]
    out = fit if rng.random() < 0.3 else next(free[int(i)] for i in at if free[int(i)] != fit)
    return sensors, (fit, out)


# -------------------------------------------------------------------------------------------------------------------------------------------- recordings


def lowest(m: Modal, case: Case) -> float:
    """The lowest flexible natural frequency on the bench, Hz; bodies that swing on their cords do not count."""
    f = m.damped()[0]
    return float(f[f > 0.1 * case.first].min())


def frf(rng: Generator, m: Modal, case: Case, drive: tuple[int, str]) -> dict[str, np.ndarray]:
    """H1 accelerance and coherence from so many averages, line by line, under white excitation; noise on the responses."""
    low = 0.4 * lowest(m, case)
    zeta = float(np.min(m.damped()[1]))
    step = max(2.0 * zeta * low, case.top / 6000.0)  # low is 0.4 of the first frequency: 1.25 half-power bandwidths hold one line at worst
    f = np.arange(max(low, step), case.top, step).astype(np.float32).astype(float)
    H = m.accelerance(f, m.rows(case.sensors), m.rows([drive]))[:, :, 0] * faults(case, f)
    averages = int(rng.integers(10, 60))
    noise = case.noise * np.sqrt(np.mean(np.abs(H) ** 2)) * np.sqrt(averages)
    shape = (averages, len(f))
    X = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    Sxx = np.sum(np.abs(X) ** 2, axis=0)
    out, coherence = np.empty(H.shape, dtype=np.complex64), np.empty(H.shape, dtype=np.float32)
    for s in range(H.shape[1]):
        Y = H[:, s] * X + noise * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
        Syx, Syy = np.sum(Y * np.conj(X), axis=0), np.sum(np.abs(Y) ** 2, axis=0)
        out[:, s], coherence[:, s] = Syx / Sxx, np.abs(Syx) ** 2 / (Sxx * Syy)
    return {"frequency": f.astype(np.float32), "H": out[:, :, None], "coherence": coherence[:, :, None],
            "response_node": np.array([n for n, _ in case.sensors]), "response_dof": np.array([CODES[d] for _, d in case.sensors]),
            "reference_node": np.array([drive[0]]), "reference_dof": np.array([CODES[drive[1]]]), "averages": np.array(averages)}


def history(rng: Generator, m: Modal, case: Case, drive: tuple[int, str]) -> tuple[np.ndarray, float]:
    """(samples x channels, rate): a random force with smooth ends in the band, accelerations with noise and 16-bit steps."""
    rate = figures(2.56 * case.top, 4)
    first = lowest(m, case)
    need = 1.5 * rate / (case.design.eta * first)  # the record is as long as the slowest mode rings
    n = next((size for size in (4096, 6144, 8192, 12288) if size >= need), 16384)
    f = np.fft.rfftfreq(n, 1.0 / rate)
    inside = (f > 0.3 * first) & (f < case.top)
    force = np.fft.irfft(inside * np.exp(2j * np.pi * rng.random(len(f))), n)
    ramp = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.02 * n))
    force *= np.sin(0.5 * np.pi * ramp) ** 2
    force *= between(rng, 1.0, 20.0) / np.std(force)
    a = m.run(force, rate, m.rows(case.sensors), m.rows([drive])[0])
    late = np.fft.irfft(np.fft.rfft(a, axis=0) * faults(case, f), n, axis=0)
    data = np.column_stack([force, late])
    level = case.noise * np.sqrt(np.mean(a**2))
    data[:, 1:] += level * rng.standard_normal(a.shape)
    data[:, 0] += 0.1 * case.noise * np.std(force) * rng.standard_normal(n)
    steps = np.abs(data).max(axis=0) / 2**15
    return (np.round(data / steps) * steps).astype(np.float32), rate


def faults(case: Case, f: np.ndarray) -> np.ndarray:
    """What faulty channels do to every sensor, (lines, sensors)."""
    out = np.ones((len(f), len(case.sensors)), dtype=complex)
    for x in case.findings:
        e = x.effect
        if e["physics"] == "sensor_fault":
            at = case.sensors.index((e["node"], e["dof"]))
            out[:, at] *= e["gain"] if "gain" in e else np.exp(-2j * np.pi * f * e["delay"])
    return out


def table(rng: Generator, m: Modal, case: Case) -> list[dict[str, Any]]:
    """The modes below the band's top: frequency, damping, shape at the sensors, with deviations."""
    frequency, zeta = m.damped()
    rows = []
    for r in np.flatnonzero((frequency < case.top) & (frequency > 0.9 * lowest(m, case))):
        shape = m.shapes[m.rows(case.sensors), r]
        shape = shape / shape[np.argmax(np.abs(shape))]
        spread = 5e-4 * rng.uniform(0.5, 2.0)
        rows.append({"frequency": figures(frequency[r] * (1.0 + spread * rng.standard_normal()), 7), "frequency_std": figures(spread * frequency[r], 3),
                     "damping": figures(zeta[r] * (1.0 + 0.05 * rng.standard_normal()), 4), "damping_std": figures(0.05 * zeta[r], 2),
                     "shape": [round(float(x + case.noise * rng.standard_normal()), 4) for x in shape], "shape_std": figures(case.noise, 2)})
    return rows


# ------------------------------------------------------------------------------------------------------------------------------------------------ writing


def toml(value: Any) -> str:
    """A value as TOML text on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace('"', "'") + '"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return repr(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


def model_text(design: Design) -> list[str]:
    """The [model] table."""
    out = ["[model]", f"dofs = {toml(design.dofs)}", "nodes = ["]
    out += [f"  {toml({'id': n, 'x': x, 'y': y, 'z': z})}," for n, (x, y, z) in design.nodes.items()] + ["]", ""]
    if design.family != "chain":
        out += ["[model.materials.metal]", f"E = {toml(design.E)}", f"nu = {toml(design.nu)}", f"rho = {toml(design.rho)}", "", "[model.sections.main]"]
        out += ['shape = "plate"', f"thickness = {toml(design.section[0])}", ""] if design.family == "plate" else \
               ['shape = "rectangle"', f"width = {toml(design.section[0])}", f"height = {toml(design.section[1])}", ""]
    words = {"bar": "beam2d" if design.family == "frame" else "beam3d", "rod": "rod", "plate": "plate", "spring": "spring", "mass": "mass"}
    for kind in dict.fromkeys(e.kind for e in design.elements):
        out += ["[[model.elements]]", f'type = "{words[kind]}"']
        if kind in ("bar", "rod", "plate"):
            out += ['mass = "consistent"', 'material = "metal"', 'section = "main"']
        out += ['dof = "x"'] if kind == "spring" else []
        value = {"spring": "k", "mass": "m"}.get(kind)
        rows = [{"id": e.id, "nodes": list(e.nodes), **({value: e.value} if value else {}), "group": e.group} for e in design.elements if e.kind == kind]
        out += ["rows = [", *(f"  {toml(r)}," for r in rows), "]", ""]
    supports: dict[tuple[str, ...], list[int]] = {}
    for node in dict.fromkeys(n for n, _ in design.held):
        supports.setdefault(tuple(d for n, d in design.held if n == node), []).append(node)
    for dofs, nodes in supports.items():
        out += ["[[model.supports]]", f"nodes = {toml(nodes)}", f"dofs = {toml(dofs)}", ""]
    return [*out, "[model.damping]", 'kind = "structural"', f"eta = {toml(design.eta)}", ""]


def write(case: Case, folder: Path) -> None:
    """The whole folder: problem.toml, recordings, truth.toml."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([20261122, case.seed])
    m = modal(build(case.design, case.scatter, case.effects), case.top, case.zeta)
    out = [f'title = "Generated problem {case.seed}"', 'source = "problems/generate.py: nominal drawing values"', "", *model_text(case.design)]
    out += _recordings(rng, m, case, folder)
    (folder / "problem.toml").write_text("\n".join(out) + "\n", encoding="utf-8")
    (folder / "truth.toml").write_text("\n".join(truth_text(case, m)) + "\n", encoding="utf-8")


def _recordings(rng: Generator, m: Modal, case: Case, folder: Path) -> list[str]:
    out: list[str] = []
    if case.kind == "modes":
        rows = table(rng, m, case)
        keep = int(rng.integers(max(1, len(rows) - 3), len(rows))) if len(rows) > 3 else len(rows) - 1
        channels = [{"column": i, "quantity": "displacement", "node": n, "dof": d} for i, (n, d) in enumerate(case.sensors)]
        for use, part in (("fit", [r for i, r in enumerate(rows) if i != keep]), ("hold-out", [rows[keep]])):
            out += ["[[recordings]]", 'kind = "modes"', f'use = "{use}"', 'response = "displacement"']
            out += ["rows = [", *(f"  {toml(r)}," for r in part), "]", "channels = [", *(f"  {toml(c)}," for c in channels), "]", ""]
        return out
    uses = ("fit", "fit", "hold-out") if case.kind == "time" or rng.random() < 0.3 else ("fit", "hold-out")
    for k, use in enumerate(uses):
        drive = case.drives[1] if use == "hold-out" else case.drives[0]
        name = f"{'run' if case.kind == 'time' else 'frf'}{k + 1}"
        out += ["[[recordings]]", f'kind = "{case.kind}"', f'use = "{use}"']
        if case.kind == "frf":
            arrays = frf(rng, m, case, drive)
            averages = int(arrays.pop("averages"))
            np.savez(folder / f"{name}.npz", **arrays)
            out += [f'file = "{name}.npz"', 'response = "acceleration"', f"averages = {averages}", ""]
            continue
        data, rate = history(rng, m, case, drive)
        channels = [{"column": 0, "quantity": "force", "node": drive[0], "dof": drive[1]}]
        channels += [{"column": i + 1, "quantity": "acceleration", "node": n, "dof": d} for i, (n, d) in enumerate(case.sensors)]
        if case.seed % 4 == 1:
            header = ",".join(f"channel {i}" for i in range(data.shape[1]))
            np.savetxt(folder / f"{name}.csv", data, fmt="%.6g", delimiter=",", header=header, comments="")
        else:
            np.savez(folder / f"{name}.npz", data=data)
        out += [f'file = "{name}.{"csv" if case.seed % 4 == 1 else "npz"}"', 'response = "acceleration"', f"rate = {toml(rate)}",
                "channels = [", *(f"  {toml(c)}," for c in channels), "]", ""]
    return out


UNITS = {"m": "kg", "k": "N/m", "c": "N*s/m", "N": "N", "alpha": "1/s", "delay": "s"}


def truth_text(case: Case, m: Modal) -> list[str]:
    """``truth.toml`` in the form of problems/concealed, with how strongly the effect can be seen."""
    verdicts: list[str] = ["consistent"]
    if case.findings:
        both = [set(f.verdicts) for f in case.findings]
        verdicts = ["missing_physics"] if any("parameter_error" not in v for v in both) else \
                   [v for v in ("parameter_error", "missing_physics") if all(v in b for b in both)]
    out = [f"verdict = {toml(verdicts[0])}", f"accept = {toml(verdicts)}", f"family = {toml(case.design.family)}", f"recording = {toml(case.kind)}", ""]
    for f in case.findings:
        out += ["[[findings]]", f"physics = {toml(f.effect['physics'])}", f"location = {toml(f.location)}", f"accept = {toml(f.accept)}",
                f"equivalent = {toml(list(f.equivalent))}"]
        for name, value, tolerance in f.parameters:
            out += ["[[findings.parameters]]", f"name = {toml(name)}", f"value = {toml(value)}", f"unit = {toml(UNITS.get(name, '1'))}",
                    f"tolerance = {toml(tolerance)}", "aliases = []", "required = true"]
        out.append("")
    seen = [visibility(case, i, m) for i in range(len(case.findings))]
    return [*out, "[laboratory]", f"noise = {toml(figures(case.noise))}", f"visible = {toml([figures(v, 3) for v in seen])}",
            f"frequencies = {toml([figures(x, 6) for x in m.damped()[0][:8]])}"]


def visibility(case: Case, index: int, m: Modal) -> float:
    """How far the response (for tables of modes: frequencies or damping, in deviations) changes by an effect, the others being there; noise-free, relative."""
    rest = replace(case, findings=tuple(f for i, f in enumerate(case.findings) if i != index))
    without = modal(build(rest.design, rest.scatter, rest.effects), case.top, case.zeta)
    if case.kind == "modes":
        (a, za), (b, zb) = (x.damped() for x in (m, without))
        n = min(len(a), len(b))
        keep = (a[:n] < case.top) & (a[:n] > 0.1 * case.first)
        change = np.array([(a[:n] / b[:n] - 1.0)[keep] / 5e-4, (za[:n] / zb[:n] - 1.0)[keep] / 0.05])
        return float(np.sqrt(np.mean(change**2, axis=1).max()))
    f = np.linspace(0.3 * lowest(m, case), case.top, 1500)
    H, G = (x.accelerance(f, x.rows(case.sensors), x.rows([case.drives[0]]))[:, :, 0] * faults(c, f) for x, c in ((m, case), (without, rest)))
    return float(np.linalg.norm(H - G) / np.linalg.norm(G))


def make(seed: int, folder: Path, families: Sequence[str] = FAMILIES) -> Case:
    """Draw and write the case of a seed."""
    case = draw(seed, families)
    write(case, folder)
    return case


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the folders of seeds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("seeds", type=int, nargs="+", help="one folder each")
    parser.add_argument("--out", type=Path, default=Path("out/generated"), help="where the folders g<seed> go")
    options = parser.parse_args(arguments)
    for seed in options.seeds:
        make(seed, options.out / f"g{seed}")
        print(options.out / f"g{seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
