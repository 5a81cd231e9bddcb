"""A lump that looks like a resonance until the rest is there: a free beam with two softer elements
of the laboratory of tables."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.search.race import entered, raced, refitted
from cvxupdate.diagnose.search.untuned import tenable, untuned
from cvxupdate.physics.effect import HiddenOscillator
from cvxupdate.study import open_problem
from tests.diagnose.search.test_classes import quiet
from validation.rigs import generate


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    """The evidence, and the fit of an oscillator at node 1 with the elements that are softer."""
    folder = tmp_path_factory.mktemp("beam")
    generate.make(3158, folder)
    spec, model, recordings = open_problem(folder / "problem.toml")
    evidence = gathered(spec, model, recordings, quiet)
    known = evidence.candidates(evidence.model)
    swinging = [
        e for e in known if isinstance(e.action, HiddenOscillator) and e.place.nodes == (1,)
    ]
    highest = max(swinging, key=lambda e: e.action.frequency)
    softer = next(e for e in known if e.name == "stiffness_change at e6, e7")
    begun = together(evidence, Hypothesis((), evidence.bases[-1]), [highest, softer], 0.05)
    return evidence, begun


def test_a_fit_takes_the_oscillator_out_of_the_band_and_a_lump_takes_its_place(beam) -> None:
    evidence, begun = beam
    fitted = refitted(evidence, begun.onward, "sharp")
    assert fitted is not None and not tenable(evidence, fitted)
    (seed,) = untuned(evidence, fitted)
    assert {e.physics for e in seed.effects} == {"stiffness_change", "added_mass"}
    assert {n for e in seed.effects for n in e.place.nodes} == {1}
    assert untuned(evidence, begun) == [], "tuned inside it"


def test_so_it_enters_a_race_and_stays_in_it(beam) -> None:
    """No other set in the race has come as near."""
    evidence, begun = beam
    (found,) = entered(evidence, [begun.onward], quiet)
    (sharp,) = raced(evidence, [begun], ((evidence.levels - 1, 1),), quiet)
    for h in (found, sharp):
        (lump,) = [v for e, v in zip(h.effects, h.values, strict=True) if e.physics == "added_mass"]
        assert lump["m"] == pytest.approx(0.0793, rel=0.15)
        assert h.fit.misfit < 0.3
