"""Drawings: random structures of each family as an analyst would model them, and how they hang in
the laboratory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation.generated.laboratory import Design, Effect, Element, build, natural

Generator = np.random.Generator

FAMILIES = ("chain", "bar", "rod", "frame", "plate")
SHARES = {"chain": 0.28, "bar": 0.32, "rod": 0.08, "frame": 0.2, "plate": 0.12}
STEEL, ALUMINIUM = (207e9, 0.3, 7850.0), (70e9, 0.33, 2700.0)
MESH = 0.005  # an analyst's mesh has its frequencies within this of the converged ones
# of the band's top to the first frequency, per loss factor: what 16384 samples or 6000 lines
# resolve
RATIO = 4000.0


def between(rng: Generator, low: float, high: float) -> float:
    """Even on a logarithmic scale."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def figures(x: float, digits: int = 4) -> float:
    """Rounded to so many digits, as a drawing gives it."""
    return float(f"{x:.{digits}g}")


def pick(rng: Generator, items: Sequence[Any]) -> Any:
    """One of the items."""
    return items[int(rng.integers(len(items)))]


def design_of(rng: Generator, family: str, word: str) -> Design:
    """A drawing of the given family on which the effect ``word`` can stand."""
    return {
        "chain": _chain,
        "bar": _bar,
        "rod": _rod,
        "frame": _frame,
        "plate": _plate,
        "rotor": _rotor,
    }[family](rng, word)


def _chain(rng: Generator, word: str) -> Design:
    n = int(rng.integers(3, 9))
    k, m = between(rng, 2e4, 2e6), between(rng, 0.5, 10.0)
    elements, number = [], 101
    both = rng.random() < 0.4
    for i in range(n + 1):
        if i == n and not both:
            break
        nodes = (1,) if i == 0 else (n,) if i == n else (i, i + 1)
        elements.append(
            Element(
                number, "spring", nodes, f"spring {i + 1}", figures(k * rng.uniform(0.7, 1.4), 3)
            )
        )
        number += 1
    if n > 3 and rng.random() < 0.3:  # a spring past a neighbour
        i = int(rng.integers(1, n - 1))
        elements.append(
            Element(
                number,
                "spring",
                (i, i + 2),
                f"spring {number - 100}",
                figures(k * rng.uniform(0.3, 0.8), 3),
            )
        )
    elements += [
        Element(201 + i, "mass", (i + 1,), f"mass {i + 1}", figures(m * rng.uniform(0.7, 1.4), 3))
        for i in range(n)
    ]
    nodes_at = {i + 1: (float(i + 1), 0.0, 0.0) for i in range(n)}
    return Design(
        "chain",
        ("x",),
        nodes_at,
        tuple(elements),
        (),
        1.0,
        0.3,
        1.0,
        (),
        figures(between(rng, 6e-3, 4e-2), 2),
    )


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
    kinds = {
        "axial_preload": ("pinned", "clamped both"),
        "soft_support": ("cantilever", "pinned", "clamped both"),
        "shear_deformation": ("free", "pinned", "cantilever"),
    }
    ends = str(rng.choice(kinds.get(word, ("cantilever", "free", "pinned", "clamped both"))))
    last = n + 1
    held = {
        "free": [],
        "cantilever": [(1, "z"), (1, "ry")],
        "pinned": [(1, "z"), (last, "z")],
        "clamped both": [(1, "z"), (1, "ry"), (last, "z"), (last, "ry")],
    }[ends]
    return Design(
        "bar",
        ("z", "ry"),
        _line(rng, length, n),
        tuple(Element(i + 1, "bar", (i + 1, i + 2), groups[i]) for i in range(n)),
        tuple(held),
        E,
        nu,
        rho,
        (figures(height * rng.uniform(1.0, 4.0), 3), height),
        figures(between(rng, 5e-3, 2.5e-2), 2),
    )


def _rod(rng: Generator, word: str) -> Design:
    E, nu, rho = STEEL if rng.random() < 0.6 else ALUMINIUM
    n = int(rng.integers(24, 41))
    length = figures(rng.uniform(0.8, 3.0), 3)
    groups = _sections(rng, n, 3)
    held = ((1, "x"),) if rng.random() < 0.7 else ()
    return Design(
        "rod",
        ("x",),
        _line(rng, length, n),
        tuple(Element(i + 1, "rod", (i + 1, i + 2), groups[i]) for i in range(n)),
        held,
        E,
        nu,
        rho,
        (0.03, 0.02),
        figures(between(rng, 5e-3, 2e-2), 2),
    )


def _frame(rng: Generator, word: str) -> Design:
    """A portal, a portal with a second storey, or an angle: members of four to six elements, each a
    group."""
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
        elements += [
            Element(len(elements) + 1 + k, "bar", (chain[k], chain[k + 1]), group)
            for k in range(parts)
        ]
    height = figures(min(w, h) / rng.uniform(30.0, 60.0), 3)
    held = tuple((f + 1, d) for f in feet for d in ("x", "z", "ry"))
    return Design(
        "frame",
        ("x", "z", "ry"),
        nodes,
        tuple(elements),
        held,
        E,
        nu,
        rho,
        (figures(height * rng.uniform(1.0, 3.0), 3), height),
        figures(between(rng, 6e-3, 2.5e-2), 2),
    )


def _plate(rng: Generator, word: str) -> Design:
    E, nu, rho = STEEL if rng.random() < 0.4 else ALUMINIUM
    nx, ny = int(rng.integers(6, 9)), int(rng.integers(5, 7))
    a, b = figures(rng.uniform(0.4, 0.9), 3), figures(rng.uniform(0.3, 0.6), 3)
    nodes = {
        1 + i + j * (nx + 1): (figures(a * i / nx, 6), figures(b * j / ny, 6), 0.0)
        for j in range(ny + 1)
        for i in range(nx + 1)
    }
    elements = []
    for j in range(ny):
        for i in range(nx):
            corner = 1 + i + j * (nx + 1)
            elements.append(
                Element(
                    1 + i + j * nx,
                    "plate",
                    (corner, corner + 1, corner + nx + 2, corner + nx + 1),
                    "plate",
                )
            )
    clamped = rng.random() < 0.5
    held = tuple(
        (n, d) for n, x in nodes.items() if clamped and x[0] == 0.0 for d in ("z", "rx", "ry")
    )
    return Design(
        "plate",
        ("z", "rx", "ry"),
        nodes,
        tuple(elements),
        held,
        E,
        nu,
        rho,
        (figures(min(a, b) / rng.uniform(60.0, 150.0), 2),),
        figures(between(rng, 6e-3, 3e-2), 2),
    )


def _rotor(rng: Generator, word: str) -> Design:
    """A round shaft with a disc off the middle, on two bearings that are unequal in y and z; at
    rest in the drawing."""
    E, nu, rho = STEEL
    n = int(rng.integers(10, 17))
    length = figures(rng.uniform(0.4, 1.0), 3)
    d = figures(length / rng.uniform(30.0, 60.0), 3)
    elements = [Element(i + 1, "shaft", (i + 1, i + 2), "shaft") for i in range(n)]
    at = int(rng.integers(2, n // 2)) + (1 if rng.random() < 0.5 else n // 2)
    radius, m = (
        rng.uniform(2.0, 5.0) * d,
        between(rng, 0.3, 2.0) * length * np.pi * d**2 / 4.0 * rho,
    )
    disc = (
        figures(m * radius**2 / 2.0),
        figures(m * radius**2 / 4.0),
        figures(m * radius**2 / 4.0),
    )
    elements.append(Element(201, "mass", (at,), "disc", figures(m), inertia=disc))
    soft = 48.0 * E * np.pi * d**4 / 64.0 / length**3
    for k, (node, dof) in enumerate((1, y) for y in ("y", "z")):
        elements.append(
            Element(
                301 + k,
                "spring",
                (node,),
                f"bearing A {dof}",
                figures(soft * between(rng, 3.0, 30.0), 3),
                dof,
            )
        )
    for k, dof in enumerate(("y", "z")):
        elements.append(
            Element(
                303 + k,
                "spring",
                (n + 1,),
                f"bearing B {dof}",
                figures(soft * between(rng, 3.0, 30.0), 3),
                dof,
            )
        )
    return Design(
        "rotor",
        ("y", "z", "ry", "rz"),
        _line(rng, length, n),
        tuple(elements),
        (),
        E,
        nu,
        rho,
        (d,),
        figures(between(rng, 6e-3, 2.5e-2), 2),
    )


def mass_of(design: Design) -> float:
    """Total mass of the drawing, kg."""
    total = 0.0
    for e in design.elements:
        if e.kind == "mass":
            total += e.value
        elif e.kind == "plate":
            x = np.array([design.nodes[n] for n in e.nodes])
            total += float(np.ptp(x[:, 0]) * np.ptp(x[:, 1])) * design.section[0] * design.rho
        elif e.kind == "shaft":
            total += (
                float(np.linalg.norm(np.subtract(*(design.nodes[n] for n in e.nodes))))
                * np.pi
                * design.section[0] ** 2
                / 4.0
                * design.rho
            )
        elif e.kind in ("bar", "rod"):
            total += (
                float(np.linalg.norm(np.subtract(*(design.nodes[n] for n in e.nodes))))
                * design.section[0]
                * design.section[1]
                * design.rho
            )
    return total


def cords(design: Design) -> tuple[Effect, ...]:
    """Soft cords of a free structure: rigid modes near a sixtieth of the first flexible
    frequency."""
    if design.grounded:
        return ()
    dof = design.dofs[0]
    flexible = first_flexible(design)
    ends = list(design.nodes)
    at = (
        [ends[0], ends[-1]]
        if design.family != "plate"
        else [n for n in ends if all(design.nodes[n][k] in _rim(design, k) for k in (0, 1))]
    )
    k = mass_of(design) / len(at) * (2.0 * np.pi * flexible / 60.0) ** 2
    return tuple({"physics": "grounding_spring", "node": n, "dof": dof, "k": k} for n in at)


def _rim(design: Design, k: int) -> tuple[float, float]:
    values = [x[k] for x in design.nodes.values()]
    return min(values), max(values)


def first_flexible(design: Design) -> float:
    """First flexible natural frequency of the drawing, Hz."""
    s = build(design, {}, [] if design.grounded else _ballast(design))
    f = natural(s, 0.0, 6)[0] / (2.0 * np.pi)
    rigid = 0 if design.grounded else {"bar": 2, "rod": 1, "plate": 3}[design.family]
    return float(f[rigid])


def _ballast(design: Design) -> list[Effect]:
    """A support of almost nothing, so that the matrices are definite."""
    nodes = list(design.nodes)
    k = 1e-9 * design.E * design.section[-1] ** 3
    return [
        {"physics": "grounding_spring", "node": n, "dof": design.dofs[0], "k": k}
        for n in (nodes[0], nodes[-1], nodes[len(nodes) // 2])
    ]


def frequencies(design: Design, coarse: bool = False) -> np.ndarray:
    """Flexible natural frequencies of the drawing, Hz."""
    f = natural(build(design, {}, cords(design), coarse), 0.0, 24)[0] / (2.0 * np.pi)
    return f if design.grounded else f[f > 0.5 * first_flexible(design)]


def band(rng: Generator, design: Design, f: np.ndarray) -> float:
    """Top of the band, Hz: so many modes as the mesh carries and as records of a sensible length
    resolve."""
    elements = len(design.elements)
    most = {"chain": 12, "bar": 10, "rod": elements // 6, "frame": 10, "plate": 7, "rotor": 10}[
        design.family
    ]
    if design.family in ("bar", "frame"):
        own = frequencies(design, coarse=True)[: len(f)]
        most = int(np.argmax(np.append(np.abs(own / f[: len(own)] - 1.0) > MESH, True)))
    count = min(
        int(rng.integers(4, 11)), most, int(np.sum(f < max(RATIO * design.eta, 8.0) * f[0]))
    )
    if count >= len(f):
        return float(1.3 * f[-1])
    return float(f[count - 1] + rng.uniform(0.3, 0.7) * (f[count] - f[count - 1]))
