"""What nearly all likely hypotheses have in common, of plain figures."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.judge.graded import Graded, graded
from cvxupdate.diagnose.judge.judge import judge
from cvxupdate.diagnose.output.evidence_words import evidence_lines
from cvxupdate.diagnose.output.wording import verdict_of
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.settings import GRADED
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import physical
from tests.cases.plain_evidence import (
    PlainEvidence,
    PlainFit,
    case_of,
    effect,
    rig,
    supposed,
    weighed,
)

NODES = np.arange(1, 11)
BAR = SimpleNamespace(
    node_ids=NODES,
    xyz=np.outer(NODES, [1.0, 0.0, 0.0]),
    blocks=(),
    parameters=(),
)
BASE = PlainFit(100.0, errors=Errors(0.5, 0.5))
EVIDENCE = PlainEvidence((BASE,), model=BAR)  # type: ignore[arg-type]
CASE = case_of(EVIDENCE)
POOR = PlainFit(10.0, errors=Errors(0.2, 0.2))  # a tenth left, and not explained


def mass(node: int):
    return effect("added_mass", nodes=(node,))


def spring(node: int):
    return effect("grounding_spring", nodes=(node,))


def of(*effects, misfit: float = 10.0):
    return weighed(replace(POOR, misfit=misfit), *effects)


def test_masses_next_to_one_another_are_a_mass_there() -> None:
    found = graded([of(mass(9)), of(mass(10)), of(mass(9), spring(1))], CASE)
    assert found is not None and found.kind == "mass" and found.place.nodes == (9, 10)
    assert found.explains == pytest.approx(0.9)
    assert GRADED <= found.probability <= 0.9, "what explains nine tenths is no surer than that"
    assert found.says.startswith("What can be said: a mass differs at nodes 9 and 10")


def test_a_mass_or_a_spring_there_is_something_there() -> None:
    found = graded([of(mass(9)), of(spring(10))], CASE)
    assert found is not None and found.kind == "" and found.place.nodes == (9, 10)
    assert "something differs" in found.says and found.to_json()["kind"] == "any"


def test_one_member_that_all_have_is_said_however_long_it_is() -> None:
    member = effect("stiffness_change", elements=(34, 35, 36))
    found = graded([of(member, mass(1)), of(member, mass(10)), of(member, spring(5))], CASE)
    assert found is not None and found.place.elements == (34, 35, 36)
    assert "a stiffness differs in elements 34 to 36" in found.says


def test_a_class_all_over_the_structure_is_said_by_its_own_words() -> None:
    feet = replace(effect("grounding_spring", nodes=(1, 10)), spot="of the 2 supports")
    found = graded([of(feet, mass(1)), of(feet, mass(10)), of(feet, spring(5))], CASE)
    assert found is not None and found.place.nodes == (1, 10)
    assert "a stiffness differs: some grounding spring of the 2 supports" in found.says


def test_masses_far_apart_are_a_mass_somewhere() -> None:
    found = graded([of(mass(1)), of(mass(10))], CASE)
    assert found is not None and found.kind == "mass" and found.place == Place()
    assert " at node" not in found.says


@pytest.mark.parametrize(
    "tried",
    [
        pytest.param([of(mass(1)), of(spring(10))], id="nothing in common"),
        pytest.param([of(mass(9), misfit=60.0)], id="does not halve the misfit"),
        pytest.param([of(mass(9), misfit=30.0)], id="leaves too much to be sure"),
        pytest.param([], id="nothing tried"),
        pytest.param([weighed(POOR, mass(9), size=0.01)], id="a size within its deviation"),
        pytest.param(
            [weighed(POOR, *(effect("added_mass", count=10, nodes=(n,)) for n in (9, 10)))],
            id="as many unknowns as figures",
        ),
        pytest.param(
            [weighed(replace(POOR, errors=Errors(0.2, 0.5)), mass(9))],
            id="refuted by what was held out",
        ),
    ],
)
def test_nothing_is_said_where_nothing_is_likely(tried) -> None:
    assert graded(tried, CASE) is None


def test_the_likelier_weighs_more() -> None:
    """A spring far off that leaves twice as much is a thousandth as likely with twenty figures."""
    found = graded([of(mass(9)), of(spring(1), misfit=20.0)], CASE)
    assert found is not None and found.kind == "mass" and found.place.nodes == (9,)


def test_sizes_of_one_effect_are_one_size_with_their_scatter() -> None:
    a, b = (replace(mass(n), figures=KILOGRAMS) for n in (9, 10))
    tried = [weighed(POOR, a, size=0.2, std=0.01), weighed(POOR, b, size=0.3, std=0.01)]
    found = graded(tried, CASE)
    assert found is not None and found.figure is not None
    name, unit, value, std = found.figure
    assert (name, unit) == ("m", "kg") and value == pytest.approx(0.25)
    assert std == pytest.approx(np.hypot(0.01, 0.05))
    assert "0.250 kg (± 51.0 g)" in found.says
    assert found.to_json()["parameters"] == {"m": value}


KILOGRAMS = (replace(physical("m", "kg"), convert=lambda m, q, x, dx, unit: (x, dx)),)


def accelerometers(*nodes: int):
    """Their mass, at nodes of the bar."""
    e = rig("sensor_mass", nodes=())
    return replace(e, figures=KILOGRAMS, action=replace(e.change, nodes=nodes))


def test_what_a_likely_set_has_beside_too_small_to_be_told_takes_nothing_from_it() -> None:
    """A rig is fitted beside everything, needed or not; a set that is less likely than a part of
    it says what the part says."""
    idle = weighed(replace(POOR, misfit=9.9), mass(9), spring(1), size=(1.0, 0.001))
    found = graded([of(mass(9)), idle, of(spring(1), misfit=17.0)], CASE)
    assert found is not None and found.kind == "mass" and found.place.nodes == (9,)
    assert found.probability == pytest.approx(0.9, abs=0.01)


def test_accelerometers_at_one_node_are_a_mass_there() -> None:
    found = graded([of(accelerometers(9)), of(mass(9))], CASE)
    assert found is not None and found.kind == "mass" and found.place.nodes == (9,)
    spread = graded([of(accelerometers(1, 10)), of(mass(1))], CASE)
    assert spread is not None and spread.place == Place(), "theirs is at both"
    alone = graded(
        [of(accelerometers(1, 10)), of(accelerometers(1, 10), mass(3), misfit=9.0)], CASE
    )
    assert alone is not None and "a mass differs: what a rig does in the whole" in alone.says


def test_masses_at_one_place_add_up() -> None:
    lump = replace(mass(9), figures=KILOGRAMS)
    both = weighed(POOR, lump, accelerometers(9), size=(0.1, 0.2), std=0.01)
    found = graded([both, weighed(POOR, lump, size=0.3, std=0.01)], CASE)
    assert found is not None and found.figure is not None
    assert found.figure[2] == pytest.approx(0.3)


def test_only_what_is_needed_for_the_claim_is_named() -> None:
    """A neighbour that is a thousandth as likely is no place of it."""
    found = graded([of(mass(9)), of(mass(10), misfit=20.0)], CASE)
    assert found is not None and found.place.nodes == (9,)


def test_it_is_said_with_the_verdict_and_where_the_rest_is() -> None:
    tried = [supposed(POOR, mass(9)), supposed(POOR, mass(10))]
    found = judge(EVIDENCE, Found(singles=tuple(tried)))  # type: ignore[arg-type]
    assert isinstance(found.graded, Graded) and not found.findings
    verdict, says = verdict_of(found, (), False)
    assert verdict == "undetermined" and says.endswith(found.graded.says)
    assert evidence_lines(found, None)[-1] == "What is left is 10."


def test_nothing_is_graded_where_something_is_claimed_or_nothing_is_wrong() -> None:
    good = supposed(PlainFit(1.0), mass(9))
    assert judge(EVIDENCE, Found(singles=(good,))).graded is None  # type: ignore[arg-type]
    calm = PlainEvidence((PlainFit(0.9),), model=BAR)  # type: ignore[arg-type]
    assert judge(calm, Found(singles=(good,))).graded is None  # type: ignore[arg-type]
