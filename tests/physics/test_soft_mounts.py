"""Springs to ground that are all softer."""

from __future__ import annotations

from dataclasses import replace

from cvxupdate.fe.build import build_model
from cvxupdate.physics.grounding_spring import GroundingSpring
from cvxupdate.physics.soft_mounts import SoftMounts
from tests.cases.effects import BEAM, MOUNTED, context_of, problem


def test_all_springs_to_ground_are_one_and_ties_are_none(tmp_path) -> None:
    spec = problem(tmp_path, MOUNTED)
    (effect,) = SoftMounts().candidates(context_of(spec, build_model(spec)))
    assert (effect.place.elements, effect.place.groups) == ((6, 7), ("pad",))
    says = effect.says({"factor": 0.7})
    assert says == "In group 'pad' the real structure is 30 % softer than modelled."


def test_one_alone_is_no_class(tmp_path) -> None:
    spec = problem(tmp_path, BEAM)
    assert SoftMounts().candidates(context_of(spec, build_model(spec))) == []


def test_springs_that_another_effect_added_are_no_part_of_it(tmp_path) -> None:
    spec = problem(tmp_path, MOUNTED)
    bare = context_of(spec, build_model(spec))
    fixture = next(e for e in GroundingSpring().candidates(bare) if e.place.dof == "y")
    assert fixture.change is not None
    grown = fixture.change.grow()
    own = frozenset(int(i) for b in bare.model.blocks for i in b.ids)
    (effect,) = SoftMounts().candidates(replace(context_of(spec, grown), own=own))
    assert effect.place.elements == (6, 7)
