"""Sentences for technicians: no raw identifiers, no exponents, every kind of place, every effect of
linear physics."""

from __future__ import annotations

import re
from dataclasses import replace

from cvxupdate.physics import EFFECTS, effect_names, told
from cvxupdate.physics.effect import ChannelFault, Effect
from cvxupdate.physics.fault import Fault
from cvxupdate.physics.place import Place, at, drive_point
from cvxupdate.physics.quantity import factor
from cvxupdate.physics.sensor_fault import (
    ChannelDelay,
    DriveGain,
    ExchangedChannels,
    ForceGain,
)
from cvxupdate.physics.soft_support import SoftSupport
from tests.cases.places import PLACES

FIGURES = {
    "stiffness_change": {"factor": 0.87},
    "mass_change": {"factor": 1.1},
    "thickness_change": {"factor": 1.35},
    "added_mass": {"m": 1.21, "J": 3.4e-4},
    "orthotropy": {"Dx": 1.1, "Dy": 0.8, "D1": 1.0, "Dxy": 0.93},
    "grounding_spring": {"k": 3490.0},
    "flexible_support": {"k": 2.1e6, "m": 3.4, "kr": 5.6e3, "J": 0.021},
    "joint_flexibility": {"k": 2.1e6},
    "shear_deformation": {"kappa": 0.83},
    "axial_preload": {"N": -1830.0},
    "gyroscopic": {"omega": -314.159},
    "viscous_damper": {"c": 0.0377},
    "attached_resonator": {"m": 0.0348, "k": 88826.0, "c": 3.7},
    "structural_damping": {"eta": 0.012},
    "mass_proportional_damping": {"alpha": 1.3},
    "sensor_mass": {"m": 0.0348},
    "sensor_fault": {"gain": 0.5, "delay": 0.0037},
}


def test_every_effect_has_its_sentence_at_every_place() -> None:
    """One sentence, a capital first, a full stop last, neither underscore nor exponent nor "at
    where"."""
    assert set(FIGURES) == set(effect_names())
    for kind in (e for e in EFFECTS if e.name in FIGURES):
        assert "_" not in kind.noun
        for place in PLACES:
            for sign in (1.0, -1.0):
                moved = {
                    k: v * sign
                    if k in ("m", "N", "omega", "delay") and kind.name != "attached_resonator"
                    else v
                    for k, v in FIGURES[kind.name].items()
                }
                said = kind.says(replace(told(kind.name, place), spot=at(place)), moved)
                assert re.fullmatch(r"[A-Z].*\.", said) and said.count(". ") == 0, said
                assert "_" not in said and not re.search(
                    r"\de[+-]?\d|nan|at where|in in|at at", said
                ), said


def sentence(physics: str, place: Place, values: dict[str, float]) -> str:
    return told(physics, place).says(values)


def test_signs_change_the_words() -> None:
    node = PLACES[0]
    assert (
        sentence("added_mass", node, {"m": 1.21})
        == "The real structure carries 1.21 kg more than the model at node 5 (x)."
    )
    assert (
        sentence("added_mass", node, {"m": -0.0348})
        == "The real structure is 34.8 g lighter than the model at node 5 (x)."
    )
    assert "a tension of 1.83 kN" in sentence("axial_preload", PLACES[5], {"N": 1830.0})
    assert "a compression" in sentence("axial_preload", PLACES[5], {"N": -1830.0})
    assert "13 % softer" in sentence("stiffness_change", PLACES[3], {"factor": 0.87})
    assert "35 % thicker" in sentence("thickness_change", PLACES[4], {"factor": 1.35})
    assert "has the wrong sign" in sentence("sensor_fault", node, {"gain": -0.98})
    assert "lags by 3.70 ms" in ChannelDelay().says(told("sensor_fault", node), {"delay": 0.0037})
    assert "comes early" in ChannelDelay().says(told("sensor_fault", node), {"delay": -0.0037})
    assert "3000 turns a minute" in sentence("gyroscopic", PLACES[5], {"omega": -314.159})
    assert "N·m/rad" in sentence("grounding_spring", Place(nodes=(1,), dof="ry"), {"k": 20.0})


def test_a_hammer_is_wrong_wherever_it_strikes_and_a_shaker_where_it_stands() -> None:
    one, two = (
        Effect(t, PLACES[0], ChannelFault(Fault("n5.x", "force", others=others)), (factor("gain"),))
        for t, others in ((ForceGain(), ("n9.x",)), (DriveGain(), ()))
    )
    assert one.key != two.key and one.title != two.title
    assert one.says({"gain": 0.82}).endswith("0.820 times what it should, wherever it drives.")
    assert two.says({"gain": 0.82}).endswith("0.820 times what it should.")
    assert one.says({"gain": -1.0}).endswith("has the wrong sign, wherever it drives.")


def test_an_effect_type_knows_more_than_the_contract_s_name() -> None:
    """A support that gives way is not a spring, an exchange says which channels."""
    soft = SoftSupport().says(told("grounding_spring", Place(nodes=(1,), dof="z")), {"k": 2.1e6})
    assert (
        soft
        == "The support at node 1 (z) gives way: it holds with 2.10 MN/m, while the model holds "
        "it rigidly."
    )
    swap = Effect(
        ExchangedChannels(),
        Place(nodes=(3, 5), dof="x"),
        ChannelFault(Fault("n3.x", "swap", other="n5.x")),
        (),
        spot="at node 3 (x) and at node 5 (x)",
    )
    assert (
        swap.says({"gain": 1.0})
        == "The measurement, not the structure: the channels at node 3 (x) and at node 5 (x) "
        "are exchanged."
    )
    assert swap.title == "an exchange of the channels at node 3 (x) and at node 5 (x)"


def test_at_the_drive_point_it_may_be_the_shaker() -> None:
    """Where a force was measured, a lump, a spring and an oscillator say what they may be."""
    driven = ("n7.x", "n5.z")
    here = drive_point(Place(nodes=(5,), dof="z"), driven)
    assert here == "at the drive point, node 5 (z)"
    assert drive_point(Place(nodes=(5,)), driven) == "at the drive point, node 5"
    assert not drive_point(Place(nodes=(5,), dof="x"), driven)
    assert not drive_point(Place(nodes=(5,), elements=(2,)), driven)
    effect = replace(told("added_mass", Place(nodes=(5,), dof="z")), spot=here)
    said = (
        "The real structure carries 0.212 kg more than the model at the drive point, node 5 (z): "
    )
    assert effect.says({"m": 0.212}) == said + "the shaker's armature or the force cell."
    assert "shaker" not in effect.says({"m": -0.212})
    spring = replace(told("grounding_spring", Place(nodes=(5,), dof="z")), spot=here)
    assert spring.says({"k": 900.0}).endswith(": the shaker's stinger and suspension.")
