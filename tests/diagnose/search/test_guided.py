"""Sets of effects grown from a model that is far off, with what a rig does among them."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, seed_from
from cvxupdate.diagnose.nominal.mesh import shearing
from cvxupdate.diagnose.nominal.wanted import by_theory
from cvxupdate.diagnose.responses import guide
from cvxupdate.diagnose.responses.guide import _classes
from cvxupdate.diagnose.search import nearest as reference
from cvxupdate.diagnose.search.guided import _Growth, guided
from cvxupdate.diagnose.search.met import Met
from cvxupdate.diagnose.search.reached import Reached, abreast
from cvxupdate.diagnose.search.several import busy
from cvxupdate.diagnose.settings import BEAM, NEAREST
from cvxupdate.diagnose.types import Score
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from tests.cases.plain_evidence import rig
from tests.diagnose.nominal.test_refinement import STOCKY, load


def quiet(_: str) -> None:
    """Progress that nobody reads."""


@pytest.fixture(scope="module")
def best(evidence):
    return min(guided(evidence, quiet), key=lambda h: h.penalised)


@pytest.fixture(scope="module")
def evidence(chain, lab, measure):
    """Accelerometers that weigh, a force channel that reads low, a lump heavier than the mass where
    it is."""
    spec, model = chain
    real = lab(m=(0.3, 0.3, 2.5, 0.3))
    gains = (1 / 0.8,) * 4
    recordings = (
        measure(real, 4, seed=11, gain=gains),
        measure(real, 1, "hold-out", seed=12, gain=gains),
    )
    names = ("added_mass", "sensor_mass", "sensor_fault", "grounding_spring", "stiffness_change")
    return replace(gather.gathered(spec, model, recordings, quiet), names=names)


def test_all_that_a_rig_does_is_placed_at_once_and_does_nothing_yet(evidence):
    bare = at_nominal(evidence, Hypothesis((), evidence.bases[0]), 1)
    rigged = evidence.approach.rigged(bare)
    assert all(e.type.rig for e in rigged.effects)
    assert {"sensor_mass", "sensor_fault"} <= {e.physics for e in rigged.effects}
    left = evidence.approach.left
    assert left(rigged) == pytest.approx(left(bare), rel=1e-3)
    assert evidence.approach.rigged(rigged) is None


def test_beside_a_class_that_is_known_its_members_are_none_of_a_rig():
    """All four feet of a plate on springs, and each of them once more (the laboratory's 4258): the
    class went first, and three feet with a thinner corner were told."""
    feet, one = rig("grounding_spring", nodes=(1, 2)), rig("grounding_spring", nodes=(1,))
    other = rig("grounding_spring", nodes=(3,))
    assert _classes([one, other], [feet]) == [other]
    assert _classes([one, other, feet], []) == [other, feet]


def test_what_a_rig_does_alone_is_worked_out_once(evidence, monkeypatch):
    """It is asked for before the race, and again where sets begin to grow."""
    approach, asked = replace(evidence).approach, []
    real = guide.at_finite_sizes
    monkeypatch.setattr(guide, "at_finite_sizes", lambda *a: asked.append(1) or real(*a))
    first, again = (approach.mounted(approach.begun(), count) for count in (2, 3))
    assert len(asked) == 1 and [s.keys for s in first] == [s.keys for s in again[: len(first)]]
    seed = approach.rigged(approach.begun()).onward
    approach.remember(seed, "sharp", found := approach.taken(seed, "first pass"))
    assert approach.taken(approach.rigged(approach.begun()).onward, "sharp") is found
    assert approach.taken(seed, "first pass") is not found
    assert replace(evidence).approach.known == {}


def test_a_rig_softens_no_springs_that_were_added(evidence):
    """Springs to ground that are softer alike are those of the file: two that a hypothesis has
    brought are no rig, and no page could draw them."""
    h = at_nominal(evidence, Hypothesis((), evidence.bases[0]), 1)
    for node in (2, 3):
        spring = next(
            c
            for c in evidence.candidates(h.fit.setting.model, ("grounding_spring",))
            if c.place.nodes == (node,)
        )
        seed = seed_from(evidence, h, Score(spring, 0.0, np.ones(1)), 1)
        h = Hypothesis(seed.effects, evidence.evaluated(seed.setting, seed.start))
    known = {int(i) for b in evidence.model.blocks for i in b.ids}
    added = {int(i) for b in h.fit.setting.model.blocks for i in b.ids} - known
    assert len(added) == 2
    rigged = evidence.approach.rigged(h)
    assert not any(added & set(e.place.elements) for e in rigged.effects)


def test_what_is_sought_stands_beside_the_rig(best):
    found = {e.physics: f.values for e, f in zip(best.effects, best.figures, strict=True)}
    assert set(found) == {"added_mass", "sensor_mass", "sensor_fault"}
    assert found["sensor_mass"]["m"] == pytest.approx(0.3, rel=0.1)
    assert found["added_mass"]["m"] == pytest.approx(2.2, rel=0.05)
    assert found["sensor_fault"]["gain"] == pytest.approx(0.8, rel=0.03)


def test_a_model_is_brought_near_by_the_first_set_that_explains(evidence, best, monkeypatch):
    """Nothing is claimed of it, so no rivals of its members are sought."""
    near = reference.nearest(evidence, quiet)
    found = near.found
    assert near.enough
    several = min(found.several, key=lambda h: h.penalised)
    known = {e.physics for e in best.effects}
    assert {e.physics for e in several.effects} == known and several.fit.misfit <= 1.0
    assert not found.scores and not found.entries
    assert all({e.physics for e in h.effects} <= known for h in (*found.several, *found.singles))
    monkeypatch.setattr(reference, "brought_near", lambda evidence, progress: [])
    monkeypatch.setattr(reference, "met", lambda evidence, progress: Met([], False))
    assert not reference.nearest(evidence, quiet).enough, "where none does, all is sought"
    asked = []
    monkeypatch.setattr(reference, "met", lambda evidence, progress: Met([], True))
    monkeypatch.setattr(reference, "brought_near", lambda *args: asked.append(args) or [best])
    near = reference.nearest(evidence, quiet)
    assert asked and near.enough, "what modes explain may not stand on the responses"
    assert {h.keys for h in near.found.several} == {best.keys}


def test_what_does_nothing_in_a_set_is_dropped(evidence, best):
    """And nothing else is; a set that loses nothing does not come back."""
    assert busy(evidence, [best], quiet) == []
    further = next(
        c
        for c in evidence.candidates(best.fit.setting.model)
        if c.physics == "grounding_spring" and c.key not in best.keys
    )
    seed = seed_from(evidence, best, Score(further, 0.0, np.zeros(1)), evidence.levels - 1)
    idle = Hypothesis(seed.effects, evidence.evaluated(seed.setting, seed.start))
    (rest,) = busy(evidence, [idle], quiet)
    assert rest.keys == best.keys
    assert rest.fit.misfit <= 1.02 * best.fit.misfit < idle.fit.misfit


def test_few_effects_are_not_crowded_out_by_many(evidence):
    """Of sets to go on from none of as few effects is nearer; then the nearest of the others."""

    def reached(left: float, *places: int) -> Reached:
        bare = at_nominal(evidence, Hypothesis((), evidence.bases[0]), 1)
        lumps = [c for c in evidence.candidates(evidence.model) if c.physics == "added_mass"]
        return Reached(Hypothesis(tuple(lumps[k] for k in places), bare.fit), left)

    one, other = reached(0.5, 0), reached(0.6, 1)
    many = [reached(0.1 + 0.01 * k, *(j for j in range(4) if j != k)) for k in range(4)]
    assert abreast([one, other, *many]) == [many[0], many[1], one]
    assert abreast([other, one]) == [one, other] and len(abreast(many)) == BEAM


class Heard:
    """An approach, and what it was asked to fit with which effort."""

    def __init__(self, approach):
        self.approach, self.asked = approach, []

    def __getattr__(self, name):
        return getattr(self.approach, name)

    def taken(self, seed, effort):
        self.asked.append((frozenset(e.key for e in seed.effects), effort))
        return self.approach.taken(seed, effort)


def test_the_nearest_set_on_each_parent_is_fitted_on(evidence, monkeypatch):
    """After a few steps the sets on one parent may all be ahead, and those on another still far
    from where they end."""
    monkeypatch.setattr(sys.modules["cvxupdate.diagnose.search.guided"], "BEAM", 1)
    heard, bare = Heard(evidence.approach), evidence.approach.begun()
    growth = _Growth(evidence, heard, bare, quiet, Budget())
    found = growth._taken(evidence.approach.beside(bare, 4), "sharp")
    parents = [r for r in found if r.hypothesis.effects[-1].change is not None][:3]
    growth._further(parents)
    sharp = {keys for keys, effort in heard.asked if effort == "sharp"}
    for r in parents:
        seeds = evidence.approach.beside(r.hypothesis, NEAREST)
        first = growth.nearer(seeds, "first pass")[0].hypothesis.keys
        assert first in sharp


@pytest.fixture(scope="module")
def short_bar(tmp_path_factory):
    """A cantilever of five depths and a half that deforms in shear, without that in the file."""
    spec, model = load(tmp_path_factory.mktemp("short"), STOCKY)
    real = shearing(model)
    m = real.matrices(real.zero())
    lines = np.linspace(100.0, 6000.0, 600)
    w = 2.0 * np.pi * lines
    K, M = m.K.toarray() * (1.0 + 0.01j), m.M.toarray()
    drive = real.place["n6.z"]
    sensors = [real.place[f"n{n}.z"] for n in (3, 4, 6)]
    H = np.array([-(v**2) * np.linalg.inv(K - v**2 * M)[sensors, drive] for v in w])
    rng, std = np.random.default_rng(3), 0.01 * np.abs(H)
    H = H + std * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2.0)
    recording = FrequencyResponse(
        Origin("short", "test", "fit"),
        lines,
        H[:, :, None],
        "acceleration",
        tuple(Channel(n, "z", "acceleration") for n in (3, 4, 6)),
        (Channel(6, "z", "force"),),
        std[:, :, None] ** 2,
    )
    return gather.gathered(spec, model, (recording,), quiet)


def test_sets_grow_on_the_shear_that_theory_wants(short_bar):
    """As large as the section says; it is no effect that is pruned while the rest is not there."""
    approach = short_bar.approach
    begun = approach.begun()
    (shear,), (said,) = begun.effects, begun.figures
    assert shear.physics == "shear_deformation" and shear.place.elements == (1, 2, 3, 4, 5)
    assert said.values["kappa"] == pytest.approx(5.0 / 6.0, rel=0.05)
    assert by_theory(short_bar, begun) is None, "it is that large"
    gone = Hypothesis(begun.effects, short_bar.evaluated(begun.fit.setting, 0.0 * begun.fit.p))
    (again,) = by_theory(short_bar, gone).figures
    assert again.values == pytest.approx(said.values)
    growth = _Growth(short_bar, approach, begun, quiet, None)
    assert growth._sought(begun) == []
    assert growth._parents([Reached(begun, 0.1)]) == [begun]
    names = [h.name for h in growth._parents([Reached(gone, 0.1)])]
    assert len(names) == 2


def test_slender_or_sheared_beams_want_none(evidence):
    assert evidence.approach.begun().effects == ()
    assert by_theory(evidence, evidence.approach.begun()) is None
