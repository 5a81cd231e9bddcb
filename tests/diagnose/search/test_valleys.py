"""Valleys of a fixture on tables: the reference state of a portal of the laboratory of rigs, and a
space frame of which springs in every direction seemed to explain the table."""

from __future__ import annotations

from pathlib import Path

import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.classes import on_a_rig
from cvxupdate.diagnose.search.completed import on_fixtures, on_rigs, under_all
from cvxupdate.diagnose.search.valleys import in_other_valleys, in_place_of_springs
from cvxupdate.recordings.states import parted
from cvxupdate.study import open_problem
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed
from tests.diagnose.search.test_classes import quiet
from validation.rigs import generate

FIFTEENTH = Path(__file__).resolve().parents[3] / "problems" / "strange" / "fifteenth"


def test_a_fit_leaves_the_valley_that_it_ended_in(tmp_path) -> None:
    """From a fixture sixteen times as heavy, beside sensors that weigh."""
    generate.make(2867, tmp_path)
    spec, model, recordings = open_problem(tmp_path / "reference.toml")
    (its_spec, its), _ = parted(spec, recordings)
    portal = gathered(its_spec, model, its, quiet)
    best = max(on_fixtures(portal, [], quiet), key=merit)
    sensors = next(e for e in portal.candidates(portal.model) if e.physics == "sensor_mass")
    whole = together(portal, best, [sensors], 0.01)
    p, first = whole.fit.p.copy(), len(portal.model.parameters)
    p[first + 1] *= 16.0
    heavy = Hypothesis(whole.effects, portal.evaluated(whole.fit.setting, p))
    found = in_other_valleys(portal, [heavy], quiet)
    likeliest = max(found, key=merit)
    assert merit(likeliest) > merit(best) - 3.0 > merit(heavy) + 50.0
    again = in_other_valleys(portal, [likeliest], quiet)
    assert all(merit(h) < merit(likeliest) + 3.0 for h in again)


def test_a_fixture_begins_as_soft_as_the_springs_that_came_near() -> None:
    """From the rigid model the fit led to 3 t on 2 GN/m, and a misfit of 11; feet of a base plate
    stand on pads of 40 and 20 MN/m and 70 kN·m/rad, each with 3 kg."""
    frame = gathered(*open_problem(FIFTEENTH / "m08_storeys" / "problem.toml"), quiet)
    best = max(on_a_rig(frame, quiet), key=merit)
    fixtures = under_all(frame.candidates(frame.model, ("flexible_support",)))
    (stood,) = in_place_of_springs(frame, best, fixtures)
    assert [e.physics for e in stood.effects] == ["flexible_support"]
    assert stood.fit.spent and merit(stood) > merit(best)
    (figures,) = stood.values
    assert 1e7 < figures["k"] < 5e7 and figures["kr"] == pytest.approx(7e4, rel=0.25)
    assert in_place_of_springs(frame, stood, fixtures) == [], "nothing stands on springs"


@pytest.mark.parametrize("effects", [(), (rig("grounding_spring", nodes=(1,)),), (effect(),)])
def test_other_sets_have_no_valleys(effects) -> None:
    assert in_other_valleys(PlainEvidence(), [supposed(PlainFit(1.0), *effects)], quiet) == []


@pytest.mark.proof
def test_a_mass_beside_a_fixture_is_found_though_springs_explain(tmp_path) -> None:
    """Springs in three directions and elements half as heavy again lay within the tolerance of a
    model (the laboratory's 4723), forty-eight nats behind."""
    generate.make(4723, tmp_path)
    spec, model, recordings = open_problem(tmp_path / "problem.toml")
    frame = gathered(spec, model, recordings, quiet)
    best = max(on_rigs(frame, [], quiet), key=merit)
    assert {"flexible_support", "added_mass"} <= {e.physics for e in best.effects}
    (lump,) = [k for k, e in enumerate(best.effects) if e.physics == "added_mass"]
    assert best.effects[lump].place.nodes == (28,)
    assert best.values[lump]["m"] == pytest.approx(0.296, rel=0.15)
    assert best.fit.misfit < 0.15, "noise makes next to all of it"
