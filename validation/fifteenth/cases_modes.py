"""Cases with tables of modes."""

from __future__ import annotations

from validation.fifteenth import parts as p
from validation.fifteenth.shapes import (
    ALU,
    BRASS,
    DOFS,
    Case,
    Chain,
    Effect,
    Member,
    Plate,
    Section,
    Structure,
)

E = Effect
BOX40 = Section("box", 0.04, 0.04, 0.003)


def m01() -> Case:
    """Two bays, nothing hidden."""
    s = p.portal(1.2, 0.9, BOX40, Section("box", 0.04, 0.05, 0.003), 5, 6, bays=2)
    rig = p.feet(s, {"ry": 3.0e5}, "feet turn")
    sensors = [(f"col{i}0", j, "x") for i in range(3) for j in (3, 5)] + [
        (f"beam{i}0", j, "z") for i in (0, 1) for j in (2, 3, 4)
    ]
    return Case(
        "m01_bays",
        "modes",
        "Portal of two bays",
        "feet turn in their clamps; 20 g accelerometers",
        s,
        sensors,
        [],
        rig,
        [],
        1521,
        7,
        sensor_mass=0.02,
        f_scatter=0.0015,
    )


def m02() -> Case:
    """Table with a lump."""
    s = p.table(1.0, 0.7, 0.75, BOX40, Section("box", 0.04, 0.04, 0.002), 4)
    rig = p.feet(s, {"rx": 5e5, "ry": 5e5}, "feet turn")
    sensors = [(f"leg{i}0", 4, d) for i in range(4) for d in ("x", "y")] + [
        (f"rail{i}1", 2, "z") for i in range(4)
    ]
    hid = [
        E(
            "lump",
            ("rail21", 0.46),
            {"m": 0.7, "size": 0.06, "offset": (0.0, 0.0, 0.03)},
            "a lump on a rail",
        )
    ]
    return Case(
        "m02_table",
        "modes",
        "Welded table frame",
        "feet turn; 10 g accelerometers",
        s,
        sensors,
        [],
        rig,
        hid,
        1522,
        8,
        sensor_mass=0.01,
        f_scatter=0.002,
    )


def m03() -> Case:
    """Free plate, a corner thinner."""
    s = Structure(dofs=("z", "rx", "ry"), plate=Plate(0.5, 0.36, 0.006, 8, 6, (), ALU))
    rig = [
        E("cord", at, {"k": 400.0, "dof": "z"}, "cord")
        for at in ((0.06, 0.05), (0.06, 0.31), (0.44, 0.18))
    ]
    sensors = [(i, j, "z") for i in (0, 4, 8) for j in (0, 3, 6)] + [
        (2, 2, "z"),
        (6, 4, "z"),
        (2, 5, "z"),
        (6, 1, "z"),
    ]
    hid = [
        E(
            "patch",
            (0.25, 0.44, 0.17, 0.36),
            {"height": 0.8},
            "a part of the sheet is milled thinner",
        )
    ]
    return Case(
        "m03_plate",
        "modes",
        "Free aluminium plate",
        "three cords; 6 g accelerometers",
        s,
        sensors,
        [],
        rig,
        hid,
        1523,
        8,
        sensor_mass=0.006,
        f_scatter=0.0015,
        zeta=0.003,
    )


def m04() -> Case:
    """Bracket in space, its corner nearly loose."""
    s = Structure(
        points={
            "foot": (0, 0, 0),
            "knee": (0, 0, 0.8),
            "tip": (0.7, 0, 0.8),
            "side": (0.7, 0.4, 0.8),
        }
    )
    tube = Section("tube", 0.05, t=0.003)
    s.members = [
        Member("post", "foot", "knee", tube, 6, "post"),
        Member("arm", "knee", "tip", tube, 6, "arm"),
        Member("spur", "tip", "side", tube, 4, "spur"),
    ]
    s.held["foot"] = DOFS
    rig = p.feet(s, {"rx": 2.5e5, "ry": 2.5e5, "rz": 4e5}, "clamp turns")
    hid = [
        E("joint", ("arm", "a"), {"kr": 6.0e4}, "the clamp of the arm on the post has slackened")
    ]
    sensors = [
        ("post", 3, "x"),
        ("post", 3, "y"),
        ("post", 6, "x"),
        ("post", 6, "y"),
        ("arm", 3, "z"),
        ("arm", 3, "y"),
        ("arm", 6, "z"),
        ("arm", 6, "y"),
        ("spur", 4, "x"),
        ("spur", 4, "z"),
        ("spur", 2, "z"),
    ]
    return Case(
        "m04_bracket",
        "modes",
        "Bracket of tube: post, arm, spur",
        "clamp turns; 12 g accelerometers",
        s,
        sensors,
        [],
        rig,
        hid,
        1524,
        7,
        sensor_mass=0.012,
        f_scatter=0.002,
    )


def m05() -> Case:
    """Chain of carts, one spring weak."""
    s = Structure(
        dofs=("x",),
        chain=Chain(
            [3.0, 2.2, 2.2, 2.2, 2.2, 3.0], [6.0e4, 4.0e4, 4.0e4, 4.0e4, 4.0e4, 4.0e4], 0.06
        ),
    )
    rig = [
        E("spring", 1, {"stiffness": 0.93}, "the wall gives"),
        E("spring", 5, {"stiffness": 1.015}, "spring off"),
        E("spring", 2, {"stiffness": 0.985}, "spring off"),
    ]
    hid = [E("spring", 4, {"stiffness": 0.6}, "a leaf of this spring is cracked")]
    return Case(
        "m05_carts",
        "modes",
        "Six carts on springs",
        "wall gives, springs weigh 60 g; 30 g accelerometers",
        s,
        [(i, 0, "x") for i in range(1, 7)],
        [],
        rig,
        hid,
        1525,
        6,
        sensor_mass=0.03,
        f_scatter=0.002,
    )


def m06() -> Case:
    """Ladder held at one end, nothing hidden."""
    s = p.ladder(1.35, 0.3, 4, Section("box", 0.03, 0.03, 0.0026), Section("rect", 0.03, 0.012), 3)
    s.held = {"p00": DOFS, "p10": DOFS}
    s.members = [m for m in s.members if m.name != "rung0"]
    rig = p.feet(s, {"rx": 6e4, "ry": 6e4, "rz": 6e4}, "clamp turns") + p.joints(
        s, 1.5e5, ("rungs",)
    )
    sensors = [(f"rail{k}{i}", 3, d) for k in (0, 1) for i in range(3) for d in ("z", "y")]
    return Case(
        "m06_ladder",
        "modes",
        "Ladder standing out from a wall, rungs bolted",
        "clamps turn, bolted rungs give alike; 15 g accelerometers",
        s,
        sensors,
        [],
        rig,
        [],
        1526,
        7,
        sensor_mass=0.015,
        f_scatter=0.002,
    )


def m07() -> Case:
    """Bar with three carried masses, one of them lighter."""
    sec = Section("rect", 0.04, 0.02)
    s = p.line([0.0, 0.3, 0.75, 1.05, 1.4], [sec] * 4, [4, 6, 4, 4], ["bar"] * 4, material=BRASS)
    s.lumps = {"p1": 1.2, "p2": 1.2, "p3": 1.2}
    rig = p.cords([("bar0", 0.7), ("bar3", 0.3)], 1200.0) + p.cords([("bar0", 0.7)], 300.0, ("x",))
    sensors = [
        ("bar0", 0, "z"),
        ("bar0", 2, "z"),
        ("bar1", 0, "z"),
        ("bar1", 2, "z"),
        ("bar1", 4, "z"),
        ("bar2", 0, "z"),
        ("bar2", 2, "z"),
        ("bar3", 0, "z"),
        ("bar3", 4, "z"),
    ]
    hid = [
        E(
            "lump",
            "p3",
            {"m": -0.7, "size": (1.2 / 7850) ** (1 / 3)},
            "half of the carried block is missing",
        )
    ]
    return Case(
        "m07_blocks",
        "modes",
        "Brass bar with three blocks, on cords",
        "two cords; 15 g accelerometers",
        s,
        sensors,
        [],
        rig,
        hid,
        1527,
        6,
        sensor_mass=0.015,
        f_scatter=0.001,
    )


def m08() -> Case:
    """Three storeys in space, nothing hidden."""
    s = p.table(
        0.5,
        0.4,
        0.4,
        Section("box", 0.025, 0.025, 0.002),
        Section("rect", 0.02, 0.03),
        3,
        storeys=3,
    )
    rig = p.feet(
        s,
        {"x": 4e7, "y": 4e7, "z": 2e7, "rx": 7e4, "ry": 7e4, "m": 3.0, "size": 0.15},
        "base plate on pads",
    )
    sensors = [(f"leg{i}{j}", 3, d) for i in (0, 2) for j in range(3) for d in ("x", "y")]
    return Case(
        "m08_storeys",
        "modes",
        "Three-storey space frame on a base plate",
        "base plate 12 kg on pads; 10 g accelerometers",
        s,
        sensors,
        [],
        rig,
        [],
        1528,
        7,
        sensor_mass=0.01,
        f_scatter=0.002,
    )


def modes_cases() -> list[Case]:
    """The eight."""
    return [m01(), m02(), m03(), m04(), m05(), m06(), m07(), m08()]
