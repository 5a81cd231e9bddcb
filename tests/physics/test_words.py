"""Sentences for technicians: no raw identifiers, no exponents, every kind of place, every word of
linear physics."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from cvxupdate.physics import EFFECTS, effect_names, told
from cvxupdate.physics.effect import ChannelFault, Effect
from cvxupdate.physics.place import Place, at, numbered, where
from cvxupdate.physics.sensor_fault import ChannelDelay, ExchangedChannels, Fault
from cvxupdate.physics.soft_support import SoftSupport
from cvxupdate.physics.units import number, quantity

FIGURES = {
    "stiffness_change": {"factor": 0.87},
    "mass_change": {"factor": 1.1},
    "thickness_change": {"factor": 1.35},
    "added_mass": {"m": 1.21},
    "orthotropy": {"Dx": 1.1, "Dy": 0.8, "D1": 1.0, "Dxy": 0.93},
    "grounding_spring": {"k": 3490.0},
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
PLACES = [
    Place(nodes=(5,), dof="x"),
    Place(nodes=(2, 3), dof="x"),
    Place(nodes=(2, 3, 9)),
    Place(elements=(4,)),
    Place(elements=(3, 4, 5, 6, 12)),
    Place(elements=(1, 2), groups=("bar",)),
    Place(groups=("a", "b", "c")),
    Place(nodes=(7,), elements=(6,), dof="ry"),
    Place(),
]


@pytest.mark.parametrize(
    ("value", "unit", "wanted"),
    [
        (3490.0, "N/m", "3.49 kN/m"),
        (2.1e6, "N/m", "2.10 MN/m"),
        (812.0, "N/m", "812 N/m"),
        (999.9, "N/m", "1.00 kN/m"),
        (4.2e10, "N·m/rad", "42.0 GN·m/rad"),
        (1.21, "kg", "1.21 kg"),
        (0.0348, "kg", "34.8 g"),
        (-0.0348, "kg", "−34.8 g"),
        (1234.0, "kg", "1230 kg"),
        (0.0037, "s", "3.70 ms"),
        (2e-6, "s", "2.00 µs"),
        (-1830.0, "N", "−1.83 kN"),
        (0.0377, "N·s/m", "0.0377 N·s/m"),
        (0.0, "N/m", "0 N/m"),
        (0.012, "", "0.0120"),
        (3e-9, "s", "0.00300 µs"),
    ],
)
def test_sizes_have_the_prefix_that_suits_them(value: float, unit: str, wanted: str) -> None:
    assert quantity(value, unit) == wanted


def test_numbers_are_written_out() -> None:
    assert [number(v) for v in (0.0, 1.0, 9.996, 12345.0, 0.000123)] == [
        "0",
        "1.00",
        "10.0",
        "12300",
        "0.000123",
    ]
    assert numbered([12, 3, 4, 5, 9, 10]) == "3 to 5, 9, 10 and 12"
    assert numbered(range(1, 41, 2)).endswith("and 8 more")


def test_places_as_things_and_as_answers() -> None:
    assert [where(p) for p in PLACES] == [
        "node 5 (x)",
        "nodes 2 and 3 (x)",
        "nodes 2, 3 and 9",
        "element 4",
        "elements 3 to 6 and 12",
        "group 'bar'",
        "groups 'a', 'b' and 'c'",
        "the joint of element 6 at node 7",
        "the whole structure",
    ]
    assert [at(p) for p in PLACES] == [
        "at node 5 (x)",
        "between nodes 2 and 3 (x)",
        "at nodes 2, 3 and 9",
        "in element 4",
        "in elements 3 to 6 and 12",
        "in group 'bar'",
        "in groups 'a', 'b' and 'c'",
        "at the joint of element 6 at node 7",
        "in the whole structure",
    ]
    assert told("added_mass", PLACES[0]).title == "an added mass at node 5 (x)"


def test_every_word_has_its_sentence_at_every_place() -> None:
    """One sentence, a capital first, a full stop last, neither underscore nor exponent nor "at
    where"."""
    assert set(FIGURES) == set(effect_names())
    for kind in EFFECTS:
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
