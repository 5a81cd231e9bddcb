"""Where several things are missing, the guide names those that are, not what flattens lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, together
from cvxupdate.diagnose.responses.guide import _several
from cvxupdate.diagnose.search.guided import guided
from cvxupdate.diagnose.types import Score
from cvxupdate.errors import ModelError
from cvxupdate.physics.place import Place


def quiet(_: str) -> None:
    """Progress that nobody reads."""


@pytest.fixture(scope="module")
def evidence(chain, lab, measure):
    """A spring far softer, a lump far heavier than the mass there."""
    spec, model = chain
    real = lab(k=(1, 0.4, 1, 1), m=(0, 0, 2.2, 0))
    recordings = (measure(real, 4, seed=11), measure(real, 1, "hold-out", seed=12))
    return gather.gathered(spec, model, recordings, quiet)


def test_effects_that_bring_nearest_are_true_ones(evidence):
    bare = at_nominal(evidence, Hypothesis((), evidence.bases[0]), 1)
    seeds = evidence.approach.beside(bare, 5)
    assert len(seeds) >= 5 and all(s.setting.level == 1 for s in seeds)
    assert ("added_mass", (3,)) in {(e.physics, e.place.nodes) for s in seeds for e in s.effects}
    fit, left = evidence.approach.taken(seeds[0], "first pass")
    assert 0.0 < left < 2.0 and np.isfinite(fit.misfit)


def test_places_that_overlap_are_taken_up_once(evidence):
    """What shares an element or a node with what is taken up already does nearly the same."""
    bare = at_nominal(evidence, Hypothesis((), evidence.bases[0]), 1)
    effects = [e for s in evidence.approach.beside(bare, 8) for e in s.effects]
    taken = {e.key: e for e in effects if not e.place.groups}.values()
    for kind in {(e.physics, e.place.dof) for e in taken}:
        own = [e.place for e in taken if (e.physics, e.place.dof) == kind]
        elements = [x for place in own for x in place.elements]
        assert len(elements) == len(set(elements)), kind


def test_a_part_does_not_stand_for_its_whole_group(evidence):
    """Where two elements of a column come slightly nearer than the column, both are taken up."""
    known = evidence.candidates(evidence.model, ("stiffness_change",))[0]
    two, one = (replace(known, place=Place(elements=own)) for own in ((1, 2), (2,)))
    column, frame = (
        replace(known, place=Place(elements=own, groups=names))
        for own, names in (((1, 2, 3), ("column",)), ((1, 2, 3, 4), ("column", "beam")))
    )
    scores = [
        Score(e, 0.5 - 0.01 * k, np.zeros(1)) for k, e in enumerate((two, column, one, frame, two))
    ]
    assert [s.effect for s in _several(scores, 8)] == [two, two, column]


def test_what_is_no_structure_with_all_of_a_rig_stays_as_it_is(evidence):
    """Where a part has lost all its mass, what else takes mass from it makes the sum negative."""

    class Refusing:
        def __getattr__(self, name):
            return getattr(evidence, name)

        def evaluated(self, setting, p):
            raise ModelError("the mass matrix has a negative eigenvalue.")

    parent = Hypothesis((), evidence.bases[0])
    effect = evidence.candidates(evidence.model, ("added_mass",))[0]
    assert together(Refusing(), parent, [effect]) is parent
    assert together(evidence, parent, [effect]).effects != ()


def test_a_set_grows_to_what_is_missing(evidence):
    few = replace(evidence, names=("added_mass", "grounding_spring", "stiffness_change"))
    sets = guided(few, quiet)
    pair = next(h for h in sets if len(h.effects) == 2)
    assert pair.fit.misfit < 1.0
    found = {e.physics: f.values for e, f in zip(pair.effects, pair.figures, strict=True)}
    assert found["added_mass"]["m"] == pytest.approx(2.2, rel=0.02)
    assert found["stiffness_change"]["factor"] == pytest.approx(0.4, rel=0.02)
