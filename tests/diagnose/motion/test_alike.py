"""Neighbouring places of a law: a bar that is stiff along its axis moves there as one."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cvxupdate.diagnose.motion.alike import alike, as_one, kin
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.cubic_stiffness import EVEN
from cvxupdate.physics.effect import MOTION
from tests.cases.elements import build


@pytest.fixture(scope="module")
def point():
    """Six masses in a row, the last three joined by springs a thousand times as stiff."""
    k = [3e4, 5e4, 4e4, 2e4, 5e7, 6e7]
    springs = [{"id": 1, "nodes": [1], "k": k[0]}]
    springs += [{"id": i + 1, "nodes": [i, i + 1], "k": k[i]} for i in range(1, 6)]
    masses = [{"id": 11 + i, "nodes": [i + 1], "m": 1.0 + 0.2 * i} for i in range(6)]
    model = build(
        {
            "dofs": ["x"],
            "nodes": [{"id": i + 1, "x": float(i)} for i in range(6)],
            "elements": [
                {"type": "spring", "dof": "x", "rows": springs},
                {"type": "mass", "rows": masses},
            ],
        }
    )
    modes = model_modes(model, 6)
    return SimpleNamespace(setting=SimpleNamespace(model=model), carried=4, modes=modes)


def laws(point, name):
    model = point.setting.model
    m = model.matrices()
    context = SearchContext(model, m.K, m.M, 50.0, 1.0, (), (), lambda node, kind: model, 0.01)
    return candidates_of(context, (name,), MOTION)


def at(effects, *nodes):
    return next(e for e in effects if e.place.nodes == nodes)


def test_laws_on_what_moves_as_one_are_alike(point) -> None:
    effects = laws(point, "cubic_stiffness")
    near = alike(point, at(effects, 4), effects)
    assert {e.place.nodes for e in near[:2]} == {(5,), (6,)}
    assert not {(1,), (4,)} & {e.place.nodes for e in near}


def test_a_force_in_the_square_is_not_alike_to_one_in_the_cube(point) -> None:
    effects = laws(point, "cubic_stiffness")
    square = next(e for e in effects if e.place.nodes == (4,) and e.figures[0].name == EVEN)
    for near in (alike(point, square, effects), as_one(point, square, effects)):
        assert near and {e.figures[0].name for e in near} == {EVEN}


def test_what_no_recording_tells_apart_is_one(point) -> None:
    """The last three masses move as one in the band, the third and fourth only nearly."""
    effects = laws(point, "cubic_stiffness")
    assert {e.place.nodes for e in as_one(point, at(effects, 4), effects)} == {(5,), (6,)}
    assert as_one(point, at(effects, 2), effects) == []


def test_places_of_their_own_have_none(point) -> None:
    effects = laws(point, "dry_friction")
    assert (2,) not in {e.place.nodes for e in alike(point, at(effects, 1), effects)}


def test_a_stop_on_the_other_side_is_another_stop(point) -> None:
    effects = laws(point, "clearance")
    own = next(e for e in effects if e.place.nodes == (4,) and e.action.sides == "one")
    found = alike(point, own, effects)
    assert found
    assert all((e.action.sides, e.action.side) == ("one", own.action.side) for e in found)


def test_what_is_no_law_has_none(point) -> None:
    model = point.setting.model
    m = model.matrices()
    context = SearchContext(model, m.K, m.M, 50.0, 1.0, (), (), lambda node, kind: model, 0.01)
    (mass, *_) = candidates_of(context, ("added_mass",))
    assert kin(mass, depends=True) == () and alike(point, mass, ()) == []


def test_a_joint_that_slips_is_also_tried_as_one_that_gives_way(point) -> None:
    effects = laws(point, "hysteresis")
    near = alike(point, at(effects, 4), effects)
    assert [e.action.law for e in near[:5]] == ["bouc_wen"] * 2 + ["iwan"] * 2 + ["jenkins"]
    assert all(e.place.nodes == (4,) for e in near[:4]) and near[4].place.nodes in {(5,), (6,)}
    bare = alike(point, at(effects, 4), effects, forms=False)
    assert [e.key for e in bare] == [e.key for e in near[4:]], "where the slider leaves nothing"


def test_what_acts_like_a_dashpot_stands_where_it_does(point) -> None:
    model = point.setting.model
    m = model.matrices()
    context = SearchContext(model, m.K, m.M, 50.0, 1.0, (), (), lambda node, kind: model, 0.01)
    dashpot = at(candidates_of(context, ("viscous_damper",)), 4)
    assert kin(dashpot, depends=False) == (), "a structure that is linear has no laws"
    names = kin(dashpot, depends=True)
    found = alike(point, dashpot, candidates_of(context, names, MOTION))
    assert {e.physics for e in found} == set(names) and len(found) == len(names)
    assert all(e.place.nodes == (4,) for e in found)
    assert kin(found[0], depends=True) == (found[0].physics,)
