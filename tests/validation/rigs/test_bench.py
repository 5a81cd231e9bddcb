"""The laboratory's own physics: closed forms, identities, convergence."""

from __future__ import annotations

import ast
import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from validation import rigs
from validation.rigs import cases, families
from validation.rigs.bench import build
from validation.rigs.drawing import Drawing, Line, Plate, Section
from validation.rigs.plates import Series
from validation.rigs.response import as_before, modal, natural

E, NU, RHO = 207e9, 0.3, 7850.0
SECTION = Section.rectangle(0.04, 0.01)
LENGTH = 1.3


def beam(elements=7, held=((1, "z"), (1, "ry")), section=SECTION):
    nodes = {i + 1: (LENGTH * i / elements, 0.0, 0.0) for i in range(elements + 1)}
    lines = tuple(Line(i + 1, (i + 1, i + 2), "bar", "bar") for i in range(elements))
    return Drawing("cantilever", ("z", "ry"), nodes, E, NU, RHO, {"bar": section}, lines, held=held)


def frequencies(drawing, ops=(), shear=False, rotary=False):
    return natural(*build(drawing, ops, shear, rotary).matrices({}))[0]


def scaled(omega):
    """λ of ω = λ² / L² √(EI/ρA)."""
    return np.sqrt(omega * LENGTH**2 * np.sqrt(RHO * SECTION.A / (E * SECTION.Iy)))


@pytest.mark.parametrize("ratio", [0.02, 0.7, 5.0, 300.0])
def test_cantilever_on_a_foot_that_turns(ratio):
    """1 + cos λ cosh λ = (EI/kL) λ (sin λ cosh λ − cos λ sinh λ), Blevins 1979, table 8-1."""
    k = ratio * E * SECTION.Iy / LENGTH

    def characteristic(x):
        turn = x / ratio * (np.sin(x) - np.cos(x) * np.tanh(x))
        return 1.0 / np.cosh(x) + np.cos(x) - turn

    grid = np.linspace(0.05, 12.0, 4000)
    values = characteristic(grid)
    exact = [
        brentq(characteristic, a, b)
        for a, b, u, v in zip(grid, grid[1:], values, values[1:], strict=False)
        if u * v < 0
    ]
    omega = frequencies(beam(), [{"do": "ground", "node": 1, "dof": "ry", "k": k}])
    assert scaled(omega[: len(exact)]) == pytest.approx(exact, rel=1e-5)


def test_clamped_cantilever_and_free_beam():
    clamped = scaled(frequencies(beam()))[:5]
    assert clamped == pytest.approx([1.875104, 4.694091, 7.854757, 10.995541, 14.137168], rel=1e-5)
    free = scaled(frequencies(beam(held=())))
    assert np.all(free[:2] < 0.05)
    assert free[2:6] == pytest.approx([4.730041, 7.853205, 10.995608, 14.137165], rel=1e-5)


def test_pinned_beam_with_shear_and_rotary_inertia():
    thick = Section.rectangle(0.05, 0.12)
    held = ((1, "z"), (8, "z"))
    k = np.arange(1, 5) * np.pi / LENGTH
    a, inertia, g = thick.A, thick.Iy, 5.0 / 6.0 * E / (2.0 * (1.0 + NU))
    p, q = RHO**2 * inertia / g, RHO * a + RHO * inertia * (1.0 + E / g) * k**2
    exact = np.sqrt((q - np.sqrt(q**2 - 4.0 * p * E * inertia * k**4)) / (2.0 * p))
    omega = frequencies(beam(held=held, section=thick), shear=True, rotary=True)[:4]
    assert omega == pytest.approx(exact, rel=5e-4)
    rotary = np.sqrt(E * inertia * k**4 / (RHO * a + RHO * inertia * k**2))
    found = frequencies(beam(held=held, section=thick), rotary=True)[:4]
    assert found == pytest.approx(rotary, rel=1e-5)


def test_mass_fixture_and_resonator_are_what_they_say():
    """On a bar that is stiff beside them: one degree of freedom each."""
    stiff = beam(section=Section.rectangle(0.2, 0.2))
    own = RHO * 0.04 * LENGTH
    fixture = {"do": "fixture", "nodes": [1], "m": 3.0 * own, "J": 1.0, "k": 1e5, "kr": 1e12}
    assert frequencies(stiff, [fixture])[0] == pytest.approx(np.sqrt(1e5 / (4.0 * own)), rel=1e-3)
    hidden = {"do": "hidden", "node": 8, "dof": "z", "m": 2.0, "k": 800.0, "c": 0.0}
    assert frequencies(stiff, [hidden])[0] == pytest.approx(20.0, rel=1e-4)


@pytest.mark.parametrize("ratio", [1e-4, 0.3, 4.0, 1e5])
@pytest.mark.parametrize("where", ["feet", "corners"])
def test_sway_of_a_portal_by_slope_deflection(ratio, where):
    """Feet or corners that turn, k over decades: Δ for a side load at the corners, members stiff
    along their axes."""
    rng = np.random.default_rng(3)
    drawn = families.portal(rng)
    slim = Section(1e-2, 1e-9, 1e-9, 1e-9, {})
    d = replace(drawn, sections={"column": slim, "beam": slim})
    h, w = d.nodes[3][1], d.nodes[2][0]
    EI = d.E * 1e-9
    k = ratio * EI / h
    if where == "feet":
        ops = [{"do": "ground", "node": n, "dof": "rz", "k": k} for n in (1, 2)]
    else:
        last = [e for n, e in d.joints if n in (3, 4) and d.lines[e - 1].group == "beam"]
        ops = [
            {"do": "release", "node": n, "element": e, "k": k}
            for n, e in zip((3, 4), last, strict=True)
        ]
    s = build(d, ops)
    K, _ = s.matrices({})
    load = s.at(3, "x") + s.at(4, "x")
    delta = s.at(3, "x") @ np.linalg.solve(K, load)
    c, b = 2.0 * EI / h, 6.0 * EI / w
    foot = k if where == "feet" else 1e9 * EI / h
    corner = b if where == "feet" else 1.0 / (1.0 / b + 1.0 / k)
    # foot turn, corner turn, drift: moments at foot and corner vanish, shear carries the load
    A = np.array(
        [
            [2.0 * c + foot, c, -3.0 * c / h],
            [c, 2.0 * c + corner, -3.0 * c / h],
            [-3.0 * c / h, -3.0 * c / h, 6.0 * c / h**2],
        ]
    )
    assert delta == pytest.approx(np.linalg.solve(A, [0.0, 0.0, 1.0])[2], rel=2e-4)


def test_a_strangers_portal_whose_left_foot_turns():
    """Seven natural frequencies of somebody else's beam code (no rotary inertia)."""
    folder = Path(__file__).parents[2] / "strangers" / "portal_exact"

    def rows(name):
        with (folder / name).open(encoding="utf-8") as file:
            return list(csv.DictReader(file))

    nodes = {int(r["id"]): (float(r["x"]), float(r["y"]), 0.0) for r in rows("nodes.csv")}
    ends = [[int(n) for n in r["nodes"].split()] for r in rows("beams.csv")]
    lines = tuple(Line(k + 1, (i, j), "frame", "rhs") for k, (i, j) in enumerate(ends))
    rhs = Section(6.84e-4, 3.7141e-7, 3.7141e-7, 0.0, {})
    held = tuple((n, k) for n in (1, 33) for k in ("x", "y", "rz"))
    d = Drawing(
        "portal", ("x", "y", "rz"), nodes, 210e9, 0.3, 7850.0, {"rhs": rhs}, lines, held=held
    )
    omega = frequencies(d, [{"do": "ground", "node": 1, "dof": "rz", "k": 6e4}])
    measured = [float(r["frequency"]) for r in rows("modes.csv")]
    assert len(measured) == 7
    assert omega[:7] / (2.0 * np.pi) == pytest.approx(measured, rel=1e-5)


def square(edge, h=0.002):
    p = Plate(0.3, 0.3, h, 6, 4, ("plate",) * 6, edge)
    nodes = {p.node(i, j): (0.05 * i, 0.075 * j, 0.0) for j in range(5) for i in range(7)}
    held = tuple((p.node(0, j), k) for j in range(5) for k in ("z", "rx", "ry")) if edge else ()
    return Drawing("plate", ("z", "rx", "ry"), nodes, E, NU, RHO, plate=p, held=held)


CANTILEVER = [3.4917, 8.5246, 21.429, 27.331, 31.111]  # Leissa, NASA SP-160, table 4.50: bounds
FREE = [13.468, 19.596, 24.270, 34.801, 34.801, 61.093]  # Liew, Xiang and Kitipornchai 1993


@pytest.mark.parametrize("thick", [False, True])
@pytest.mark.parametrize(("edge", "exact"), [(True, CANTILEVER), (False, FREE)])
def test_thin_plates_by_leissa(edge, exact, thick):
    d = square(edge, 3e-4)
    D = E * 3e-4**3 / 12.0 / (1.0 - NU**2)
    omega = frequencies(d, shear=thick)[0 if edge else 3 :][: len(exact)]
    factor = omega * 0.3**2 * np.sqrt(RHO * 3e-4 / D)
    assert factor == pytest.approx(exact, rel=7e-3 if edge else 1e-3)
    if edge:  # Leissa's are upper bounds, and the series has more terms than his
        assert np.all(factor < exact)


def test_shear_lowers_a_plate_as_the_square_of_its_thickness():
    drops = []
    for h in (0.004, 0.008):
        d = square(False, h)
        drops.append(1.0 - frequencies(d, shear=True)[3:6] / frequencies(d)[3:6])
    assert np.all(drops[0] > 1e-4)
    assert drops[1] / drops[0] == pytest.approx(4.0, rel=0.25)


def test_parts_of_a_plate_add_up_and_an_edge_turns_between_clamped_and_free():
    series = Series(square(True).plate, False)
    K, M = series.matrices(range(1, 25), E, NU, RHO, True)
    parts = [series.matrices(e, E, NU, RHO, True) for e in (range(1, 9), range(9, 25))]
    assert np.allclose(sum(k for k, _ in parts), K, atol=1e-12 * np.abs(K).max())
    assert np.allclose(sum(m for _, m in parts), M, atol=1e-12 * np.abs(M).max())
    soft = [frequencies(square(True), [{"do": "edge", "k": k}])[0] for k in (1e-3, 1e3, 1e10)]
    assert soft[0] < 0.02 * soft[2]
    assert soft[1] < soft[2]
    assert soft[2] == pytest.approx(frequencies(square(True))[0], rel=1e-4)


def test_responses_with_dashpots_by_direct_solution():
    d = beam()
    ops = [
        {"do": "dashpot", "node": 5, "dof": "z", "c": 9.0},
        {"do": "hidden", "node": 8, "dof": "z", "m": 0.1, "k": 4e3, "c": 3.0},
    ]
    s = build(d, ops)
    m = modal(s, {}, np.array([0.01]))
    K, M = s.matrices({})
    inverse = M @ m.shapes
    C = inverse @ np.diag(0.02 * m.omega) @ inverse.T
    C += sum(c * np.outer(b, b) for b, c in s.dampers)
    f, places = np.array([4.0, 33.0, 90.0]), [(3, "z"), (8, "z")]
    H = m.accelerance(f, places, (5, "z"))
    read = np.array([s.at(*p) for p in places])
    for line, w in zip(H, 2.0 * np.pi * f, strict=True):
        exact = -(w**2) * read @ np.linalg.solve(K + 1j * w * C - w**2 * M, s.at(5, "z"))
        assert line == pytest.approx(exact, rel=1e-6)
    assert m.accelerance(f, [(3, "z")], (8, "z")) == pytest.approx(
        m.accelerance(f, [(8, "z")], (3, "z")), rel=1e-8
    )
    frequency, zeta, shapes = m.damped(places, 200.0)
    for f0, z in zip(frequency, zeta, strict=True):  # poles of the quadratic eigenproblem
        pole = 2.0 * np.pi * f0 * complex(-z, np.sqrt(1.0 - z**2))
        A = K + pole * C + pole**2 * M
        values = np.linalg.svd(A, compute_uv=False)
        assert values[-1] < 1e-6 * values[-2]
    assert shapes.shape == (2, len(frequency))


def test_an_analysts_mesh_is_coarse_and_the_truth_is_converged():
    d = beam(12)
    _, good = cases.sound(d)
    fine, rough = (natural(*build(d, [], coarse=c).matrices({}))[0] for c in (False, True))
    off = np.abs(rough[: good + 1] / fine[: good + 1] - 1.0)
    assert np.all(off[:good] <= cases.MESH) and off[good] > cases.MESH
    finer = natural(*build(beam(24), []).matrices({}))[0]
    assert fine[:8] == pytest.approx(finer[:8], rel=1e-5)


def test_a_mode_that_comes_takes_no_other_ones_damping():
    d = beam()
    zeta = np.array([0.004, 0.009, 0.002, 0.006])
    bare = modal(build(d, (), False, False), {}, zeta)
    k = 0.02 * bare.omega[1] ** 2 * 0.9  # 20 g between the first and the second mode
    ops = [{"do": "hidden", "node": 5, "dof": "z", "m": 0.02, "k": k, "c": 0.0}]
    now = modal(build(d, ops, False, False), {}, zeta)
    kept = as_before(now, bare, d.places(), len(zeta))
    came = int(np.argmin(np.abs(now.omega - np.sqrt(k / 0.02))))
    assert came in (1, 2)
    assert kept[:5].tolist() == [*zeta[:came], zeta[-1], *zeta[came:]]


def test_the_laboratory_shares_nothing_with_the_package():
    for path in Path(rigs.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [x.name for x in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            assert not any(n.startswith(("cvxupdate", "validation.generated")) for n in names)
