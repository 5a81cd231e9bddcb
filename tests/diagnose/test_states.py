"""Several states of one structure in one fit: what they share, and what each has for itself."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.errors import InputError
from cvxupdate.study import diagnose, open_problem

LENGTHS = np.cumsum([0.0, 0.07, 0.08, 0.06, 0.09, 0.07, 0.08])
BAR = (
    '[model]\ndofs = ["z", "ry"]\nnodes = ['
    + ", ".join(f"{{ id = {i + 1}, x = {x:.3f} }}" for i, x in enumerate(LENGTHS))
    + """]
[model.materials.steel]
E = 200e9
nu = 0.3
rho = 7850.0
[model.sections.strip]
shape = "rectangle"
width = 0.05
height = 0.006
[[model.elements]]
type = "beam3d"
mass = "consistent"
material = "steel"
section = "strip"
rows = ["""
    + ", ".join(f'{{ id = {i}, nodes = [{i}, {i + 1}], group = "beam" }}' for i in range(1, 7))
    + """]
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
"""
)
SPRING = """[[model.elements]]
type = "spring"
dof = "z"
rows = [{{ id = 99, nodes = [{node}], k = {k}, group = "roller" }}]
"""
LUMP = """[[model.elements]]
type = "mass"
rows = [{{ id = 98, nodes = [{node}], m = {m}, group = "lump" }}]
"""


def frequencies(folder, extra):
    """Of the bar with something on it, first three, Hz."""
    from cvxupdate.fe.modes import model_modes

    path = folder / "truth.toml"
    path.write_text(BAR + extra, encoding="utf-8")
    return model_modes(open_problem(path)[1], 3).frequencies[:3]


def problem(folder, extras):
    """The bar as drawn with a table of each state."""
    rng = np.random.default_rng(5)
    text = BAR
    for k, extra in enumerate(extras):
        rows = ", ".join(
            f"{{ frequency = {f * (1 + 5e-4 * rng.standard_normal()):.6g}, "
            f"frequency_std = {5e-4 * f:.3g}, mode = {i + 1} }}"
            for i, f in enumerate(frequencies(folder, extra))
        )
        text += f'[[recordings]]\nkind = "modes"\nstate = "s{k}"\nrows = [{rows}]\n'
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_support_that_moves_has_one_stiffness_at_a_place_of_each_state(tmp_path):
    nodes = (3, 4, 6)
    said = diagnose(problem(tmp_path, [SPRING.format(node=n, k=40000.0) for n in nodes]))
    assert said.verdict == "missing_physics"
    assert [f.place.nodes for f in said.findings] == [(n,) for n in nodes]
    for f in said.findings:
        assert f.physics == "grounding_spring" and f.confidence > 0.9
        assert f.parameters["k"] == pytest.approx(40000.0, rel=0.05)
        off = abs(f.parameters["x"] - LENGTHS[f.place.nodes[0] - 1])
        assert off < 0.003, "between coarse nodes, and no further than a parabola is off"
    assert "elsewhere in each" in said.says and said.fit["fit"]["after"] < 2e-3


def test_a_lump_that_grows_stays_at_one_place(tmp_path):
    masses = (0.05, 0.1, 0.3)
    said = diagnose(problem(tmp_path, [LUMP.format(node=6, m=m) for m in masses]))
    assert {f.place.nodes for f in said.findings} == {(6,)}
    found = [f.parameters["m"] for f in said.findings]
    assert found == pytest.approx(masses, rel=0.1, abs=0.01)
    assert "its size differs" in said.says


def test_nothing_is_said_where_all_states_are_the_model(tmp_path):
    said = diagnose(problem(tmp_path, ["", "", ""]))
    assert said.verdict == "consistent" and not said.findings


def test_responses_of_several_states_are_refused(tmp_path):
    text = BAR
    for k in (1, 2):
        np.savez(
            tmp_path / f"{k}.npz",
            frequency=np.linspace(5.0, 90.0, 50),
            H=np.ones((50, 1, 1), dtype=complex),
            response_node=[7],
            response_dof=[3],
            reference_node=[7],
            reference_dof=[3],
        )
        text += f'[[recordings]]\nkind = "frf"\nfile = "{k}.npz"\nstate = "s{k}"\n'
        text += 'response = "acceleration"\n'
    path = tmp_path / "problem.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="tables of modes"):
        diagnose(path)
