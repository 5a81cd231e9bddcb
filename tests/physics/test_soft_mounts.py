"""Springs to ground that are all softer."""

from __future__ import annotations

from cvxupdate.fe.build import build_model
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
