"""Cases with a reference state."""

from __future__ import annotations

from validation.fifteenth import parts as p
from validation.fifteenth.shapes import ALU, DOFS, Case, Effect, Member, Section, Structure

E = Effect
BOX40 = Section("box", 0.04, 0.04, 0.003)


def r01() -> Case:
    """Portal, a damper added."""
    s = p.portal(1.3, 1.1, BOX40, Section("box", 0.05, 0.05, 0.003))
    rig = p.feet(s, {"ry": 3.8e5}, "feet turn")
    sensors = [
        ("col00", 3, "x"),
        ("col00", 6, "x"),
        ("beam00", 2, "z"),
        ("beam00", 4, "z"),
        ("beam00", 6, "z"),
        ("col10", 6, "x"),
        ("col10", 3, "x"),
    ]
    hid = [
        E(
            "dashpot",
            ("beam00", 0.63),
            {"dof": "z", "c": 140.0},
            "something rubs viscously on the beam",
        )
    ]
    return Case(
        "r01_portal",
        "frf",
        "Portal frame, before and after",
        "feet turn; 20 g accelerometers",
        s,
        sensors,
        [("col00", 3, "x")],
        rig,
        hid,
        1531,
        5,
        holdout=("beam00", 2, "z"),
        sensor_mass=0.02,
        reference=True,
    )


def _bracket() -> Structure:
    s = Structure(
        points={"foot": (0, 0, 0), "knee": (0, 0, 0.9), "tip": (0.6, 0, 0.9)}, dofs=p.PLANE
    )
    s.members = [
        Member("post", "foot", "knee", Section("rect", 0.05, 0.025), 6, "post"),
        Member("arm", "knee", "tip", Section("rect", 0.05, 0.02), 5, "arm"),
    ]
    s.held["foot"] = DOFS
    return s


def r02() -> Case:
    """Bracket, nothing changed."""
    s = _bracket()
    rig = p.feet(s, {"ry": 2.4e5}, "clamp turns") + p.joints(s, 1.5e5, ("arm",), "knee bolted")
    rig = [e for e in rig if e.at != ("arm", "b")]
    sensors = [
        ("post", 2, "x"),
        ("post", 4, "x"),
        ("post", 6, "x"),
        ("arm", 2, "z"),
        ("arm", 4, "z"),
        ("arm", 5, "z"),
    ]
    return Case(
        "r02_bracket",
        "frf",
        "Bracket of flat bar, before and after transport",
        "clamp and knee give; 15 g sensors",
        s,
        sensors,
        [("post", 4, "x")],
        rig,
        [],
        1532,
        5,
        holdout=("arm", 4, "z"),
        sensor_mass=0.015,
        reference=True,
    )


def r03() -> Case:
    """Ladder, a rung's joint works loose."""
    s = p.ladder(
        1.2, 0.35, 4, Section("box", 0.03, 0.03, 0.002), Section("box", 0.03, 0.02, 0.002), 3, ALU
    )
    rig = p.cords([("rail00", 0.4), ("rail02", 0.6), ("rail10", 0.4), ("rail12", 0.6)], 300.0)
    rig += p.cords([("rail00", 0.4), ("rail12", 0.6)], 150.0, ("x", "y"))
    sensors = [
        (f"rail{k}{i}", j, d)
        for k in (0, 1)
        for i, j in ((0, 0), (1, 0), (2, 0), (2, 3))
        for d in "z"
    ]
    sensors += [("rung1", 1, "z"), ("rung2", 1, "z")]
    hid = [
        E(
            "joint",
            ("rung1", "a"),
            {"kr": 700.0, "twist": True},
            "this end of the rung has worked loose",
        )
    ]
    return Case(
        "r03_ladder",
        "frf",
        "Aluminium ladder on cords, before and after a fall",
        "cords; 8 g accelerometers",
        s,
        sensors,
        [("rail00", 0, "z"), ("rail12", 3, "z")],
        rig,
        hid,
        1533,
        8,
        holdout=("rail11", 0, "z"),
        sensor_mass=0.008,
        reference=True,
    )


def r04() -> Case:
    """Table, a leg weakened."""
    s = p.table(0.8, 0.6, 0.8, BOX40, BOX40, 4)
    rig = p.feet(s, {"rx": 2e5, "ry": 2e5}, "feet turn") + p.joints(s, 2e5, ("rails",))
    sensors = [(f"leg{i}0", 4, d) for i in range(4) for d in ("x", "y")] + [
        (f"leg{i}0", 2, d) for i in range(4) for d in ("x", "y")
    ][:4]
    hid = [E("member", "leg20", {"stiffness": 0.6}, "this leg has lost stiffness")]
    return Case(
        "r04_table",
        "modes",
        "Table frame, before and after overload",
        "feet and joints give; 10 g accelerometers",
        s,
        sensors,
        [],
        rig,
        hid,
        1534,
        7,
        sensor_mass=0.01,
        reference=True,
        f_scatter=0.0015,
    )


def r05() -> Case:
    """Two-storey space frame, nothing changed."""
    s = p.table(
        0.7,
        0.5,
        0.5,
        Section("box", 0.03, 0.03, 0.0026),
        Section("box", 0.03, 0.03, 0.0026),
        3,
        storeys=2,
    )
    rig = p.feet(s, {"rx": 2e5, "ry": 2e5}, "feet turn")
    sensors = [(f"leg{i}{j}", 3, d) for i in (0, 2) for j in (0, 1) for d in ("x", "y")]
    sensors += [("leg11", 3, "x"), ("leg31", 3, "y")]
    return Case(
        "r05_tower",
        "modes",
        "Two-storey space frame, in spring and in autumn",
        "feet turn; 10 g accelerometers",
        s,
        sensors,
        [],
        rig,
        [],
        1535,
        7,
        sensor_mass=0.01,
        reference=True,
        f_scatter=0.002,
    )


def r06() -> Case:
    """Beam on three stands, a prop set under it."""
    s = p.line([0.0, 1.3, 2.4], [Section("box", 0.04, 0.05, 0.003)] * 2, [7, 6], ["beam"] * 2)
    for i in range(3):
        s.held[f"p{i}"] = ("x", "z") if i == 0 else ("z",)
    rig = [E("foot", f"p{i}", {"z": k}, "stand gives") for i, k in enumerate((3.0e7, 2.6e7, 3.4e7))]
    hid = [
        E(
            "prop",
            ("bar0", 0.6),
            {"dof": "z", "k": 2.5e5},
            "a cable tray touches the beam like a spring",
        )
    ]
    sensors = [
        ("bar0", 1, "z"),
        ("bar0", 3, "z"),
        ("bar0", 5, "z"),
        ("bar1", 1, "z"),
        ("bar1", 3, "z"),
        ("bar1", 5, "z"),
    ]
    return Case(
        "r06_beam",
        "modes",
        "Beam on three stands, before and after fitting out",
        "stands give; 20 g accelerometers",
        s,
        sensors,
        [],
        rig,
        hid,
        1536,
        5,
        sensor_mass=0.02,
        reference=True,
        f_scatter=0.0015,
    )


def ref_cases() -> list[Case]:
    """The six."""
    return [r01(), r02(), r03(), r04(), r05(), r06()]
