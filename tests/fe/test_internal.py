"""The nonlinear elements of a problem file: their laws, their directions, and what linear commands
see of them."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate import forces as nl
from cvxupdate.errors import ModelError, ProblemFileError
from cvxupdate.fe.internal import internal_forces, is_nonlinear
from tests.cases.elements import NONLINEAR_CASES, Case, build, nodes


@pytest.mark.parametrize("case", NONLINEAR_CASES, ids=lambda c: c.name)
def test_no_part_in_the_matrices_and_one_law_each(case: Case) -> None:
    model = case.build()
    linear = [e for e in case.model["elements"] if e["type"] != case.name]
    bare = build({**case.model, "elements": linear})
    for a, b in zip("KMCD", "KMCD", strict=True):
        difference = getattr(model.matrices(), a) - getattr(bare.matrices(), b)
        assert np.abs(difference.toarray()).max() == 0.0
    found = internal_forces(model)
    count = 3 if case.name == "iwan" else 2
    assert found.laws.size == count == len(found.ids) == found.directions.shape[1]
    assert is_nonlinear(model) and not is_nonlinear(bare)
    assert internal_forces(bare).laws.size == 0


def test_directions_are_those_of_a_spring() -> None:
    """B Bᵀ is the pattern of a spring's stiffness; the force opposes the motion."""
    for case in NONLINEAR_CASES:
        model = case.build()
        B = internal_forces(model).directions.toarray()
        at = {label: i for i, label in enumerate(model.labels)}
        np.testing.assert_array_equal(B[at["n1.y"]] != 0.0, B[:, :].min(axis=0) < 0.0)
        assert B[at["n2.y"], -1] == 1.0 and B[at["n3.y"], 0] == 1.0 and B[at["n1.y"], 0] == -1.0


def test_properties_reach_their_laws() -> None:
    by_name = {c.name: internal_forces(c.build()).laws for c in NONLINEAR_CASES}
    wanted = {
        "cubic_spring": nl.cubic([2e7, -3e5], [0.0, 40.0], [30.0, 0.0]),
        "clearance": nl.join([nl.clearance(4e4, -1e-3), nl.clearance(7e4, 2e-3, "two")]),
        "friction": nl.friction([3.0, 8.0]),
        "jenkins": nl.jenkins([4e4, 9e4], [3.0, 8.0], [0.0, 1e-4]),
        "iwan": nl.jenkins([4e4, 2e4, 5e4], [3.0, 6.0, 8.0]),
        "bouc_wen": nl.bouc_wen([4e4, 9e4], [3.0, 8.0], [1.0, 2.0], [0.5, 0.7]),
        "quadratic_damper": nl.quadratic([12.0, 5.0]),
    }
    assert set(by_name) == set(wanted)
    for name, laws in wanted.items():
        np.testing.assert_array_equal(by_name[name].kinds, laws.kinds)
        np.testing.assert_array_equal(by_name[name].values, laws.values)


def one_mass(block: dict) -> dict:
    return {
        "dofs": ["x"],
        "nodes": nodes([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]),
        "elements": [
            {"type": "spring", "dof": "x", "rows": [{"id": 1, "nodes": [1, 2], "k": 9.0}]},
            {"type": "mass", "rows": [{"id": 2, "nodes": [2], "m": 2.0}]},
            block,
        ],
        "supports": [{"nodes": [1], "dofs": ["x"]}],
    }


def test_a_held_end_is_ground() -> None:
    block = {"type": "friction", "dof": "x", "rows": [{"id": 3, "nodes": [1, 2], "force": 1.0}]}
    B = internal_forces(build(one_mass(block))).directions.toarray()
    np.testing.assert_array_equal(B, [[1.0]])


def test_faults_are_said() -> None:
    row = {"id": 3, "nodes": [2], "stiffnesses": [1.0, 2.0], "forces": [1.0]}
    with pytest.raises(ModelError, match="iwan 3 has 2 stiffnesses and 1 forces"):
        build(one_mass({"type": "iwan", "dof": "x", "rows": [row]}))
    with pytest.raises(ProblemFileError, match="force"):
        build(one_mass({"type": "friction", "dof": "x", "rows": [{"id": 3, "nodes": [2]}]}))
    bad = {"id": 3, "nodes": [2], "k": 1.0, "gap": -0.1, "sides": "two"}
    with pytest.raises(ModelError, match="gap must be 0 or more"):
        internal_forces(build(one_mass({"type": "clearance", "dof": "x", "rows": [bad]})))
