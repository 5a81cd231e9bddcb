"""What goes with the drive: responses elsewhere are those of the structure that has it there."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from, without
from cvxupdate.diagnose.responses.errors import on_signals
from cvxupdate.diagnose.responses.moving import NOTHING, Carried
from cvxupdate.diagnose.search.backward import backward, merit
from cvxupdate.diagnose.search.driven import settled
from cvxupdate.diagnose.search.driven import shaken as with_shaker
from cvxupdate.diagnose.search.plainer import plainer
from cvxupdate.diagnose.search.race import refitted
from cvxupdate.diagnose.types import Score, Seed
from cvxupdate.physics.sensor_mass import SensorMass
from cvxupdate.physics.shaker import WITH_DRIVE, DriveMass, ShakerAttachment

HEAVY, STIFF = 0.4, 9e3


def quiet(_: str) -> None:
    """Progress that nobody reads."""


def driven(lab, node):
    """The chain with the shaker where it drives, of 0.4 kg on 9 kN/m."""
    m, k = np.zeros(4), np.zeros(4)
    m[node - 1], k[node - 1] = HEAVY, STIFF
    real = lab(m=tuple(m))
    return replace(real, K=real.K + np.diag(k))


def evidence_of(chain, measure, there, names=("added_mass", "flexible_support")):
    """Fitted where mass 4 is driven, held out where mass 1 is (``there``)."""
    at_four, elsewhere = there
    recordings = (
        measure(at_four, 4, seed=1, noise=1e-4, step=0.1),
        measure(elsewhere, 1, "hold-out", seed=2, noise=1e-4, step=0.1),
    )
    spec, model = chain
    return replace(gather.gathered(spec, model, recordings, quiet), names=names)


@pytest.fixture
def goes(chain, lab, measure):
    return evidence_of(chain, measure, (driven(lab, 4), driven(lab, 1)))


@pytest.fixture
def stays(chain, lab, measure):
    return evidence_of(chain, measure, (driven(lab, 4), driven(lab, 4)))


def shaken(evidence, sizes=(HEAVY, STIFF)):
    """The hypothesis of a shaker at mass 4, of its true size, sharp."""
    bare = Hypothesis((), evidence.bases[-1])
    (effect,) = ShakerAttachment().candidates(evidence.context(evidence.model))
    last = evidence.levels - 1
    seed = seed_from(evidence, bare, Score(effect, 0.0, np.zeros(2)), last)
    p, n = seed.start.copy(), len(seed.setting.model.parameters)
    p[n - 2 : n] = np.array(sizes) / [q.unit_size for q in seed.setting.model.parameters[-2:]]
    return Hypothesis(seed.effects, evidence.evaluated(seed.setting, p))


def elsewhere(h, evidence):
    (signal,) = evidence.data.sharp_hold_out
    (row,) = on_signals(h.fit.point, [signal]).modelled()
    return signal, row


def test_elsewhere_it_is_the_structure_with_the_shaker_there(goes):
    """Beside the model that has lumps and springs there; the modes' damping is that of the first
    drive's modes, so near resonance it may differ by a part of the damping."""
    moved = goes.approach.with_drive(shaken(goes))
    signal, got = elsewhere(moved, goes)
    setting, n = shaken(goes).fit.setting, len(goes.model.parameters)
    m = setting.model.matrices(np.zeros(n + 2))
    M, K, at = m.M.toarray(), m.K.toarray(), setting.model.place["n1.x"]
    M[at, at] += HEAVY
    K[at, at] += STIFF
    s2 = -(signal.s.imag[::7] ** 2)
    H = s2[:, None, None] * np.linalg.inv(K + s2[:, None, None] * M)
    wanted = H[:, [setting.model.place[label] for label in signal.sensors], at]
    far = np.abs(got[::7, :, 0] - wanted) / np.abs(wanted).max(axis=0)
    assert np.median(far) < 2e-3


def test_at_the_first_drive_it_is_the_same(goes):
    h = shaken(goes)
    moved = goes.approach.with_drive(h)
    for one, other in zip(h.fit.point.modelled(), moved.fit.point.modelled(), strict=True):
        np.testing.assert_array_equal(one, other)
    assert moved.keys != h.keys and {e.physics for e in moved.effects} == {"flexible_support"}
    assert "wherever else the drive is" in moved.effects[0].says(moved.figures[0].values)
    assert moved.figures[0].values == h.figures[0].values


@pytest.mark.parametrize("truth", ["goes", "stays"])
def test_what_was_held_out_says_whether_it_went_along(request, truth):
    evidence = request.getfixturevalue(truth)
    h = shaken(evidence)
    (found,) = settled(evidence, [h], quiet)
    went = any(WITH_DRIVE in e.key for e in found.effects)
    assert went == (truth == "goes")
    other = evidence.approach.with_drive(h) if truth == "stays" else h
    assert evidence.errors(found.fit).hold_out < 0.5 * evidence.errors(other.fit).hold_out


def test_a_shaker_that_stays_is_a_mass_and_a_spring_of_the_structure(chain, lab, measure):
    """Of which one is left where there is no more."""
    names = ("added_mass", "grounding_spring", "flexible_support")
    heavy = lab(m=(0.0, 0.0, 0.0, HEAVY))
    evidence = evidence_of(chain, measure, (heavy, heavy), names)
    fitted = refitted(evidence, shaken(evidence, (HEAVY, 1.0)).onward, "sharp")
    found = settled(evidence, [fitted], quiet)
    told = sorted([e.physics for e in h.effects] for h in found)
    assert told == [["added_mass"], ["added_mass", "grounding_spring"], ["grounding_spring"]]
    best = max(found, key=merit)
    assert [e.physics for e in best.effects] == ["added_mass"] and not best.effects[0].spot
    assert best.values[0]["m"] == pytest.approx(HEAVY, rel=0.02)


def test_it_is_taken_out_and_placed_again_as_one_that_goes(goes):
    moved = goes.approach.with_drive(shaken(goes))
    context = goes.context(goes.model)
    (effect,) = moved.effects
    again = effect.on(context)
    assert again.key == effect.key
    assert all(WITH_DRIVE in q.name for q in again.change.model.parameters[-2:])
    rest = without(goes, moved, 0)
    assert rest.effects == () and np.isfinite(rest.fit.misfit)


def test_nothing_goes_along_where_nothing_stands_or_no_other_place_is_driven(
    goes, chain, lab, measure
):
    bare = Hypothesis((), goes.bases[-1])
    assert goes.approach.with_drive(bare) is None
    assert settled(goes, [bare], quiet) == [bare]
    spec, model = chain
    real = driven(lab, 4)
    one = (measure(real, 4, seed=1), measure(real, 4, "hold-out", seed=2))
    alone = replace(gather.gathered(spec, model, one, quiet), names=("flexible_support",))
    assert alone.approach.with_drive(shaken(alone)) is None


def test_a_set_that_tells_elsewhere_much_worse_is_tried_with_a_shaker(goes, monkeypatch):
    """One that goes along is found, and explains what was held out; beside one that stands there
    already, or where what was held out is told as well, nothing is tried."""
    bare = Hypothesis((), goes.bases[-1])
    errors = goes.errors(bare.fit)
    assert errors.hold_out < 2.0 * errors.fit and with_shaker(goes, [bare], quiet) == []
    monkeypatch.setattr(sys.modules["cvxupdate.diagnose.search.driven"], "TWICE", 0.0)
    (found,) = with_shaker(goes, [bare], quiet)
    (moved,) = settled(goes, [found], quiet)
    assert WITH_DRIVE in moved.effects[0].key
    assert moved.figures[0].values["m"] == pytest.approx(HEAVY, rel=0.1)
    assert (
        goes.errors(moved.fit).hold_out < 0.5 * errors.hold_out
    )  # what stands there has scatter, too
    assert with_shaker(goes, [found], quiet) == []


def test_a_shaker_is_a_mass_or_a_spring_where_the_other_does_nothing(goes):
    """Each alone begins where it does most."""
    h = shaken(goes)
    assert {s.effects[-1].physics for s in plainer(goes, h)} == {"added_mass"}  # names sought
    whole = replace(goes, names=("added_mass", "grounding_spring", "flexible_support"))
    seeds = plainer(whole, h)
    assert {s.effects[-1].physics for s in seeds} == {"added_mass", "grounding_spring"}
    for seed in seeds:
        assert len(seed.effects) == 1 and seed.effects[0].place.nodes == (4,)


def test_a_shaker_without_a_spring_is_said_as_a_mass(chain, lab, measure):
    """One unknown less, where the other tells nothing."""
    real = lab(m=(0.0, 0.0, 0.0, HEAVY))
    heavy = evidence_of(chain, measure, (real, real))
    h = shaken(heavy, (HEAVY, 0.0))
    _, tried = backward(heavy, h, quiet)
    best = max(tried, key=merit)
    assert merit(best) > merit(h)
    (mass,) = best.effects
    assert mass.physics == "added_mass"
    assert best.figures[0].values["m"] == pytest.approx(HEAVY, rel=0.1)


def test_another_way_begins_with_the_same_size(goes, monkeypatch):
    """There is none where each node has one accelerometer; of two the other one is tried."""
    names = ("sensor_mass", "added_mass")
    heavy = replace(goes, names=names)
    (effect,) = heavy.candidates(heavy.model, ("sensor_mass",))
    bare = Hypothesis((), heavy.bases[-1])
    seed = seed_from(heavy, bare, Score(effect, 0.0, np.array([0.5]), exact=True), 0)
    h = Hypothesis(seed.effects, heavy.evaluated(seed.setting, seed.start))
    assert heavy.approach.another_way(h) == []
    both = SensorMass._of
    monkeypatch.setattr(
        SensorMass,
        "candidates",
        lambda self, context: [
            both(self, context, {n: times for n in (1, 2, 3, 4)}) for times in (1, 2)
        ],
    )
    (other,) = heavy.approach.another_way(h)
    assert other.effects[0].key != effect.key and other.start[len(heavy.model.parameters)] == 0.5


def test_what_a_reference_had_at_the_drive_goes_on_with_it(goes, chain, lab, measure):
    """A model that has the shaker by itself, with what was said of it, answers elsewhere as the one
    whose parameters it is; driven where it stands, as it is."""
    moved = goes.approach.with_drive(shaken(goes))
    point = moved.fit.point
    names = [q.name for q in point.setting.model.parameters]
    carried = Carried.of(point.setting.model, point.p)
    still = [
        replace(q, name=q.name.replace(WITH_DRIVE, "")) for q in point.setting.model.parameters
    ]
    model = point.setting.model.with_parameters(still)
    assert [q.name for q in model.parameters] != names
    held = goes.data.sharp_hold_out
    (wanted,) = on_signals(point, held).modelled()
    alone = replace(point.setting, model=model, carried=NOTHING).evaluate(point.p, point)
    (got,) = on_signals(with_carried(alone, carried), held).modelled()
    np.testing.assert_allclose(got, wanted, rtol=1e-9)
    (stays,) = on_signals(alone, held).modelled()
    assert np.abs(stays - wanted).max() > 0.1 * np.abs(wanted).max()
    first = goes.data.sharp
    for one, other in zip(
        on_signals(with_carried(alone, carried), first).modelled(),
        on_signals(alone, first).modelled(),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)


def with_carried(point, carried):
    setting = replace(point.setting, carried=carried)
    return setting.evaluate(point.p, point)


def test_it_goes_where_the_other_state_is_driven_from_there(goes):
    moved = goes.approach.with_drive(shaken(goes))
    carried = Carried.of(moved.fit.point.setting.model, moved.fit.p)
    assert carried.where(("n4.x",)) is carried
    assert carried.where(("n1.x",)) is NOTHING
    assert carried.where(("n1.x", "n4.x")) is carried, "from one to the other, one at a time"
    assert Carried.of(goes.model, goes.bases[-1].p) == NOTHING


@pytest.fixture
def roves(chain, lab, measure):
    """Fitted where mass 4 is driven and where mass 1 is, the shaker at each in turn."""
    at = {n: lab(m=tuple(HEAVY * (k == n) for k in (1, 2, 3, 4))) for n in (4, 1, 2)}
    recordings = (
        measure(at[4], 4, seed=1, noise=1e-4, step=0.1),
        measure(at[1], 1, seed=2, noise=1e-4, step=0.1),
        measure(at[2], 2, "hold-out", seed=3, noise=1e-4, step=0.1),
    )
    spec, model = chain
    return gather.gathered(spec, model, recordings, quiet)


def roving(evidence, m):
    """The hypothesis of a mass that goes with the drive."""
    bare, last = Hypothesis((), evidence.bases[-1]), evidence.levels - 1
    (effect,) = DriveMass().candidates(evidence.context(evidence.model))
    seed = seed_from(evidence, bare, Score(effect, 0.0, np.zeros(1)), last)
    p, n = seed.start.copy(), len(seed.setting.model.parameters)
    p[n - 1] = m / seed.setting.model.parameters[-1].unit_size
    return Hypothesis(seed.effects, evidence.evaluated(seed.setting, p))


@pytest.mark.parametrize("m", [0.0, 0.3])
def test_derivatives_are_those_of_the_structure_that_has_it_where_it_is(roves, m):
    point = roving(roves, m).fit.point
    J, step = point.jacobian(), 1e-6
    for j in range(len(point.p)):
        sides = (
            point.setting.evaluate(point.p + sign * step * np.eye(len(point.p))[j], point)
            for sign in (1.0, -1.0)
        )
        ahead, behind = (side.differences[0] for side in sides)
        slope = (ahead - behind) / (2.0 * step)
        # that a mode's damping in N·s/m goes with its frequency is left out of derivatives
        assert np.linalg.norm(J[:, j] - slope) <= 0.02 * np.linalg.norm(slope) + 1e-9


def test_a_mass_that_goes_from_drive_to_drive_is_found(roves):
    """Of recordings that were driven one at a time; at one of the drives, or at both, it would be
    wrong in one of them."""
    assert not ShakerAttachment().candidates(roves.context(roves.model))
    rig = roves.approach.rigged(Hypothesis((), roves.bases[-1]))
    assert any(WITH_DRIVE in e.key for e in rig.effects)
    fit, _ = roves.approach.taken(roving(roves, 0.0).onward, "sharp")
    sharp = roves.fitted(Seed((), fit.setting, fit.p), "sharp")
    assert sharp.misfit < 1.0 < 0.01 * roves.bases[-1].misfit
    told = Hypothesis(roving(roves, 0.0).effects, sharp)
    (values,) = told.values
    assert values["m"] == pytest.approx(HEAVY, rel=0.02)
    assert roves.errors(sharp).hold_out < 0.05
    says = told.effects[0].says(values)
    assert "at the drive point, node 4 (x), and wherever else the drive is" in says
