"""Findings of damping ratios, on plain figures."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cvxupdate.diagnose.judge.judge import Judgement, judge
from cvxupdate.diagnose.judge.pattern import MOST, RESONATOR, pattern_of, told_beside
from cvxupdate.diagnose.results import Damper, Further
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.settings import MOST_SURE, STRONG
from cvxupdate.physics.effect import Effect, ModelChange
from tests.cases.plain_evidence import CHAIN, PlainEvidence, PlainFit, effect, fault, supposed


def damper(
    strain: float,
    size: float = 0.5,
    physics: str = "viscous_damper",
    places: int = 1,
    **place: object,
) -> Damper:
    made = effect(physics, damping=True, **place)
    on: Effect = replace(made, action=ModelChange(lambda: CHAIN, ((),)))
    return Damper(on, size, 0.1, strain, places)


def test_nothing_found_says_what_the_evidence_says() -> None:
    assert pattern_of(Further(("a line",))).lines == ("a line",)
    assert pattern_of(Further(("a line",))).findings == ()


def test_one_rate_of_decay_is_a_law_of_the_whole_structure() -> None:
    """It comes before any damper, and leaves the model as it is."""
    found = pattern_of(Further(("a line",), (6.2, 0.3), 40.0, 6, (damper(1.0, nodes=(1,)),), 0.93))
    (law,) = found.findings
    assert law.physics == "mass_proportional_damping" and law.confidence == 0.93
    assert law.parameters == {"alpha": 6.2} and law.deviations == {"alpha": 0.3}
    assert law.place.nodes == () and "3.1" in law.says, "amplitudes decay at half of it"
    assert found.lines == ("a line",) and found.damped is None


def test_the_best_damper_is_told_with_the_strain_that_it_leaves() -> None:
    best, far = damper(4.0, nodes=(1,)), damper(38.0, nodes=(3,))
    found = pattern_of(Further(("a line",), None, 40.0, 6, (best, far)))
    (finding,) = found.findings
    assert finding.physics == "viscous_damper" and finding.explains == pytest.approx(0.9)
    assert finding.parameters == {"factor": 1.5} and finding.deviations == {"factor": 0.1}
    assert finding.confidence == MOST_SURE and finding.equivalent == ()
    assert found.damped == (CHAIN, 0.5)
    assert found.lines[0] == "a line"
    assert "40 in units" in found.lines[1] and "brings it to 4." in found.lines[1]
    assert "6 modes" in found.lines[1]


def test_dampers_that_luck_cannot_tell_from_it_are_equivalents() -> None:
    best = damper(4.0, nodes=(1,))
    near = damper(3.9 + STRONG, nodes=(3,))
    there = damper(4.1, nodes=(1,))
    far = damper(4.1 + STRONG, nodes=(2,))
    (finding,) = pattern_of(Further((), None, 100.0, 6, (best, there, near, far))).findings
    assert finding.equivalent == (there.effect, near.effect)
    odds = [math.exp(-0.5 * (d.strain - best.strain)) for d in (best, there, near, far)]
    assert finding.confidence == pytest.approx(sum(odds[:2]) / sum(odds)), "two are elsewhere"


def test_so_many_equivalents_are_listed() -> None:
    """Beside one that is likelier than all of them together."""
    count = MOST + 5
    others = [damper(9.9 + 0.005 * k, nodes=(k + 2,)) for k in range(count)]
    (finding,) = pattern_of(Further((), None, 99.0, 9, (damper(4.0), *others))).findings
    assert len(finding.equivalent) == MOST


def test_a_place_that_is_not_likelier_than_not_is_not_stated() -> None:
    """What is missing is said all the same, and no model is written."""
    alike = tuple(damper(4.0 + 0.1 * k, nodes=(k + 1,)) for k in range(6))
    found = pattern_of(Further((), None, 60.0, 8, alike))
    assert found.findings == () and found.damped is None
    assert "takes out energy" in found.unsure and "2 more" in found.unsure
    assert pattern_of(Further((), None, 4.5, 8, alike[:2])).unsure == "", "or nothing is missing"


def test_the_places_of_a_type_share_its_odds() -> None:
    """Twenty nodes at which a dashpot does nearly as well do not drown one law of all."""
    law = damper(4.0, physics="mass_proportional_damping", nodes=())
    many = tuple(damper(6.2, nodes=(k + 1,), places=20) for k in range(5))
    (finding,) = pattern_of(Further((), None, 60.0, 8, (*many, law))).findings
    assert finding.physics == "mass_proportional_damping"
    odds = [1.0, 5.0 / 20.0 * math.exp(-1.1)]
    assert finding.confidence == pytest.approx(odds[0] / sum(odds), rel=1e-6)


def test_what_only_the_prior_decides_is_a_tie() -> None:
    """A dashpot at a free end takes from every mode alike: that or one law of all is missing."""
    law = damper(4.0, physics="mass_proportional_damping", nodes=())
    end = damper(4.2, nodes=(12,), places=12)
    found = pattern_of(Further((), None, 60.0, 8, (law, end)))
    assert found.findings == () and "viscous damper at node 12 would each do" in found.unsure
    same = damper(4.2, physics="structural_damping", nodes=(12,))
    assert pattern_of(Further((), None, 60.0, 8, (end, same))).findings, "of one place that is said"


def test_a_channel_takes_out_no_energy() -> None:
    odd = Damper(fault("n1.x"), 0.5, 0.1, 1.0)
    assert pattern_of(Further((), None, 40.0, 6, (odd,))).findings == ()


def test_ratios_that_nothing_explains_are_said_to_be_off() -> None:
    """Beyond what chance leaves of them; within it nothing is said."""
    off = Further((), None, 40.0, 10, most=25.0)
    says = pattern_of(off).unsure
    assert "but not the damping ratios: they depart from the file's pattern by 2 times" in says
    assert pattern_of(replace(off, strain=24.0)).unsure == ""


def ended(*effects: Effect, misfit: float = 1.0) -> Judgement:
    """A search that ended with these effects."""
    evidence = PlainEvidence((PlainFit(misfit if not effects else 100.0),), told_by="modes")
    found = supposed(PlainFit(misfit), *effects)
    several = (found,) if len(effects) > 1 else ()
    return judge(evidence, Found(singles=(found,) if len(effects) == 1 else (), several=several))  # type: ignore[arg-type]


def test_a_damper_is_told_beside_shapes_that_are_explained_only() -> None:
    found = pattern_of(Further((), None, 40.0, 6, (damper(4.0, nodes=(1,)),)))
    assert told_beside(found, ended()) is found
    off = told_beside(found, ended(misfit=50.0))
    assert off.findings == () and off.damped is None and off.lines == found.lines
    law = pattern_of(Further((), (6.2, 0.3), 40.0, 6, (), 0.93))
    assert told_beside(law, ended(misfit=50.0)) is law, "which needs no shapes"


def test_what_an_oscillator_takes_out_is_its_own() -> None:
    found = pattern_of(Further((), None, 40.0, 6, (damper(4.0, nodes=(1,)),)))
    here, there = (effect(RESONATOR, nodes=(n,)) for n in (1, 3))
    beside = ended(here)
    assert beside.findings and told_beside(found, beside).findings == ()
    assert told_beside(found, ended(there)) is found
