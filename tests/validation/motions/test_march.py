"""The laboratory's march: closed forms, and every law against scipy's Radau."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from validation import motions
from validation.motions.laws import Law
from validation.motions.march import STATIC, Bench, Change, equations, march
from validation.rigs.bench import Structure, build
from validation.rigs.drawing import Drawing, Line, Section
from validation.rigs.response import modal

LAWS = [
    Law("cubic", (4e9,)),
    Law("quadratic", (1e6,)),
    Law("damping", (900.0,)),
    Law("friction", (3.0,), 1e-3),
    Law("gap", (3e4, 8e-4, 1.0)),
    Law("gap", (3e4, 8e-4, -1.0)),
    Law("play", (3e4, 8e-4)),
    Law("jenkins", (3e4, 8.0)),
    Law("bouc_wen", (3e4, 8.0)),
]
RATE = 1600.0


def two_masses(zeta=(0.02, 0.03)):
    K, M = np.array([[9e4, -5e4], [-5e4, 5e4]]), np.diag([3.0, 2.0])
    none = (np.zeros((2, 2)), np.zeros((2, 2)))
    structure = Structure({"all": (K, M)}, none, (), lambda n, _: np.eye(2)[n - 1])
    return modal(structure, {}, np.array(zeta))


def tone(samples=480):
    t = np.arange(samples) / RATE
    return 60.0 * np.sin(2.0 * np.pi * 14.0 * t) * np.minimum(1.0, 8.0 * t)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law.kind}{law.p[-1]:+.0g}")
def test_every_law_agrees_with_radau(law):
    m = two_masses()
    b = np.array([-1.0, 1.0])
    bench = Bench.of(m, 1e3, [])
    drive, force = np.array([0.0, 1.0]), tone()
    found = march(bench, [(law, b)], drive, force, RATE)
    shape = b @ bench.basis
    rhs = equations(bench, [(law, shape)], drive @ bench.basis, force, RATE, None)
    t = np.arange(len(force)) / RATE
    sol = solve_ivp(
        lambda s, y: rhs(y, s),
        (0.0, t[-1]),
        np.zeros(4 + law.remembers),
        "Radau",
        t,
        rtol=1e-7,
        atol=1e-11,
        max_step=2.0 / RATE,
    )
    own = shape @ sol.y[:2]
    assert np.linalg.norm(found.x[:, 0] - own) < 2e-4 * np.linalg.norm(own)
    assert np.max(np.abs(found.force)) > 0.5  # each law is at work
    balance = found.second + found.rate @ bench.damping.T + found.eta * bench.omega**2
    given = np.outer(force, drive @ bench.basis) - found.force * shape
    assert balance == pytest.approx(given, abs=1e-6 * np.max(np.abs(given)))


def test_without_laws_it_is_the_transform():
    bench = Bench.of(two_masses((0.3, 0.3)), 1e3, [])
    drive, force = np.array([1.0, 0.0]), tone(800)
    force[700:] = 0.0
    found = march(bench, [], drive, force, RATE).eta
    exact = bench.linear(drive, force, RATE)
    assert np.linalg.norm(found - exact) < 5e-3 * np.linalg.norm(exact)


def test_what_changes_is_the_stiffness():
    bench = Bench.of(two_masses(), 1e3, [])
    drive, force = np.array([1.0, 0.0]), tone()
    whole = np.diag(bench.omega**2)
    softer = march(bench, [], drive, force, RATE, Change(whole, -0.2, -0.2)).eta
    other = Bench(bench.omega * np.sqrt(0.8), bench.zeta / np.sqrt(0.8), bench.basis, bench.extra)
    direct = march(other, [], drive, force, RATE).eta
    assert np.linalg.norm(softer - direct) < 1e-3 * np.linalg.norm(direct)


def test_modes_above_the_band_follow_statically():
    """At its end a cantilever gives by L³/3EI, whatever the band."""
    section = Section.rectangle(0.04, 0.01)
    nodes = {i + 1: (0.2 * i, 0.0, 0.0) for i in range(7)}
    lines = tuple(Line(i + 1, (i + 1, i + 2), "bar", "bar") for i in range(6))
    d = Drawing(
        "cantilever",
        ("z", "ry"),
        nodes,
        207e9,
        0.3,
        7850.0,
        {"bar": section},
        lines,
        held=((1, "z"), (1, "ry")),
    )
    m = modal(build(d, []), {}, np.array([0.01]))
    tip = m.structure.at(7, "z")
    bench = Bench.of(m, 60.0, [tip])
    assert len(bench.omega) < 6 and bench.zeta[-1] == STATIC
    gives = np.sum((tip @ bench.basis) ** 2 / bench.omega**2)
    assert gives == pytest.approx(1.2**3 / (3.0 * 207e9 * section.Iy), rel=1e-6)


def test_the_laboratory_shares_nothing_with_the_simulation():
    imported = set()
    for path in Path(motions.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {a.name for a in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module or "")
    assert not [name for name in imported if name.startswith("cvxupdate")]
    assert any(name.startswith("scipy") for name in imported)
