"""Where an axial force may be: between things that it can push against."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.physics.axial_preload import AxialPreload
from tests.cases.effects import context_of, nuisance, problem
from tests.cases.rigs import Structure, frame, hung_bar, with_springs


def held(structure: Structure, nodes: list[int]) -> Structure:
    out = copy.deepcopy(structure)
    out["supports"].append({"nodes": nodes, "dofs": ["z"]})
    return out


@pytest.mark.parametrize(
    ("structure", "some"),
    [
        (hung_bar(), False),
        (with_springs(hung_bar(), (2, 9), "z", 3e3), False),  # cords between the ends
        (with_springs(hung_bar(), (1, 10), "z", 3e3), True),
        (held(hung_bar(), [1, 10]), True),
        (held(hung_bar(), [1]), True),  # a mast, a blade
        (frame(), True),
    ],
    ids=["free", "cords", "springs at its ends", "on two points", "one end", "frame"],
)
def test_no_force_in_a_member_with_two_free_ends(
    tmp_path: Path, structure: Structure, some: bool
) -> None:
    """A free beam had "a compression of 166 N" beside its joint (the laboratory's 2612)."""
    spec = problem(tmp_path, structure)
    found = AxialPreload().candidates(context_of(spec, nuisance(build_model(spec))))
    assert bool(found) is some
