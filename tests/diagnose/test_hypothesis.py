"""How many effects one hypothesis may have."""

from __future__ import annotations

from dataclasses import replace

from cvxupdate.physics.shear_deformation import ShearDeformation
from tests.cases.plain_evidence import PlainFit, effect, rig, supposed


def sought(count: int):
    return [effect("added_mass", nodes=(k,)) for k in range(count)]


def of_a_rig(count: int):
    return [rig(nodes=(k,)) for k in range(count)]


def full(*effects) -> bool:
    return supposed(PlainFit(1.0), *effects).full


def test_beside_a_rig_of_many_things_two_are_sought() -> None:
    """Feet, joints, sensors and a force channel, with the shear that theory wants, were five:
    beside them nothing was sought at all."""
    assert full(*sought(5)) and not full(*sought(4))
    assert not full(*of_a_rig(6)), "a rig alone is none that was sought"
    for many in (3, 4, 5):
        assert not full(*of_a_rig(many), *sought(1)) and full(*of_a_rig(many), *sought(2))
    shear = replace(effect(groups=("bar",)), type=ShearDeformation())
    assert not full(*of_a_rig(4), shear) and not full(*of_a_rig(4), shear, *sought(1))
