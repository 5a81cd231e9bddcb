"""Valleys of a fixture on tables: the reference state of a portal of the laboratory of rigs, and a
space frame of which springs in every direction seemed to explain the table."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.completed import on_fixtures, on_rigs
from cvxupdate.diagnose.search.valleys import in_other_valleys
from cvxupdate.recordings.states import parted
from cvxupdate.study import open_problem
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed
from tests.diagnose.search.test_classes import quiet
from validation.rigs import generate


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


@pytest.mark.parametrize("effects", [(), (rig("grounding_spring", nodes=(1,)),), (effect(),)])
def test_other_sets_have_no_valleys(effects) -> None:
    assert in_other_valleys(PlainEvidence(), [supposed(PlainFit(1.0), *effects)], quiet) == []


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
