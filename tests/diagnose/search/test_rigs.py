"""What a rig alone explains, before all else and beside a set that has something sought in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.hypothesis import (
    Hypothesis,
    at_nominal,
    of_a_rig,
    only_a_rig,
    seed_from,
    without,
)
from cvxupdate.diagnose.search import rigs
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.coarse import coarsely, enough_alone
from cvxupdate.diagnose.search.race import raced
from cvxupdate.diagnose.search.rigs import a_rig_alone, beside_a_rig
from cvxupdate.diagnose.search.several import in_their_place
from cvxupdate.diagnose.types import Score
from cvxupdate.physics.cords import Cords
from cvxupdate.physics.effect import MOTION
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig

NAMES = ("added_mass", "sensor_mass", "sensor_fault", "stiffness_change")


def quiet(_: str) -> None:
    """Progress that nobody reads."""


@pytest.fixture(scope="module")
def evidence(chain, lab, measure):
    """Accelerometers that weigh, a force channel that reads low, and nothing else."""
    spec, model = chain
    real, gains = lab(m=(0.12, 0.12, 0.12, 0.12)), (1 / 0.85,) * 4
    recordings = (
        measure(real, 4, seed=11, gain=gains),
        measure(real, 1, "hold-out", seed=12, gain=gains),
    )
    return replace(gather.gathered(spec, model, recordings, quiet), names=NAMES)


@pytest.fixture(scope="module")
def best(evidence):
    """Two masses, where every accelerometer weighs."""
    h = at_nominal(evidence, Hypothesis((), evidence.bases[0]), 1)
    for node in (2, 4):
        every = evidence.candidates(h.fit.setting.model, ("added_mass",))
        (lump,) = [e for e in every if e.place.nodes == (node,)]
        seed = seed_from(evidence, h, Score(lump, 0.0, np.array([0.1])), 1)
        h = Hypothesis(seed.effects, evidence.evaluated(seed.setting, seed.start))
    (found,) = raced(evidence, [h], ((evidence.levels - 1, 1),), quiet)
    return found


def test_what_the_rig_does_is_found_and_freed_of_the_rest(evidence, best):
    found = beside_a_rig(evidence, [best], [], quiet)
    rigs = [h for h in found if {e.physics for e in h.effects} == {"sensor_mass", "sensor_fault"}]
    (alone,) = rigs
    assert merit(alone) > merit(best) + 10.0
    assert merit(alone) > max(map(merit, found)) - 1.0  # what is more does nothing
    said = {e.physics: f for e, f in zip(alone.effects, alone.figures, strict=True)}
    # beside groups whose masses scatter by as much as a few grams more or less
    assert said["sensor_mass"].values["m"] == pytest.approx(0.12, rel=0.2)
    assert said["sensor_fault"].values["gain"] == pytest.approx(0.85, rel=0.05)


def test_not_where_nothing_is_sought_nor_one_effect_is_enough(evidence, best):
    rig = next(h for h in beside_a_rig(evidence, [best], [], quiet) if only_a_rig(h))
    assert beside_a_rig(evidence, [rig], [], quiet) == []
    alone = Hypothesis(best.effects[:1], best.fit)
    assert beside_a_rig(evidence, [alone], [], quiet) == []
    assert beside_a_rig(evidence, [], [], quiet) == []
    assert beside_a_rig(evidence, [best], [best], quiet) == []  # all of it was tried


def test_where_a_rig_is_all_it_is_found_before_few_others_go_on(evidence, best):
    (lump,) = raced(evidence, [without(evidence, best, 1)], ((0, 1),), quiet)
    assert a_rig_alone(evidence, [lump], lump.penalised, quiet) == []
    (alone,) = a_rig_alone(evidence, [lump], 0.9 * lump.penalised, quiet)
    assert {e.physics for e in alone.effects} == {"sensor_mass", "sensor_fault"}
    assert enough_alone(evidence, [alone]) and not enough_alone(evidence, [lump])
    far = replace(lump, fit=replace(lump.fit, cost=100.0 * lump.fit.cost))
    singles, sharper, found = coarsely(evidence, [far] * 20, False, quiet)
    assert len(singles) <= 6 and not sharper and found[0].keys == alone.keys


def test_what_a_rig_does_not_explain_is_not_asked_twice(evidence, best, monkeypatch):
    from cvxupdate.diagnose.search import coarse

    (lump,) = raced(evidence, [without(evidence, best, 1)], ((0, 1),), quiet)
    asked: list[float] = []
    monkeypatch.setattr(coarse, "a_rig_alone", lambda e, s, enough, p: asked.append(enough) or [])
    monkeypatch.setattr(coarse, "raced", lambda e, found, legs, p: list(found))
    monkeypatch.setattr(coarse, "_sharper", lambda e, found, p: [])
    for cost in (100.0, 0.01):
        h = replace(lump, fit=replace(lump.fit, cost=cost * lump.fit.rows))
        assert coarsely(evidence, [h], False, quiet) == ([h], [], [])
    assert asked == [10.0, 10.0, 4.0]


def test_a_structure_hangs_from_a_rig(best):
    assert Cords.mount and not any(map(of_a_rig, best.effects))


def test_of_motions_all_that_a_rig_does_alike_is_tried_without_an_approach(monkeypatch):
    """Where the best single effect leaves much, as sets alone: single effects are fitted anyhow."""
    evidence = PlainEvidence(told_by=MOTION)
    far = Hypothesis((effect(),), PlainFit(50.0))
    both = Hypothesis((rig("sensor_mass"), rig("grounding_spring")), PlainFit(2.0))
    one = Hypothesis((rig("sensor_mass"),), PlainFit(20.0))
    monkeypatch.setattr(rigs, "at_once", lambda *_: [both, one])
    assert a_rig_alone(evidence, [far], 40.0, quiet) == [both]
    assert a_rig_alone(evidence, [far], 60.0, quiet) == [], "it leaves no more than that"
    assert a_rig_alone(PlainEvidence(), [far], 40.0, quiet) == []


def test_of_motions_nothing_is_sought_in_place_of_single_effects(monkeypatch):
    far = Hypothesis((effect(),), PlainFit(50.0))
    assert in_their_place(PlainEvidence(told_by=MOTION), [far], quiet) == [far]
