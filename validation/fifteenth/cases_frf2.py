"""More cases with frequency responses."""

from __future__ import annotations

from validation.fifteenth import parts as p
from validation.fifteenth.shapes import DOFS, Case, Effect, Section

E = Effect
BOX40 = Section("box", 0.04, 0.04, 0.003)


def f07() -> Case:
    """Two storeys, joints all alike, low force channel, nothing else."""
    s = p.portal(1.1, 0.75, BOX40, Section("box", 0.05, 0.05, 0.003), 5, 6, storeys=2)
    rig = p.feet(s, {"ry": 5e5}, "feet turn") + p.joints(s, 2.2e5, ("beams",))
    sensors = [
        ("col00", 3, "x"),
        ("col00", 5, "x"),
        ("col01", 3, "x"),
        ("col01", 5, "x"),
        ("col10", 5, "x"),
        ("col11", 5, "x"),
        ("beam00", 2, "z"),
        ("beam00", 4, "z"),
        ("beam01", 2, "z"),
        ("beam01", 4, "z"),
    ]
    return Case(
        "f07_storeys",
        "frf",
        "Two-storey frame, beams bolted",
        "feet turn, bolted joints give alike, force channel 12 % low, 15 g accelerometers",
        s,
        sensors,
        [("col01", 5, "x"), ("beam00", 2, "z")],
        rig,
        [],
        1507,
        6,
        holdout=("col00", 3, "x"),
        sensor_mass=0.015,
        force_gain=0.88,
    )


def f08() -> Case:
    """Cantilever with a shaker, propped."""
    s = p.line([0.0, 1.2], [Section("rect", 0.06, 0.025)], [12], ["bar"])
    s.held["p0"] = DOFS
    rig = p.feet(s, {"ry": 3.5e5}, "clamp turns")
    rig += [
        E(
            "shaker",
            ("bar0", 4 / 12),
            {"dof": "z", "m": 0.24, "k": 6.5e3},
            "armature and flexure of the shaker",
        )
    ]
    sensors = [("bar0", i, "z") for i in (2, 4, 6, 7, 9, 10, 12)]
    hid = [E("prop", ("bar0", 0.645), {"dof": "z", "k": 2.8e4}, "something props the bar")]
    return Case(
        "f08_cantilever",
        "frf",
        "Steel cantilever driven by a shaker",
        "clamp turns; the shaker's armature (force from its current) and suspension; "
        "20 g accelerometers; "
        "force reads 6 % low",
        s,
        sensors,
        [("bar0", 4, "z")],
        rig,
        hid,
        1508,
        4,
        sensor_mass=0.02,
        hammer=False,
        averages=40,
        force_gain=0.94,
    )


def f09() -> Case:
    """Beam on four supports, one of them soft."""
    s = p.line(
        [0.0, 1.1, 2.0, 3.2], [Section("box", 0.05, 0.05, 0.003)] * 3, [6, 5, 6], ["beam"] * 3
    )
    for i in range(4):
        s.held[f"p{i}"] = ("x", "z") if i == 0 else ("z",)
    rig = [
        E("foot", f"p{i}", {"z": k}, "stand gives")
        for i, k in enumerate((3.3e7, 3.0e7, 3.2e7, 2.8e7))
        if i != 2
    ]
    hid = [E("foot", "p2", {"z": 6.0e6}, "this stand stands on a shim of rubber")]
    sensors = [
        ("bar0", 2, "z"),
        ("bar0", 4, "z"),
        ("bar1", 1, "z"),
        ("bar1", 3, "z"),
        ("bar2", 1, "z"),
        ("bar2", 3, "z"),
        ("bar2", 5, "z"),
    ]
    return Case(
        "f09_stands",
        "frf",
        "Continuous beam on four stands",
        "stands give a little; 18 g accelerometers",
        s,
        sensors,
        [("bar0", 2, "z")],
        rig,
        hid,
        1509,
        5,
        holdout=("bar2", 3, "z"),
        sensor_mass=0.018,
    )


def f10() -> Case:
    """Two-storey space frame on a base plate, nothing else."""
    s = p.table(
        0.6,
        0.45,
        0.5,
        Section("box", 0.03, 0.03, 0.0026),
        Section("box", 0.03, 0.03, 0.002),
        3,
        storeys=2,
    )
    rig = p.feet(
        s,
        {"x": 6e7, "y": 6e7, "z": 1.2e7, "rx": 2.4e5, "ry": 2.4e5, "m": 4.0, "size": 0.2},
        "base plate on pads, a quarter of its mass at each foot",
    )
    sensors = [(f"leg{i}1", 3, d) for i in range(4) for d in ("x", "y")] + [
        (f"leg{i}0", 3, d) for i in (0, 2) for d in ("x", "y")
    ]
    return Case(
        "f10_tower",
        "frf",
        "Two-storey welded space frame on a base plate",
        "base plate 16 kg on pads; 8 g accelerometers",
        s,
        sensors,
        [("leg01", 3, "x"), ("leg11", 3, "y")],
        rig,
        [],
        1510,
        7,
        holdout=("leg20", 3, "y"),
        sensor_mass=0.008,
    )
