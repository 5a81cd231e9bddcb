"""Plates as solid bodies: decks that CalculiX reads are whole bodies of the right volume, its
answers are read, and the responses are those of the modes. CalculiX itself is not asked."""

from __future__ import annotations

import numpy as np
import pytest

from validation import plates
from validation.generated import solids

ANSWER = """
     E I G E N V A L U E   O U T P U T

 MODE NO    EIGENVALUE                       FREQUENCY
                                     REAL PART            IMAGINARY PART
                           (RAD/TIME)      (CYCLES/TIME     (RAD/TIME)

      1   0.3947842E+04   0.6283185E+02   0.1000000E+02   0.0000000E+00
      2   0.1579137E+05   0.1256637E+03   0.2000000E+02   0.0000000E+00

     P A R T I C I P A T I O N   F A C T O R S

      1   0.1000000E+01   0.1000000E+01   0.1000000E+01   0.1000000E+01

 displacements (vx,vy,vz) for set SENSE and time  0.1000000E+01

         7  1.000000E-09  0.000000E+00  2.500000E-01
         9  1.000000E-09  0.000000E+00 -1.500000E-01

 displacements (vx,vy,vz) for set SENSE and time  0.2000000E+01

         7  0.000000E+00  0.000000E+00  4.000000E-01
         9  0.000000E+00  0.000000E+00  3.000000E-01
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


@pytest.mark.parametrize("seed", [0, 1, 2, 9, 19])
def test_a_deck_has_the_volume_of_the_plate(seed):
    case = plates.draw(seed)
    text, at = solids._written(case.design, case.scatter, case.effects)
    a, b = (max(x[k] for x in case.design.nodes.values()) for k in (0, 1))
    (h,) = case.design.section
    wanted = a * b * h
    for e in case.effects:
        if e["physics"] == "thickness_change":
            part = len(e["elements"]) / len(case.design.elements)
            wanted *= 1.0 + part * (e["factor"] - 1.0)
    assert volume("\n".join(text).split("\n")) == pytest.approx(wanted, rel=1e-4)
    assert len(set(at.values())) == len(case.design.nodes)
    assert sum(line.startswith("*SPRING,") for line in text) == sum(
        e["physics"] in ("grounding_spring", "attached_resonator") for e in case.effects
    )


def test_a_case_is_that_of_its_seed():
    one, two = plates.draw(5), plates.draw(5)
    assert one.effects == two.effects and one.sensors == two.sensors
    assert not plates.draw(10).findings and plates.draw(11).findings


def test_answers_are_read_and_modes_respond(tmp_path):
    path = tmp_path / "body.dat"
    path.write_text(ANSWER, encoding="ascii")
    f, shapes = solids._read(path, {1: 7, 2: 9})
    np.testing.assert_allclose(f, [10.0, 20.0])
    np.testing.assert_allclose(shapes, [[0.25, 0.4], [-0.15, 0.3]])
    m = solids.SolidModal({1: 0, 2: 1}, 2.0 * np.pi * f, shapes, np.array([0.01, 0.02]))
    s = 2j * np.pi * np.array([9.0, 15.0])
    H = m.accelerance(s, m.rows([(1, "z"), (2, "z")]), m.rows([(2, "z")]))
    omega, zeta = 2.0 * np.pi * f, np.array([0.01, 0.02])
    poles = s[0] ** 2 + 2.0 * zeta * omega * s[0] + omega**2
    assert H.shape == (2, 2, 1)
    assert H[0, 0, 0] == pytest.approx(s[0] ** 2 * np.sum(shapes[0] * shapes[1] / poles))
