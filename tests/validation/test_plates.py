"""Plates and frames of the CalculiX laboratory: decks are whole bodies of the right volume, answers
are read, and responses are those of the structure. CalculiX itself is not asked."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from validation import calibrate
from validation.generated.drawings import frequencies
from validation.plates import __main__ as command
from validation.plates import bodies, frames, solids
from validation.plates.bodies import load
from validation.plates.cases import COUNT, EVALUATION, KINDS, draw
from validation.plates.files import KEPT, make

ANSWER = """
     E I G E N V A L U E   O U T P U T

 MODE NO    EIGENVALUE                       FREQUENCY
                                     REAL PART            IMAGINARY PART
                           (RAD/TIME)      (CYCLES/TIME     (RAD/TIME)

      1   0.3947842E+04   0.6283185E+02   0.1000000E+02   0.0000000E+00
      2   0.1579137E+05   0.1256637E+03   0.2000000E+02   0.0000000E+00

     P A R T I C I P A T I O N   F A C T O R S

      1   0.1000000E+01   0.1000000E+01   0.1000000E+01   0.1000000E+01

                    E I G E N V A L U E    N U M B E R     1

 displacements (vx,vy,vz) for set SENSE and time  0.1000000E+01

         7  2.500000E-01  0.000000E+00  0.000000E+00
         9 -1.500000E-01  0.000000E+00  1.000000E-01

 total internal energy for set LOSSY and time  0.1000000E+01

        9.869604E+02

                    E I G E N V A L U E    N U M B E R     2

 displacements (vx,vy,vz) for set SENSE and time  0.2000000E+01

         7  0.000000E+00  4.000000E-01  0.000000E+00
         9  0.000000E+00  3.000000E-01  0.000000E+00

 total internal energy for set LOSSY and time  0.2000000E+01

        1.000000E+00

                              S T E P       2

 displacements (vx,vy,vz) for set SENSE and time  0.1000000E+01

         7  1.000000E-05  0.000000E+00  0.000000E+00
         9  0.000000E+00  0.000000E+00  5.000000E-05
"""


def volume(text: list[str]) -> float:
    """Of all bricks, by their corners, which are boxes."""
    first = text.index("*NODE,NSET=ALL") + 1
    xyz, total = {}, 0.0
    for line in text[first:]:
        if line.startswith("*"):
            break
        number, *at = line.split(",")
        xyz[int(number)] = np.array([float(v) for v in at])
    for k, line in enumerate(text):
        if line.endswith(",") and not line.startswith("*") and line.count(",") == 11:
            nodes = [int(v) for v in (line + text[k + 1]).split(",")][1:]
            assert len(nodes) == 20
            total += float(np.prod(xyz[nodes[6]] - xyz[nodes[0]]))
            middle = (xyz[nodes[0]] + xyz[nodes[1]]) / 2.0
            np.testing.assert_allclose(xyz[nodes[8]], middle, atol=1e-9)
    return total


@pytest.mark.parametrize("seed", [0, 1, 2, 9, 14])
def test_a_deck_has_the_volume_of_the_plate(seed):
    case = draw(seed)
    text, at = solids.written(case.design, case.scatter, case.effects)
    a, b = (max(x[k] for x in case.design.nodes.values()) for k in (0, 1))
    (h,) = case.design.section
    wanted = a * b * h
    for e in case.effects:
        if e["physics"] == "thickness_change":
            part = len(e["elements"]) / len(case.design.elements)
            wanted *= 1.0 + part * (e["factor"] - 1.0)
    assert volume("\n".join(text).split("\n")) == pytest.approx(wanted, rel=1e-4)
    assert len(set(at.values())) == len(case.design.nodes)


def test_the_springs_of_a_soft_edge_are_those_of_the_file_together():
    """Distributed on both faces, at half the thickness: κ times the length about the edge, and so
    k times the nodes of the file."""
    case = draw(13)
    (found,) = case.findings
    text, _ = solids.written(case.design, case.scatter, case.effects)
    at = [k for k, line in enumerate(text) if line.startswith("*SPRING,ELSET=Y")]
    total = sum(float(text[k + 2]) for k in at) * (case.design.section[0] / 2.0) ** 2
    assert total == pytest.approx(found.effect["k"] * len(found.effect["nodes"]), rel=2e-3)


def test_four_rigidities_are_those_of_the_material():
    """Plane stress: D_x = E₁/(1 − ν₁₂ν₂₁) and so on, as factors on E/(1 − ν²)."""
    E, nu = 70e9, 0.3
    factors = {"Dx": 1.4, "Dy": 0.9, "D1": 1.1, "Dxy": 0.8}
    _, first, last = solids._elastic(E, nu, factors)
    E1, E2, _, nu12, _, _, G12, _ = (float(v) for v in first.rstrip(",").split(","))
    assert float(last) == pytest.approx(E / (2.0 * (1.0 + nu)))
    nu21, D = nu12 * E2 / E1, E / (1.0 - nu**2)
    found = np.array([E1, E2, nu12 * E2]) / (1.0 - nu12 * nu21)
    np.testing.assert_allclose(found, D * np.array([1.4, 0.9, 1.1 * nu]), rtol=1e-8)
    assert pytest.approx(0.8 * (1.0 - nu) / 2.0 * D) == G12
    _, plain = solids._elastic(E, nu, None)
    assert plain == f"{E:.10g},{nu}"


def test_a_frame_s_deck_has_its_beams_end_to_end():
    case = draw(20)
    text, at = frames.written(case.design, case.scatter, case.effects)
    assert at == {n: n for n in case.design.nodes}
    end = next(k for k, line in enumerate(text[1:], 1) if line.startswith("*"))
    xyz = {int(row[0]): np.array(row[1:]) for row in
           (np.array(line.split(","), dtype=float) for line in text[1:end])}  # fmt: skip
    total = 0.0
    for k, line in enumerate(text):
        if line.startswith("*ELEMENT,TYPE=B32R"):
            _, a, m, b = (int(v) for v in text[k + 1].split(","))
            total += float(np.linalg.norm(xyz[b] - xyz[a]))
            np.testing.assert_allclose(xyz[m], (xyz[a] + xyz[b]) / 2.0, atol=1e-12)
    ends = [[np.array(case.design.nodes[n]) for n in e.nodes] for e in case.design.elements]
    assert total == pytest.approx(sum(float(np.linalg.norm(b - a)) for a, b in ends))
    soft = case.findings[0].effect
    bound = f"{soft['node']},{bodies.AXES.index(soft['dof']) + 1},"
    assert not any(line.startswith(bound) for line in text[text.index("*BOUNDARY") :])


def test_answers_are_read_without_modes_out_of_the_plane(tmp_path):
    path = tmp_path / "body.dat"
    path.write_text(ANSWER, encoding="ascii")
    found = bodies.read(path, {1: 7, 2: 9}, "xz", [(2, "z")])
    np.testing.assert_allclose(found.omega, [20.0 * np.pi])
    assert found.points == ((1, "x"), (1, "z"), (2, "x"), (2, "z"))
    np.testing.assert_allclose(found.shapes[:, 0], [0.25, 0.0, -0.15, 0.1])
    assert found.lossy[0, 0] / found.omega[0] ** 2 == pytest.approx(0.5, rel=1e-4)
    mode = found.shapes[:, 0] * 0.1 / found.omega[0] ** 2
    np.testing.assert_allclose(found.rest[:, 3], [1e-5, 0.0, 0.0, 5e-5] - mode)
    assert not found.rest[:, :3].any()


def test_modes_and_the_rest_respond_as_the_structure_does(tmp_path):
    """A random structure with lossy members: a few modes and the flexibility of the others come to
    its direct response, also from a file."""
    rng = np.random.default_rng(3)
    n = 60
    A, B = rng.standard_normal((n, n)), rng.standard_normal((n, 4))
    K = A @ A.T + np.diag(np.arange(1.0, n + 1.0) ** 3) * 50.0
    M, L = np.diag(rng.uniform(1.0, 2.0, n)), B @ B.T * 20.0
    omega = np.sqrt(sl.eigh(K, M, eigvals_only=True))
    top = float(omega[4] + omega[5]) / 4.0 / np.pi
    points = [(1, "z"), (2, "z"), (3, "z")]
    lossy = [{"physics": "structural_damping", "eta": 0.2}]
    body = bodies.reduced(
        sp.csc_array(K), sp.csc_array(M), [0, 5, 9], points, top, sp.csc_array(L)
    ).with_losses(np.array([0.0]), lossy)
    bodies.save(tmp_path / "b.npz", body)
    back = bodies.load(tmp_path / "b.npz").with_losses(np.array([0.0]), lossy)
    s = 1j * np.array([0.6 * omega[0], 0.9 * omega[4]])
    for b in (body, back.at(points)):
        H = b.accelerance(s, b.rows(points), b.rows(points[:1]))[:, :, 0]
        for k, x in enumerate(s):
            true = x**2 * np.linalg.inv(K + 0.2j * L + x**2 * M)[[0, 5, 9], 0]
            np.testing.assert_allclose(H[k], true, rtol=2e-3, atol=2e-3 * np.abs(true).max())


def test_cases_are_those_of_their_seeds_and_both_halves_alike():
    one, two = draw(5), draw(5)
    assert one.effects == two.effects and one.sensors == two.sensors
    assert len(KINDS) == COUNT and sum(not words for _, words in KINDS) == COUNT // 3
    for number in (0, 11, 14, 20, 24):
        half, other = draw(number), draw(EVALUATION + number)
        assert half.design.family == other.design.family == KINDS[number][0]
        assert len(half.findings) == len(other.findings) == len(KINDS[number][1])
        assert half.sensors != other.sensors
    edges = {int(x[0]) for x in draw(13).design.held}
    assert edges == set(draw(13).findings[0].effect["nodes"])


def test_what_is_kept_is_small_and_becomes_a_folder(tmp_path):
    there = sorted(KEPT.glob("*.npz"))
    assert there and sum(p.stat().st_size for p in there) < 6e6
    seed = int(there[0].stem)
    case = make(seed, tmp_path)
    body = load(there[0])
    assert set(body.points) <= {*case.sensors, *case.drives}
    # an analyst's mesh, at the nominal numbers, has the flexible frequencies of the body nearly
    f = body.omega[body.omega > 0.3 * 2.0 * np.pi * case.first] / (2.0 * np.pi)
    drawn = frequencies(case.design)
    assert np.all(np.abs(f[:4] / drawn[:4] - 1.0) < 0.25)
    assert (tmp_path / "problem.toml").exists() and (tmp_path / "truth.toml").exists()


def test_totals_count_what_is_visible():
    row = {
        "family": "plate",
        "outcome": "right",
        "words": ["added_mass"],
        "left": [3.0],
        "seconds": 9.0,
    }
    faint = {**row, "left": [0.2], "outcome": "missed"}
    null = {**row, "words": [], "left": [], "outcome": "silent", "seconds": 100.0}
    text = command.lines([row, faint, null])
    assert calibrate.rate(1, 1) in text[0] and calibrate.rate(0, 1) in text[0]
    assert text[-1].endswith(": 1")


def test_the_evaluation_is_not_looked_at_singly(capsys):
    with pytest.raises(SystemExit):
        command.main(["--evaluation", "--cases"])
    assert "only totals" in capsys.readouterr().err
