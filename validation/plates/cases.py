"""A case of the CalculiX laboratory, from its seed: a plate or a plane frame as an analyst draws
it, what is concealed in it, usual scatter, sensors and noise.

Seeds 0 to 29 are for development, 1000 to 1029 the evaluation; what is concealed goes by the last
digits of a seed, so that both halves hold the same kinds: twenty with effects, ten without.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from validation.generated.cases import Case, instruments
from validation.generated.drawings import Generator, between, design_of, figures, frequencies
from validation.generated.effects import MAKERS, Finding, Scene, place
from validation.generated.laboratory import Design, Effect, Element

COUNT, EVALUATION = 30, 1000  # cases of each half; first seed of the evaluation
EARLY = 10  # the first ten of each half: meshes of four to seven by three to five
KINDS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("plate", ()),
    ("plate", ("added_mass",)),
    ("plate", ("thickness_change",)),
    ("plate", ("grounding_spring",)),
    ("plate", ("attached_resonator",)),
    ("plate", ("stiffness_change",)),
    ("plate", ()),
    ("plate", ("mass_change",)),
    ("plate", ("added_mass",)),
    ("plate", ("thickness_change",)),
    ("plate", ()),
    ("plate", ("orthotropy",)),
    ("plate", ("structural_damping",)),
    ("plate", ("soft_edge",)),
    ("plate", ("soft_edge", "added_mass")),
    ("plate", ("attached_resonator",)),
    ("plate", ("sensor_fault",)),
    ("plate", ()),
    ("frame", ("added_mass",)),
    ("frame", ("attached_resonator",)),
    ("frame", ("soft_support",)),
    ("frame", ()),
    ("frame", ("thickness_change",)),
    ("frame", ("structural_damping",)),
    ("frame", ("sensor_fault",)),
    ("frame", ()),
    ("frame", ()),
    ("plate", ()),
    ("plate", ()),
    ("plate", ()),
)  # (family, what is concealed) by a seed's number within its half


def draw(seed: int) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([20261123, seed])
    number = seed % EVALUATION % COUNT
    family, words = KINDS[number]
    design = _drawn(rng, family, words, early=number < EARLY)
    f = frequencies(design)
    count = int(rng.integers(5, 8))
    top = float(f[count - 1] + rng.uniform(0.3, 0.7) * (f[count] - f[count - 1]))
    sensors, drives = instruments(rng, design)
    scene = Scene(design, f, top, "frf", sensors)
    findings = tuple(_finding(rng, scene, word) for word in words)
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


def _drawn(rng: Generator, family: str, words: tuple[str, ...], early: bool) -> Design:
    """The drawing: a plate is clamped at one edge or on cords (at an edge where that is soft), of
    two groups where the damping of one is at stake."""
    word = words[0] if words else ""
    design = design_of(rng, family, word)
    if family != "plate":
        return design
    while "soft_edge" in words and not design.held:
        design = design_of(rng, family, word)
    nx, ny = (4, 8) if early else (4, 11), (3, 6) if early else (4, 11)
    design = _meshed(design, int(rng.integers(*nx)), int(rng.integers(*ny)))
    if word == "structural_damping" or (not early and rng.random() < 0.3):
        cut = int(rng.integers(1, _columns(design)))
        design = replace(design, elements=tuple(_grouped(design, e, cut) for e in design.elements))
    return design


def _meshed(design: Design, nx: int, ny: int) -> Design:
    """The same plate on a mesh of so many elements a side."""
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


def _columns(design: Design) -> int:
    return len({x[0] for x in design.nodes.values()}) - 1


def _grouped(design: Design, e: Element, cut: int) -> Element:
    left = (e.id - 1) % _columns(design) < cut
    return replace(e, group="inner panel" if left else "outer panel")


def _finding(rng: Generator, scene: Scene, word: str) -> Finding:
    if word == "soft_edge":
        return _soft_edge(rng, scene)
    if word == "structural_damping" and scene.design.family == "plate":
        return _lossy_panel(rng, scene)
    found = MAKERS[word](rng, scene, word)
    while word == "soft_support" and found.effect["dof"] == "ry":  # springs on expanded beams push
        found = MAKERS[word](rng, scene, word)
    return found


def _soft_edge(rng: Generator, scene: Scene) -> Finding:
    """A clamped edge that may turn on springs spread over it: each node of the file holds its part
    of them."""
    d = scene.design
    a, b = (max(x[k] for x in d.nodes.values()) for k in (0, 1))
    rigidity = d.E * d.section[0] ** 3 / 12.0 / (1.0 - d.nu**2)
    kappa = figures(between(rng, 2.0, 40.0) * rigidity / a)  # N·m/rad per metre
    nodes = [n for n, dof in d.held if dof == "ry"]
    k = figures(kappa * b / len(nodes))
    effect: Effect = {
        "physics": "grounding_spring",
        "nodes": nodes,
        "dof": "ry",
        "k": k,
        "kappa": kappa,
    }
    return Finding(effect, place(nodes, dof="ry"), (("k", k, 0.3),), {})


def _lossy_panel(rng: Generator, scene: Scene) -> Finding:
    d = scene.design
    group = str(rng.choice(sorted({e.group for e in d.elements})))
    ids = [e.id for e in d.elements if e.group == group]
    eta = figures(between(rng, 1.0, 8.0) * d.eta)
    effect: Effect = {"physics": "structural_damping", "elements": ids, "eta": eta}
    return Finding(effect, place((), ids, [group]), (("eta", eta, 0.3),), {})
