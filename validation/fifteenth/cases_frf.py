"""Cases with frequency responses."""

from __future__ import annotations

from validation.fifteenth import parts as p
from validation.fifteenth.cases_frf2 import f07, f08, f09, f10
from validation.fifteenth.shapes import ALU, Case, Effect, Plate, Section, Structure

E = Effect
BOX40 = Section("box", 0.04, 0.04, 0.003)
BOX60 = Section("box", 0.06, 0.06, 0.003)


def f01() -> Case:
    """Portal, lump."""
    s = p.portal(1.4, 1.0, BOX40, BOX60)
    rig = p.feet(s, {"ry": 4.2e5}, "clamp of the foot turns")
    sensors = [
        ("col00", 2, "x"),
        ("col00", 4, "x"),
        ("beam00", 0, "x"),
        ("beam00", 2, "z"),
        ("beam00", 4, "z"),
        ("beam00", 6, "z"),
        ("col10", 4, "x"),
        ("col10", 2, "x"),
    ]
    hid = [E("lump", ("beam00", 0.36), {"m": 1.1, "size": 0.07}, "a lump clamped on the beam")]
    return Case(
        "f01_portal",
        "frf",
        "Portal frame of square tube",
        "feet turn in their clamps; 25 g accelerometers",
        s,
        sensors,
        [("beam00", 2, "z")],
        rig,
        hid,
        1501,
        5,
        holdout=("col00", 4, "x"),
        sensor_mass=0.025,
    )


def f02() -> Case:
    """Table frame, one joint nearly loose."""
    s = p.table(0.9, 0.6, 0.7, BOX40, Section("box", 0.05, 0.03, 0.002))
    rig = p.feet(s, {"rx": 2.4e5, "ry": 2.4e5}, "bolted foot turns") + p.joints(
        s, 1.6e5, ("rails",)
    )
    sensors = [(f"leg{i}0", 4, d) for i in range(4) for d in ("x", "y")]
    sensors += [("rail01", 2, "z"), ("rail11", 2, "z"), ("rail21", 2, "z"), ("rail31", 2, "z")]
    hid = [E("joint", ("rail11", "b"), {"kr": 1.2e3}, "the bolts of this end are nearly loose")]
    return Case(
        "f02_table",
        "frf",
        "Table frame of tube, bolted rails",
        "feet turn a little; all bolted joints give alike",
        s,
        sensors,
        [("leg00", 4, "x"), ("rail11", 2, "z")],
        rig,
        hid,
        1502,
        8,
        holdout=("leg20", 4, "y"),
        sensor_mass=0.008,
    )


def f03() -> Case:
    """Mast on a base plate, nothing else."""
    s = p.line(
        [0.0, 0.8, 2.1],
        [Section("tube", 0.06, t=0.003), Section("tube", 0.048, t=0.0026)],
        [5, 8],
        ["lower", "upper"],
        upright=True,
    )
    s.held["p0"] = ("x", "y", "z", "rx", "ry", "rz")
    s.lumps["p2"] = 0.6
    rig = p.feet(
        s,
        {"x": 2.5e7, "z": 8e7, "ry": 5e5, "m": 14.0, "size": 0.3},
        "base plate on an elastic floor",
    )
    sensors = [
        ("bar0", 2, "x"),
        ("bar0", 5, "x"),
        ("bar1", 2, "x"),
        ("bar1", 4, "x"),
        ("bar1", 6, "x"),
        ("bar1", 8, "x"),
    ]
    return Case(
        "f03_mast",
        "frf",
        "Stepped mast of tube with a lamp on top",
        "base plate of 14 kg that rocks; 30 g sensors",
        s,
        sensors,
        [("bar1", 4, "x")],
        rig,
        [],
        1503,
        4,
        holdout=("bar0", 5, "x"),
        sensor_mass=0.03,
    )


def f04() -> Case:
    """Free bar, its middle thinner."""
    sec = Section("rect", 0.05, 0.016)
    s = p.line(
        [0.0, 0.45, 0.8, 1.3], [sec] * 3, [6, 4, 6], ["left", "middle", "right"], material=ALU
    )
    rig = p.cords([("bar0", 0.5), ("bar2", 0.55)], 900.0) + p.cords([("bar0", 0.5)], 300.0, ("x",))
    sensors = [
        ("bar0", 0, "z"),
        ("bar0", 2, "z"),
        ("bar0", 4, "z"),
        ("bar1", 0, "z"),
        ("bar1", 2, "z"),
        ("bar2", 0, "z"),
        ("bar2", 2, "z"),
        ("bar2", 4, "z"),
        ("bar2", 6, "z"),
    ]
    hid = [E("member", "bar1", {"height": 0.87}, "the middle piece is milled thinner")]
    return Case(
        "f04_bar",
        "frf",
        "Aluminium bar on cords",
        "two cords; 12 g accelerometers",
        s,
        sensors,
        [("bar0", 0, "z")],
        rig,
        hid,
        1504,
        6,
        holdout=("bar2", 2, "z"),
        sensor_mass=0.012,
    )


def f05() -> Case:
    """Ladder on cords, a piece of rail weaker."""
    s = p.ladder(
        1.5, 0.32, 4, Section("box", 0.025, 0.04, 0.002), Section("tube", 0.025, t=0.002), 3
    )
    rig = p.cords([("rail00", 0.4), ("rail02", 0.6), ("rail10", 0.4), ("rail12", 0.6)], 700.0)
    rig += p.cords([("rail00", 0.4), ("rail12", 0.6)], 250.0, ("x", "y"))
    sensors = [
        ("rail00", 0, "z"),
        ("rail01", 0, "z"),
        ("rail01", 2, "z"),
        ("rail02", 0, "z"),
        ("rail02", 3, "z"),
        ("rail10", 0, "z"),
        ("rail11", 0, "z"),
        ("rail11", 2, "z"),
        ("rail12", 0, "z"),
        ("rail12", 3, "z"),
        ("rail01", 0, "y"),
        ("rail12", 3, "y"),
    ]
    hid = [
        E(
            "member",
            "rail11",
            {"stiffness": 0.7, "part": (0.33, 1.0)},
            "two thirds of this piece of rail are weak",
        )
    ]
    return Case(
        "f05_ladder",
        "frf",
        "Steel ladder on cords",
        "four cords; 10 g accelerometers; welds good",
        s,
        sensors,
        [("rail00", 0, "z"), ("rail12", 1, "y")],
        rig,
        hid,
        1505,
        8,
        holdout=("rail11", 2, "z"),
        sensor_mass=0.01,
    )


def f06() -> Case:
    """Cantilever plate with an absorber."""
    s = Structure(dofs=("z", "rx", "ry"), plate=Plate(0.42, 0.3, 0.004, 7, 5, ("left",)))
    rig = [E("edge", "left", {"kr": 2.2e4}, "the clamped edge turns (per metre)")]
    sensors = [
        (7, 0, "z"),
        (7, 3, "z"),
        (7, 5, "z"),
        (5, 0, "z"),
        (5, 2, "z"),
        (5, 5, "z"),
        (3, 1, "z"),
        (3, 4, "z"),
        (2, 2, "z"),
    ]
    hid = [
        E(
            "resonator",
            (0.30, 0.235),
            {"dof": "z", "m": 0.05, "k": 0.05 * (2 * 3.14159 * 57.0) ** 2, "c": 0.5},
            "a small tuned absorber sits on the sheet",
        )
    ]
    return Case(
        "f06_sheet",
        "frf",
        "Aluminium sheet clamped at one edge",
        "the clamp gives; 5 g accelerometers",
        s,
        sensors,
        [(6, 1, "z")],
        rig,
        hid,
        1506,
        6,
        holdout=(4, 4, "z"),
        sensor_mass=0.005,
        zeta=0.004,
    )


def frf_cases() -> list[Case]:
    """The ten."""
    return [f01(), f02(), f03(), f04(), f05(), f06(), f07(), f08(), f09(), f10()]
