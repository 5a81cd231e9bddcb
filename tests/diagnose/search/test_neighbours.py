"""A single effect at the wrong place, put right where it was fitted."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from, together
from cvxupdate.diagnose.search.neighbours import FEW_PLACES, at_last, neighbours
from cvxupdate.diagnose.search.race import entered, raced, refitted
from cvxupdate.diagnose.types import Seed

LUMP = 0.3  # kg at floor 3


def quiet(text: str) -> None:
    pass


@pytest.fixture(scope="module")
def evidence(chain, lab, measure):
    real = lab(k=(1, 1, 1, 1), m=(0, 0, LUMP, 0))
    return gathered(*chain, [measure(real, 1), measure(real, 4, "hold-out", seed=2)], quiet)


def fitted(evidence, node):
    """A lump at a node, refitted to the end."""
    h = Hypothesis((), evidence.bases[0])
    known = evidence.candidates(evidence.model, ("added_mass",))
    own = [e for e in known if e.place.nodes == (node,)]
    scores = evidence.finite_size(h.fit, h.fit, (), own).scores
    found = entered(evidence, seeds_from(evidence, h, scores, 0), quiet)
    return raced(evidence, found[:1], ((1, 1), (evidence.levels - 1, 1)), quiet)[0]


def test_a_place_that_was_not_refitted_is(evidence):
    wrong, right = fitted(evidence, 2), fitted(evidence, 3)
    found = neighbours(evidence, [wrong], [], quiet)
    assert found[0].keys == right.keys
    assert found[0].fit.misfit == pytest.approx(right.fit.misfit, rel=0.01)
    assert found[0].values[0]["m"] == pytest.approx(LUMP, rel=0.1)


def test_places_that_do_less_are_not_refitted(evidence):
    right = fitted(evidence, 3)
    assert neighbours(evidence, [right], [], quiet) == [right]


def test_beside_likelier_sets_nothing_is_refitted(evidence):
    wrong, right = fitted(evidence, 2), fitted(evidence, 3)
    both = Hypothesis((*right.effects, *right.effects), right.fit)
    assert neighbours(evidence, [wrong], [both], quiet) == [wrong]


@pytest.fixture(scope="module")
def two(chain, lab, measure):
    """A softer storey and a lump at floor 3, in a diagnosis whose time is over or not."""
    real = lab(k=(1, 0.6, 1, 1), m=(0, 0, LUMP, 0))
    held = measure(real, 4, "hold-out", seed=2)
    return gathered(*chain, [measure(real, 1), held], quiet, budget=Budget())


def storey_and_lump(evidence, node):
    """Both, the lump at a node."""
    bare = Hypothesis((), evidence.bases[0])
    known = evidence.candidates(evidence.model, ("stiffness_change", "added_mass"))
    storey = next(e for e in known if e.place.elements == (102,))
    lump = next(e for e in known if e.physics == "added_mass" and e.place.nodes == (node,))
    whole = together(evidence, bare, [storey, lump], 0.1)
    return refitted(evidence, whole.onward, "sharp")


def test_where_time_is_over_what_is_sought_is_still_compared_with_its_neighbours(two, monkeypatch):
    wrong, right = storey_and_lump(two, 2), storey_and_lump(two, 3)
    assert at_last(two, [wrong], quiet) == []  # there is time for all that is done then
    monkeypatch.setattr(type(two), "hurried", True)
    best = min(at_last(two, [wrong], quiet), key=lambda h: h.penalised)
    assert best.keys == right.keys
    sharp = two.at_level(right.fit.setting, two.levels - 1)
    there = refitted(two, Seed(right.effects, sharp, right.fit.p), "sharp")
    assert best.fit.misfit == pytest.approx(there.fit.misfit, rel=0.1)
    tried = at_last(two, [right], quiet)
    assert all(h.penalised > 0.9 * right.penalised for h in tried) and len(tried) <= 2 * FEW_PLACES
