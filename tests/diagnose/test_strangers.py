"""Tables of modes that an engineer made with a beam code of their own (tests/strangers)."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from cvxupdate.study import diagnose, run
from tests.cases.bad_beam import channels, good_text, write

STRANGERS = Path(__file__).resolve().parents[1] / "strangers"
FOOT = {
    "portal_exact": 60e3,
    "portal": 60e3,
    "portal_k2e4": 20e3,
    "portal_k2e5": 200e3,
}


@cache
def said(folder: str, name: str = "problem"):
    """The diagnosis of one of them; the portal's other draws of noise (s1, s2, s3) are told as that
    of `portal` and of other feet is."""
    return diagnose(STRANGERS / folder / f"{name}.toml")


@pytest.mark.parametrize("folder", FOOT)
@pytest.mark.slow
def test_the_foot_that_turns_is_found_and_no_other(folder):
    found = said(folder)
    assert found.verdict == "missing_physics"
    (first,) = found.findings
    assert first.physics == "grounding_spring"
    assert (first.place.nodes, first.place.dof) == ((1,), "rz")
    k, deviation = first.parameters["k"], first.deviations["k"]
    assert abs(k - FOOT[folder]) <= 3.0 * deviation and deviation < 0.5 * k
    # `portal` gives Iz alone: the size of a tension is that of the way in which the bar bends
    assert any(c["physics"] == "axial_preload" for c in found.candidates)


@pytest.mark.parametrize(
    ("name", "physics", "node", "figure", "value"),
    [("mass", "added_mass", 13, "m", 0.3), ("soft", "grounding_spring", 1, "k", 1500.0)],
)
def test_what_was_done_to_the_cantilever_is_found(name, physics, node, figure, value):
    found = said("beam_modal", name)
    (first,) = found.findings
    assert first.physics == physics and first.place.nodes == (node,)
    assert first.parameters[figure] == pytest.approx(value, rel=0.1)


@pytest.mark.slow
def test_a_portal_of_another_theory_has_no_more_than_a_foot_that_turns():
    """Responses by a program without rotary inertia: "elements 21 to 23 3.7 % lighter" (0.99)."""
    (first,) = said("portal_frf").findings
    assert (first.physics, first.place.nodes, first.place.dof) == ("grounding_spring", (1,), "rz")
    assert first.parameters["k"] == pytest.approx(60e3, rel=0.02)


@pytest.mark.slow
def test_one_whole_matrix_has_no_parts_to_tell():
    """Four effects with seven unknowns reproduced its three modes (0.99)."""
    found = said("threedof", "full")
    assert found.verdict == "undetermined" and not found.findings


def test_nothing_is_found_on_the_cantilever_as_modelled():
    found = said("beam_modal", "none")
    assert found.verdict == "consistent" and not found.findings


def test_the_parts_of_own_matrices_are_found_and_sized():
    """K of three springs and M, in NPZ: the first is 10 % stiffer, the second 20 % softer."""
    found = said("threedof")
    sizes = {f.place.elements: f.parameters["factor"] for f in found.findings}
    assert {f.physics for f in found.findings} == {"stiffness_change"}
    assert sizes == pytest.approx({(2,): 0.8, (1,): 1.1}, rel=1e-3)


def test_the_parts_of_own_matrices_are_updated():
    after = [q.after for q in run(STRANGERS / "threedof" / "problem.toml").parameters]
    assert after == pytest.approx([0.1, -0.2, 0.0], abs=1e-3)


def test_what_stands_beside_an_effect_is_no_equivalent_of_it(tmp_path):
    """Elements at the tip, 2 % stiffer beside the lump, fit the cantilever's responses a little
    better: "an added mass at node 13 cannot be told from a change of stiffness in element 19"."""
    path = write(tmp_path, channels(), good_text())
    with path.open("a", encoding="utf-8") as file:
        file.write('[diagnose]\nphysics = ["added_mass", "stiffness_change"]\n')
    (first,) = diagnose(path).findings
    assert (first.physics, first.place.nodes) == ("added_mass", (13,))
    near = pytest.approx(0.3, abs=2.0 * first.deviations["m"])
    assert first.parameters["m"] == near and not first.equivalent
    assert first.deviations["m"] < 0.003
