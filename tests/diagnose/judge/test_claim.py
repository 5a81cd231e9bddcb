"""What all likely hypotheses have in common as a finding, of plain figures."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.judge.claim import claimed
from cvxupdate.diagnose.judge.judge import Judgement, judge
from cvxupdate.diagnose.output.wording import verdict_of
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.settings import GRADED
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics import effect_names
from cvxupdate.physics.quantity import physical
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed

NODES = np.arange(1, 11)
BAR = SimpleNamespace(
    node_ids=NODES, xyz=np.outer(NODES, [1.0, 0.0, 0.0]), blocks=(), parameters=()
)
EVIDENCE = PlainEvidence(
    (PlainFit(100.0, errors=Errors(0.5, 0.5)),),
    model=BAR,  # type: ignore[arg-type]
    names=effect_names(),
)
POOR = PlainFit(10.0, errors=Errors(0.2, 0.2))  # a tenth left, and not explained
KILOGRAMS = (replace(physical("m", "kg"), convert=lambda m, q, x, dx, unit: (x, dx)),)


def lump(node: int):
    return replace(effect("added_mass", nodes=(node,)), figures=KILOGRAMS)


def accelerometers(*nodes: int):
    e = rig("sensor_mass", nodes=())
    return replace(e, figures=KILOGRAMS, action=replace(e.change, nodes=nodes))


def after(*sets, evidence: PlainEvidence = EVIDENCE) -> Judgement:
    return claimed(judge(evidence, Found(singles=sets)))  # type: ignore[arg-type]


def test_a_mass_that_all_likely_sets_have_is_found_whatever_the_rest_is() -> None:
    sets = [supposed(POOR, lump(9), size=0.2, std=0.01)]
    sets += [supposed(replace(POOR, misfit=11.0), lump(10), size=0.3, std=0.01)]
    found = after(*sets)
    (finding,) = found.findings
    assert (finding.physics, finding.place.nodes) == ("added_mass", (9,))
    assert [e.place.nodes for e in finding.equivalent] == [(10,)]
    assert finding.behind == (pytest.approx(1.1**10.0),)
    assert 0.2 < finding.parameters["m"] < 0.25 and 0.03 < finding.deviations["m"] < 0.06
    assert GRADED <= finding.confidence <= finding.explains == pytest.approx(0.9)
    assert found.final is not None and found.final.hypothesis.effects == sets[0].effects
    verdict, says = verdict_of(found, (), False)
    assert verdict == "missing_physics"
    assert says.endswith(
        "This is so whatever else is wrong; it explains 90 % of the mismatch. What is left is 10."
    )


def test_where_it_is_far_less_likely_is_not_listed() -> None:
    found = after(
        supposed(POOR, lump(9), size=0.2, std=0.01),
        supposed(replace(POOR, misfit=14.0), lump(10), size=0.2, std=0.01),
    )
    assert [f.equivalent for f in found.findings] == [()]


def test_an_accelerometer_and_a_lump_at_one_node_are_a_mass_there() -> None:
    found = after(
        supposed(replace(POOR, misfit=9.9), accelerometers(9), size=0.2, std=0.01),
        supposed(POOR, lump(9), size=0.2, std=0.01),
    )
    (finding,) = found.findings
    assert (finding.physics, finding.place.nodes) == ("added_mass", (9,))
    assert finding.equivalent == ()
    assert found.last.hypothesis.effects[0].physics == "added_mass", "the model is what is said"


@pytest.mark.parametrize(
    "sets",
    [
        pytest.param(
            (supposed(POOR, lump(9)), supposed(POOR, effect("grounding_spring", nodes=(10,)))),
            id="one of several kinds",
        ),
        pytest.param(
            (
                supposed(POOR, lump(9), size=0.2, std=0.01),
                supposed(POOR, lump(10), size=2.0, std=0.01),
            ),
            id="no size",
        ),
        pytest.param(
            (supposed(POOR, effect(elements=(3, 4))), supposed(POOR, effect(elements=(4, 5)))),
            id="a factor of one place is none of another",
        ),
    ],
)
def test_what_is_no_effect_with_a_size_is_said_and_not_found(sets) -> None:
    found = after(*sets)
    assert not found.findings
    assert verdict_of(found, (), False)[0] == "undetermined"


def test_a_mass_and_a_mass_on_a_spring_are_not_one_mass() -> None:
    sprung = replace(effect("attached_resonator", nodes=(9,)), figures=KILOGRAMS)
    sets = [supposed(POOR, e, size=0.2, std=0.01) for e in (lump(9), sprung)]
    assert not after(*sets).findings


def test_of_a_few_effects_that_were_asked_for_the_likeliest_is_no_finding() -> None:
    sets = [supposed(POOR, lump(9), size=0.2, std=0.01)]
    assert after(*sets).findings
    assert not after(*sets, evidence=replace(EVIDENCE, names=("added_mass",))).findings


def test_what_is_claimed_already_stays() -> None:
    good = supposed(PlainFit(1.0), lump(9))
    before = judge(EVIDENCE, Found(singles=(good,)))  # type: ignore[arg-type]
    assert before.findings and claimed(before) is before
