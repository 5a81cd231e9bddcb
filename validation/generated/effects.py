"""What is concealed: an effect at a random place with a random size, and what ``truth.toml``
says of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.generated.drawings import Generator, between, figures, mass_of, pick
from validation.generated.laboratory import Design, Effect

WORDS: dict[str, tuple[str, ...]] = {  # which families of structure can show an effect
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
NOT_IN_TABLES = (
    "attached_resonator",
    "viscous_damper",
    "structural_damping",
    "sensor_fault",
    "gyroscopic",
)  # a table of modes does not tell
SECOND = (
    "added_mass",
    "stiffness_change",
    "grounding_spring",
    "attached_resonator",
    "mass_proportional_damping",
    "sensor_fault",
)


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
class Scene:
    """What an effect is drawn on: the drawing, natural frequencies (Hz) and shapes of its
    structure, the band's top."""

    design: Design
    f: np.ndarray
    top: float
    kind: str
    sensors: tuple[tuple[int, str], ...]

    def free(self) -> list[tuple[int, str]]:
        """(node, dof) of free translations."""
        held = set(self.design.held)
        return [
            (n, d)
            for n in self.design.nodes
            for d in self.design.dofs
            if d in ("x", "y", "z") and (n, d) not in held
        ]


def place(
    nodes: Sequence[int] = (),
    elements: Sequence[int] = (),
    groups: Sequence[str] = (),
    dof: str | None = None,
) -> dict[str, Any]:
    """A location in the contract's form."""
    return {
        "nodes": list(nodes),
        "elements": list(elements),
        "groups": list(groups),
        **({"dof": dof} if dof else {}),
    }


def neighbours(design: Design, ids: Sequence[int]) -> list[int]:
    """Elements that share a node with any of these (and these)."""
    nodes = {n for e in design.elements if e.id in ids for n in e.nodes}
    kinds = {e.kind for e in design.elements if e.id in ids}
    return [e.id for e in design.elements if e.kind in kinds and nodes & set(e.nodes)]


def _members(rng: Generator, scene: Scene) -> tuple[list[int], list[str]]:
    """Elements that change: one spring, a run of one to four, a patch of a plate, or a group (its
    name then)."""
    d = scene.design
    if d.family == "chain":
        e = pick(rng, [e for e in d.elements if e.kind == "spring"])
        return [e.id], [e.group]
    groups = sorted({e.group for e in d.elements})
    if rng.random() < 0.25 and len(groups) > 1:
        g = str(pick(rng, groups))
        return [e.id for e in d.elements if e.group == g], [g]
    if d.family == "plate":
        xs = sorted({x[0] for x in d.nodes.values()})
        nx, ny = len(xs) - 1, len(d.elements) // (len(xs) - 1)
        w, h = int(rng.integers(1, 4)), int(rng.integers(1, 4))
        i, j = int(rng.integers(0, nx - min(w, nx) + 1)), int(rng.integers(0, ny - min(h, ny) + 1))
        return [1 + i + p + (j + q) * nx for q in range(min(h, ny)) for p in range(min(w, nx))], []
    long = int(rng.integers(1, 5))
    start = pick(rng, d.elements)
    run = [start.id]
    for k in range(1, long):
        after = next(
            (e for e in d.elements if e.id == start.id + k and e.group == start.group), None
        )
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
    factor = {
        "stiffness_change": lambda: _change(rng, 0.03, 0.6, 0.35),
        "mass_change": lambda: _change(rng, 0.04, 0.5, 0.7),
        "thickness_change": lambda: _change(rng, 0.02, 0.35, 0.5),
    }[word]()
    effect = {"physics": word, "elements": ids, "factor": factor}
    whole = bool(groups) and word != "thickness_change"
    near = [] if groups else neighbours(d, ids)
    nodes = sorted({n for e in d.elements if e.id in near or e.id in ids for n in e.nodes})
    equivalent: list[dict[str, Any]] = []
    if d.family == "chain":
        e = next(e for e in d.elements if e.id == ids[0])
        if len(e.nodes) == 1 and factor > 1.0:
            equivalent.append({"physics": "grounding_spring", "location": place(e.nodes, dof="x")})
    elif (
        word == "stiffness_change"
        and factor < 1.0
        and len(ids) <= 2
        and d.family in ("bar", "frame")
    ):
        equivalent.append({"physics": "joint_flexibility", "location": place(nodes, near)})
        held = [n for n, _ in d.held if n in nodes]
        if held:
            equivalent.append({"physics": "grounding_spring", "location": place(held)})
    elif word == "mass_change" and len(ids) <= 2:
        equivalent.append({"physics": "added_mass", "location": place(nodes)})
    groups_of = groups or sorted({e.group for e in d.elements if e.id in ids})
    return Finding(
        effect,
        place((), ids, groups_of),
        (("factor", factor, 0.15),),
        {"elements": near} if near else {},
        tuple(equivalent),
        ("parameter_error",) if whole else ("missing_physics", "parameter_error"),
    )


def _added_mass(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = pick(rng, scene.free())
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
    return Finding(
        {"physics": word, "node": node, "dofs": dofs, "m": m},
        place([node], dof=dof if len(dofs) == 1 else None),
        (("m", m, 0.2),),
        {},
        tuple(equivalent),
        verdicts,
    )


def _grounding(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = pick(rng, scene.free())
    omega = 2.0 * np.pi * scene.f[0]
    k = figures(between(rng, 0.01, 2.0) * omega**2 * mass_of(d) / 4.0)
    own = next((e for e in d.elements if e.kind == "spring" and e.nodes == (node,)), None)
    equivalent = (
        ()
        if own is None
        else ({"physics": "stiffness_change", "location": place((), [own.id], [own.group])},)
    )
    return Finding(
        {"physics": "grounding_spring", "node": node, "dof": dof, "k": k},
        place([node], dof=dof),
        (("k", k, 0.25),),
        {},
        equivalent,
        ("missing_physics",) if own is None else ("missing_physics", "parameter_error"),
    )


def _soft_support(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = pick(rng, d.held)
    element = next(e for e in d.elements if node in e.nodes)
    L = float(np.linalg.norm(np.subtract(*(d.nodes[n] for n in element.nodes))))
    EI = d.E * d.section[0] * d.section[1] ** 3 / 12.0
    along = abs(d.nodes[element.nodes[0]][0] - d.nodes[element.nodes[1]][0]) > 0.5 * L
    scale = (
        4.0 * EI / L
        if dof == "ry"
        else d.E * d.section[0] * d.section[1] / L
        if (dof == "x") == along
        else 12.0 * EI / L**3
    )
    k = figures(between(rng, 0.05, 20.0) * scale)
    near = [e.id for e in d.elements if node in e.nodes]
    equivalent = [{"physics": "stiffness_change", "location": place((), near)}]
    if dof == "ry":
        equivalent.append(
            {"physics": "joint_flexibility", "location": place([node, *element.nodes], near)}
        )
    return Finding(
        {"physics": "grounding_spring", "node": node, "dof": dof, "k": k},
        place([node], dof=dof),
        (("k", k, 0.3),),
        {},
        tuple(equivalent),
    )


def _joint(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    count: dict[int, int] = {}
    for e in d.elements:
        for n in e.nodes:
            count[n] = count.get(n, 0) + 1
    node = pick(rng, [n for n in count if count[n] > 1])
    corners = [
        n for n in count if count[n] > 1 and len({e.group for e in d.elements if n in e.nodes}) > 1
    ]
    if d.family == "frame" and rng.random() < 0.7:
        node = pick(rng, corners)
    element = pick(rng, [e for e in d.elements if node in e.nodes])
    L = float(np.linalg.norm(np.subtract(*(d.nodes[n] for n in element.nodes))))
    k = figures(between(rng, 0.1, 10.0) * 4.0 * d.E * d.section[0] * d.section[1] ** 3 / 12.0 / L)
    touching = [e.id for e in d.elements if node in e.nodes]
    others = [node] if len(touching) == 2 else []
    accept = {"elements": touching if others else [element.id]}
    near = neighbours(d, touching)
    return Finding(
        {"physics": word, "node": node, "elements": [element.id], "k": k},
        place([node], [element.id], dof="ry"),
        (("k", k, 0.3),),
        accept,
        (
            {
                "physics": "stiffness_change",
                "location": place((), near if len(touching) == 2 else [element.id]),
            },
        ),
    )


def _shear(rng: Generator, scene: Scene, word: str) -> Finding:
    ids = [e.id for e in scene.design.elements]
    groups = sorted({e.group for e in scene.design.elements})
    return Finding(
        {"physics": word, "elements": ids}, place((), ids, groups), (), {"groups": groups}
    )


def _preload(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    ids = [e.id for e in d.elements]
    groups = sorted({e.group for e in d.elements})
    L = max(x[0] for x in d.nodes.values())
    euler = np.pi**2 * d.E * d.section[0] * d.section[1] ** 3 / 12.0 / L**2
    N = figures(between(rng, 0.02, 0.6) * (1.0 if rng.random() < 0.6 else -1.0) * euler)
    return Finding(
        {"physics": word, "elements": ids, "N": N},
        place((), ids, groups),
        (("N", N, 0.2),),
        {"groups": groups},
    )


def _resonator(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    node, dof = pick(rng, scene.free())
    low = 0.5 * scene.f[0]
    f = between(rng, low, 0.9 * scene.top)
    m = between(rng, 0.002, 0.06) * mass_of(d)
    zeta = rng.uniform(0.005, 0.04)
    k = m * (2.0 * np.pi * f) ** 2
    c = 2.0 * zeta * m * 2.0 * np.pi * f
    m, k, c = figures(m), figures(k), figures(c)
    near = sorted(
        {n for e in d.elements if node in e.nodes for n in e.nodes if d.family != "chain"} | {node}
    )
    effect = {"physics": word, "node": node, "dof": dof, "m": m, "k": k, "c": c}
    return Finding(
        effect, place([node], dof=dof), (("m", m, 0.25), ("k", k, 0.25)), {"nodes": near}
    )


def _damper(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    c = figures(between(rng, 0.2, 10.0) * d.eta * 2.0 * np.pi * scene.f[0] * mass_of(d) / 4.0)
    springs = [e for e in d.elements if e.kind == "spring" and len(e.nodes) == 2]
    if springs and rng.random() < 0.6:
        e = pick(rng, springs)
        return Finding(
            {"physics": word, "nodes": list(e.nodes), "dof": "x", "c": c},
            place(e.nodes, dof="x"),
            (("c", c, 0.25),),
            {},
            ({"physics": "structural_damping", "location": place((), [e.id], [e.group])},),
        )
    node, dof = pick(rng, scene.free())
    own = next((e for e in d.elements if e.kind == "spring" and e.nodes == (node,)), None)
    equivalent = (
        ()
        if own is None
        else ({"physics": "structural_damping", "location": place((), [own.id], [own.group])},)
    )
    return Finding(
        {"physics": word, "nodes": [node], "dof": dof, "c": c},
        place([node], dof=dof),
        (("c", c, 0.25),),
        {},
        equivalent,
    )


def _structural(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    group = pick(rng, sorted({e.group for e in d.elements if e.kind in ("spring", "bar")}))
    members = [e for e in d.elements if e.group == group]
    ids = [e.id for e in members]
    eta = figures(between(rng, 0.3, 12.0) * d.eta)
    equivalent = ()
    if members[0].kind == "spring":
        equivalent = ({"physics": "viscous_damper", "location": place(members[0].nodes, dof="x")},)
    return Finding(
        {"physics": word, "elements": ids, "eta": eta},
        place((), ids, [group]),
        (("eta", eta, 0.3),),
        {},
        equivalent,
    )


def _proportional(rng: Generator, scene: Scene, word: str) -> Finding:
    alpha = figures(between(rng, 0.3, 10.0) * scene.design.eta * 2.0 * np.pi * scene.f[0])
    return Finding({"physics": word, "alpha": alpha}, place(), (("alpha", alpha, 0.25),), {})


def _fault(rng: Generator, scene: Scene, word: str) -> Finding:
    node, dof = pick(rng, scene.sensors)
    how = rng.random()
    if how < 0.35:
        delay = figures(between(rng, 0.01, 0.3) / scene.top)
        return Finding(
            {"physics": word, "node": node, "dof": dof, "delay": delay},
            place([node], dof=dof),
            (("delay", delay, 0.25),),
            {},
        )
    if how > 0.85 and len(scene.sensors) > 2:
        other = pick(rng, [x for x in scene.sensors if x != (node, dof)])
        effect = {"physics": word, "node": node, "dof": dof, "other": other}
        return Finding(
            effect, place(sorted({node, other[0]}), dof=dof if dof == other[1] else None), (), {}
        )
    gain = figures(-rng.uniform(0.7, 1.3)) if how < 0.6 else _change(rng, 0.03, 0.6, 0.4)
    return Finding(
        {"physics": word, "node": node, "dof": dof, "gain": gain},
        place([node], dof=dof),
        (("gain", gain, 0.1),),
        {},
    )


def _orthotropy(rng: Generator, scene: Scene, word: str) -> Finding:
    ids = [e.id for e in scene.design.elements]
    Dx = figures(1.0 + between(rng, 0.05, 1.0))
    Dy, Dxy = figures(rng.uniform(0.8, 1.1)), figures(rng.uniform(0.8, 1.2))
    if rng.random() < 0.5:
        Dx, Dy = Dy, Dx
    groups = sorted({e.group for e in scene.design.elements})
    effect = {"physics": word, "elements": ids, "Dx": Dx, "Dy": Dy, "D1": 1.0, "Dxy": Dxy}
    return Finding(
        effect, place((), ids, groups), (("Dx", Dx, 0.15), ("Dy", Dy, 0.15)), {"groups": groups}
    )


def _spin(rng: Generator, scene: Scene, word: str) -> Finding:
    d = scene.design
    omega = figures(
        between(rng, 0.05, 3.0) * 2.0 * np.pi * scene.f[0] * (1.0 if rng.random() < 0.5 else -1.0)
    )
    shaft, disc = ([e.id for e in d.elements if e.kind == kind] for kind in ("shaft", "mass"))
    return Finding(
        {"physics": word, "elements": shaft + disc, "omega": omega},
        place((), shaft, ["shaft"]),
        (("omega", omega, 0.2),),
        {"groups": ["shaft"]},
    )


MAKERS: dict[str, Callable[[Generator, Scene, str], Finding]] = {
    "stiffness_change": _factor,
    "mass_change": _factor,
    "thickness_change": _factor,
    "orthotropy": _orthotropy,
    "added_mass": _added_mass,
    "grounding_spring": _grounding,
    "soft_support": _soft_support,
    "joint_flexibility": _joint,
    "shear_deformation": _shear,
    "axial_preload": _preload,
    "attached_resonator": _resonator,
    "viscous_damper": _damper,
    "structural_damping": _structural,
    "mass_proportional_damping": _proportional,
    "sensor_fault": _fault,
    "gyroscopic": _spin,
}
