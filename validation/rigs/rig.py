"""The rig that the model lacks: fixture, clamp, cords, sensors' mass, joints, shaker, force
channel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from validation.rigs.drawing import Drawing, Generator
from validation.rigs.effects import Truth, also, base_words, bending, near, place, turns
from validation.rigs.families import between, figures

TOLERANCE = 0.25  # of a rig's numbers: nobody asks for them


@dataclass(frozen=True)
class Setting:
    """How a structure is tested."""

    drawing: Drawing
    first: float  # Hz, of the bare structure
    sensors: tuple[tuple[int, str], ...]
    drive: tuple[int, str]
    frf: bool
    shaker: bool


def draw(rng: Generator, s: Setting) -> list[Truth]:
    """Two to four parts of a rig, those first that such a structure cannot be without."""
    d = s.drawing
    out: list[Truth] = []
    if d.free:
        out.append(cords(rng, s))
    elif d.family == "chain":
        out.append(base_mass(rng, s))
    elif d.family == "plate" and not (d.plate is not None and d.plate.edge):
        out.append(points(rng, s))
    else:
        out.append(fixture(rng, s) if rng.random() < 0.55 else clamp(rng, s))
    choices = [sensor_mass]
    if d.joints:
        choices.append(joints)
    if s.shaker:
        choices.append(stinger)
    if s.frf:
        choices.append(force_gain)
        if not s.shaker:
            choices.append(window)
    more = min(len(choices), int(rng.integers(1, 4)))
    for k in sorted(rng.choice(len(choices), more, replace=False).tolist()):
        out.append(choices[k](rng, s))
    return out


def cords(rng: Generator, s: Setting) -> Truth:
    """Two or four equal cords; the body bounces on them at 3 to 25 % of the first frequency."""
    d = s.drawing
    if d.plate is not None:
        p = d.plate
        nodes = [p.node(i, j) for j in (0, p.ny) for i in (0, p.nx)]
    else:
        n = len(d.nodes)
        nodes = [1 + n // 5, n - n // 5]
    w = 2.0 * np.pi * s.first * between(rng, 0.03, 0.25)
    k = figures(d.mass() * w**2 / len(nodes))
    return Truth(
        "grounding_spring",
        place(nodes, dof="z"),
        (("k", k, TOLERANCE * k),),
        tuple({"do": "ground", "node": n, "dof": "z", "k": k} for n in nodes),
        near(d, nodes),
        (also("flexible_support", place(nodes)),),
    )


def fixture(rng: Generator, s: Setting) -> Truth:
    """A fixture under every foot: it has a mass, moves on its springs and rocks; it resonates at
    0.8 to 8 times the first frequency, alone."""
    d = s.drawing
    feet = list(d.feet)
    each = 1 if d.plate is not None else len(feet)
    m = figures(d.mass() * between(rng, 0.3, 5.0) / each)
    span = float(np.max(np.ptp(np.array(list(d.nodes.values())), axis=0)))
    J = figures(m * (between(rng, 0.05, 0.25) * span) ** 2)
    loaded = m + d.mass() / each  # so that the structure on it moves, rather than the fixture alone
    k = figures(loaded * (2.0 * np.pi * s.first * between(rng, 1.5, 12.0)) ** 2)
    rocking = (J + d.mass() / each * span**2 / 3.0) * (2.0 * np.pi * s.first) ** 2
    kr = figures(rocking * between(rng, 3.0, 60.0))
    return Truth(
        "flexible_support",
        place(feet),
        (("k", k, TOLERANCE * k), ("kr", kr, TOLERANCE * kr), ("m", m, TOLERANCE * m)),
        ({"do": "fixture", "nodes": feet, "m": m, "J": J, "k": k, "kr": kr},),
        near(d, feet),
        (
            also("grounding_spring", place(feet)),
            also("joint_flexibility", place(feet, d.touching(feet))),
            also("attached_resonator", place(feet), "part"),
            also("added_mass", place(feet), "part"),
            also("stiffness_change", place((), d.touching(feet)), "part"),
        ),
    )


def clamp(rng: Generator, s: Setting) -> Truth:
    """Every foot turns a little, all with one k; a plate's edge turns along its length."""
    d = s.drawing
    feet = list(d.feet)
    if d.plate is not None:
        p = d.plate
        D = d.E * p.h**3 / 12.0 / (1.0 - d.nu**2)
        k = figures(D / p.a * between(rng, 4.0, 60.0))
        each = figures(k * p.b / p.ny)
        return Truth(
            "grounding_spring",
            place(feet, dof="ry"),
            (("k", each, TOLERANCE * each),),
            ({"do": "edge", "k": k},),
            near(d, feet),
            base_words(d, feet, "ry"),
        )
    EI, length = bending(d, d.touching(feet[:1])[0])
    k = figures(EI / length * between(rng, 4.0, 60.0))
    bends = [x for x in turns(d) if not (d.family == "space frame" and x == "rz")]
    return Truth(
        "grounding_spring",
        place(feet, dof=bends[0] if len(bends) == 1 else None),
        (("k", k, TOLERANCE * k),),
        tuple({"do": "ground", "node": n, "dof": x, "k": k} for n in feet for x in bends),
        near(d, feet),
        base_words(d, feet, None),
    )


def points(rng: Generator, s: Setting) -> Truth:
    """Point supports that are springs, all alike."""
    d = s.drawing
    feet = list(d.feet)
    k = figures(d.mass() / len(feet) * (2.0 * np.pi * s.first * between(rng, 3.0, 12.0)) ** 2)
    return Truth(
        "grounding_spring",
        place(feet, dof="z"),
        (("k", k, TOLERANCE * k),),
        tuple({"do": "ground", "node": n, "dof": "z", "k": k} for n in feet),
        near(d, feet),
        base_words(d, feet, "z"),
    )


def base_mass(rng: Generator, s: Setting) -> Truth:
    """The springs to ground of a chain stand on something soft: their stiffness is in series."""
    d = s.drawing
    own = [x for x in d.springs if len(x.nodes) == 1]
    factor = figures(rng.uniform(0.45, 0.9))
    ids, nodes = [x.id for x in own], [x.nodes[0] for x in own]
    return Truth(
        "stiffness_change",
        place((), ids, [x.group for x in own]),
        (("factor", factor, TOLERANCE * factor),),
        ({"do": "factor", "elements": ids, "fk": factor, "fm": 1.0},),
        {"nodes": [], "elements": []},
        (
            also("flexible_support", place(nodes)),
            also("joint_flexibility", place(nodes, ids)),
            also("grounding_spring", place(nodes, dof="x"), "part"),
        ),
        ("missing_physics", "parameter_error"),
    )


def sensor_mass(rng: Generator, s: Setting) -> Truth:
    """Every accelerometer weighs the same; all together 1 to 10 % of the structure."""
    d = s.drawing
    nodes = sorted({n for n, _ in s.sensors})
    m = figures(d.mass() * between(rng, 0.01, 0.1) / len(s.sensors))
    ops = tuple({"do": "mass", "node": n, "m": m} for n, _ in s.sensors)
    return Truth(
        "sensor_mass",
        place(),
        (("m", m, TOLERANCE * m),),
        ops,
        {"nodes": [], "elements": []},
        (
            also("added_mass", place(nodes), "part"),
            also("mass_change", place((), [e for g in d.groups().values() for e in g]), "part"),
        ),
    )


def joints(rng: Generator, s: Setting) -> Truth:
    """Every joint is equally soft: one k for the class."""
    d = s.drawing
    EI, length = bending(d, d.joints[0][1])
    k = figures(EI / length * between(rng, 5.0, 80.0))
    corners = sorted({n for n, _ in d.joints})
    ends = sorted({e for _, e in d.joints})
    return Truth(
        "joint_flexibility",
        place(corners, ends),
        (("k", k, TOLERANCE * k),),
        tuple({"do": "release", "node": n, "element": e, "k": k} for n, e in d.joints),
        near(d, corners),
        (also("stiffness_change", place((), d.touching(corners)), "part"),),
    )


def stinger(rng: Generator, s: Setting) -> Truth:
    """A shaker's armature and stinger on the driven node: mass and stiffness."""
    d = s.drawing
    node, dof = s.drive
    m = figures(d.mass() * between(rng, 0.004, 0.03))
    k = figures(d.mass() * (2.0 * np.pi * s.first * between(rng, 0.05, 0.5)) ** 2)
    ops = ({"do": "mass", "node": node, "m": m}, {"do": "ground", "node": node, "dof": dof, "k": k})
    return Truth(
        "added_mass",
        place([node]),
        (("m", m, TOLERANCE * m),),
        ops,
        near(d, [node]),
        (
            also("grounding_spring", place([node], dof=dof)),
            also("attached_resonator", place([node])),
            also("flexible_support", place([node])),
        ),
    )


def force_gain(rng: Generator, s: Setting) -> Truth:
    """The force channel reads 80 to 95 % of the force."""
    gain = figures(rng.uniform(0.8, 0.95))
    node, dof = s.drive
    return Truth(
        "sensor_fault",
        place([node], dof=dof),
        (("gain", gain, 0.03),),
        (),
        {"nodes": [], "elements": []},
        gain=gain,
    )


def window(rng: Generator, s: Setting) -> Truth:
    """The exponential window of a hammer test: one more decay rate on every mode."""
    alpha = figures(2.0 * 2.0 * np.pi * s.first * between(rng, 0.002, 0.02))
    return Truth(
        "mass_proportional_damping",
        place(),
        (("alpha", alpha, TOLERANCE * alpha),),
        (),
        {"nodes": [], "elements": []},
        alpha=alpha,
    )
