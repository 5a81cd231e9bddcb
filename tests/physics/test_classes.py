"""Classes of equal places: which there are, and that one number stands for all of them."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.fe.build import build_model
from cvxupdate.physics import candidates_of
from cvxupdate.physics.cords import MOST, Cords
from cvxupdate.physics.equal_joints import EqualJoints, classes
from cvxupdate.physics.equal_supports import EqualSupports
from cvxupdate.physics.joint_flexibility import JointFlexibility
from cvxupdate.physics.released import straight_runs
from cvxupdate.spec import load_problem
from tests.cases.effects import STRUCTURES, context_of, nuisance, problem
from tests.cases.elements import toml
from tests.cases.rigs import (
    BEAMS,
    FEET,
    JOINTS,
    POSTS,
    frame,
    freed,
    hung_bar,
    with_joints,
    with_springs,
)

ROOT = Path(__file__).resolve().parents[2]


def context(folder: Path, structure):
    spec = problem(folder, structure)
    return context_of(spec, nuisance(undamped(build_model(spec))))


def eigenvalues(model, p=None, count=8):
    m = model.matrices(p)
    return scipy.linalg.eigh(m.K.toarray(), m.M.toarray(), eigvals_only=True)[:count]


def by_hand(folder: Path, structure):
    path = folder / "real.toml"
    path.write_text(f"model = {toml(structure)}\n", encoding="utf-8")
    return undamped(build_model(load_problem(path)))


def held(model, p=None, count=8):
    """Of a structure that is held, where a joint turns without mass."""
    m = model.matrices(p)
    slow = scipy.linalg.eigh(m.M.toarray(), m.K.toarray(), eigvals_only=True)[-count:]
    return 1.0 / slow[::-1]


def size_of(model) -> int:
    """The last parameter that is the size of an effect."""
    return max(j for j, q in enumerate(model.parameters) if q.group is None)


def at(effect, k, eigenvalues=eigenvalues):
    """The eigenvalues of the model of an effect with one figure k."""
    model = effect.change.model
    own = size_of(model)
    unit, rigid = model.parameters[own].unit_size, 0.0
    if effect.change.series:
        rigid = float(model.blocks[-1].properties["a0"][0])
        k = 1.0 / k
    p = model.zero()
    p[own] = (k - rigid) / unit
    (name,) = (q.name for q in effect.figures)
    said, _ = effect.reported(model, [model.parameters[own]], p[[own]], 0.0 * p[[own]])
    assert said[name] == pytest.approx(1.0 / k if effect.change.series else k, rel=1e-9)
    return eigenvalues(model, p)


def some_of_each(candidates, most=20):
    """Of every effect type so many, from all over the structure."""
    kinds = {}
    for c in candidates:
        kinds.setdefault(c.physics, []).append(c)
    return [c for of in kinds.values() for c in of[:: -(-len(of) // most)]]


@pytest.mark.parametrize("structure", [frame(), hung_bar()])
def test_the_candidates_at_a_place_are_found_without_the_others(tmp_path, structure):
    every = context(tmp_path, structure)
    for same in some_of_each(candidates_of(every)):
        there = next(o for o in same.type.at(same.place, every) if o.key == same.key)
        assert (there.name, there.spot) == (same.name, same.spot)
        if there.change is not None:
            grown = [e.change.model for e in (there, same)]
            assert len({tuple(q.name for q in m.parameters) for m in grown}) == 1
            assert len({m.labels for m in grown}) == 1


@pytest.mark.parametrize("k", [80.0, 2e4])
def test_equal_joints_are_the_frame_put_together_by_hand(tmp_path: Path, k: float) -> None:
    whole, _ = EqualJoints().candidates(context(tmp_path, frame()))
    wanted = eigenvalues(by_hand(tmp_path, with_joints(frame(), k)))
    np.testing.assert_allclose(at(whole, k), wanted, rtol=1e-7)


@pytest.mark.parametrize("k", [80.0, 2e4])
def test_all_ends_at_joints_are_the_frame_put_together_by_hand(tmp_path: Path, k: float) -> None:
    """Every end where members meet turns on its own spring, posts that go on as well."""
    _, every = EqualJoints().candidates(context(tmp_path, frame()))
    ends = [(a, b) for a, b in (*POSTS, *BEAMS)]
    meeting = [end for pair in ends for end in (pair, pair[::-1]) if end[0] not in FEET]
    assert len(every.place.elements) == len(meeting)
    wanted = held(by_hand(tmp_path, with_joints(frame(), k, meeting)))
    np.testing.assert_allclose(at(every, k, held), wanted, rtol=1e-7)


def test_one_joint_gives_way_more_than_its_class(tmp_path: Path) -> None:
    """Its spring is in series with that of all; written and read again it is the same model."""
    k, further = 900.0, 400.0
    spec = problem(tmp_path, frame())
    whole, _ = EqualJoints().candidates(context_of(spec, nuisance(undamped(build_model(spec)))))
    grown = context_of(spec, whole.change.model)
    (one,) = (
        e
        for e in JointFlexibility().candidates(grown)
        if e.place.nodes == (7,) and e.place.elements[0] in whole.place.elements
    )
    assert "more than its class" in one.says({"k": further}) and "more than" in one.title
    model = one.change.model
    p = model.zero()
    sizes = [j for j, q in enumerate(model.parameters) if q.group is None]
    for at, block, stiff in zip(sizes, model.blocks[-2:], (k, further), strict=True):
        assert block.kind.name == "compliance"
        p[at] = (1.0 / stiff - float(block.properties["a0"][0])) / model.parameters[at].unit_size
    real = with_joints(frame(), k)
    real["elements"][-1]["rows"][JOINTS.index((7, 8))]["k"] = 1.0 / (1.0 / k + 1.0 / further)
    wanted = eigenvalues(by_hand(tmp_path, real))
    np.testing.assert_allclose(held(model, p), wanted, rtol=1e-7)
    path = tmp_path / "again.toml"
    text = problem_file(spec, Updated(model, p, zeta=np.zeros(1)), says=["found"]).text
    path.write_text(text, encoding="utf-8")
    np.testing.assert_allclose(held(undamped(build_model(load_problem(path)))), wanted, rtol=1e-6)


def test_two_rails_that_end_at_every_leg_are_a_class_by_themselves() -> None:
    """Rails are bolted to legs that are welded into the corners: neither the legs' ends nor every
    end (another laboratory's table)."""
    path = ROOT / "problems" / "strange" / "fifteenth" / "f02_table" / "problem.toml"
    spec = load_problem(path)
    found = EqualJoints().candidates(context_of(spec, nuisance(undamped(build_model(spec)))))
    assert [len(e.place.elements) for e in found] == [4, 8, 12]
    rails = found[1]
    assert set(rails.place.elements) == {17, 20, 21, 24, 25, 28, 29, 32}
    assert rails.says({"k": 160e3}).startswith(
        "Each of the 8 ends of group 'rails' at joints of the structure turns on a spring"
    )


def test_where_two_meet_the_springs_of_both_ends_are_one(tmp_path: Path) -> None:
    """A portal has no class of all ends: no recording tells it from that of its joints."""
    portal = copy.deepcopy(frame())
    for block in portal["elements"]:
        block["rows"] = [r for r in block["rows"] if not crosses(portal, r)]
    used = {n for block in portal["elements"] for r in block["rows"] for n in r["nodes"]}
    portal["nodes"] = [n for n in portal["nodes"] if n["id"] in used]
    portal["supports"][1]["nodes"] = [1, 3]
    found = EqualJoints().candidates(context(tmp_path, portal))
    assert [len(e.place.elements) for e in found] == [2]


def crosses(structure, row) -> bool:
    """Whether an element is not of the portal over the first two feet."""
    x, z = np.mean([(n["x"], n["z"]) for n in structure["nodes"] if n["id"] in row["nodes"]], 0)
    return x > 0.5 + 1e-9 or (0.0 < x < 0.5 and z < 0.7 - 1e-9)


@pytest.mark.parametrize(("dof", "k"), [("ry", 300.0), ("x", 2e5), ("z", 1e6)])
def test_equal_supports_are_the_frame_put_together_by_hand(tmp_path, dof, k) -> None:
    found = {e.place.dof: e for e in EqualSupports().candidates(context(tmp_path, frame()))}
    assert set(found) == {"x", "z", "ry"}, "not what holds every node: the frame is a plane one"
    assert all(e.place.nodes == FEET for e in found.values())
    wanted = eigenvalues(by_hand(tmp_path, freed(frame(), FEET, dof, k)))
    np.testing.assert_allclose(at(found[dof], k), wanted, rtol=1e-7)


def in_space():
    """The frame that may leave its plane, clamped feet."""
    out = frame()
    out["dofs"] = ["x", "y", "z", "rx", "ry", "rz"]
    out["supports"] = [{"nodes": list(FEET), "dofs": out["dofs"]}]
    return out


def test_feet_that_rock_about_every_axis_are_put_together_by_hand(tmp_path: Path) -> None:
    """Posts stand along z, about which a foot does not rock. Written and read again they are the
    same model."""
    spec = problem(tmp_path, in_space())
    context = context_of(spec, nuisance(undamped(build_model(spec))))
    feet = next(e for e in EqualSupports().candidates(context) if e.place.dof is None)
    assert (
        feet.place.nodes == FEET
        and "3 supports, about all axes across their members, at" in feet.spot
    )
    assert "300 N·m/rad" in feet.says({"k": 300.0})
    real = in_space()
    for k, dof in enumerate(("rx", "ry")):
        real = freed(real, FEET, dof, 300.0)
        for row in real["elements"][-1]["rows"]:
            row["id"] += 100 * k
    wanted = eigenvalues(by_hand(tmp_path, real))
    np.testing.assert_allclose(at(feet, 300.0), wanted, rtol=1e-7)
    model = feet.change.model
    p = model.zero()
    own = size_of(model)
    p[own] = (1 / 300.0 - float(model.blocks[-1].properties["a0"][0])) / model.parameters[
        own
    ].unit_size
    path = tmp_path / "again.toml"
    text = problem_file(spec, Updated(model, p, zeta=np.zeros(1)), says=["found"]).text
    path.write_text(text, encoding="utf-8")
    again = eigenvalues(undamped(build_model(load_problem(path))))
    np.testing.assert_allclose(again, wanted, rtol=1e-6)


def test_feet_of_members_that_lean_turn_about_all_axes(tmp_path: Path) -> None:
    leaning = in_space()
    for n in leaning["nodes"]:
        n["x"] += 0.3 * n["z"]
    (feet,) = (e for e in EqualSupports().candidates(context(tmp_path, leaning)) if not e.place.dof)
    assert len(feet.change.grow().blocks) == len(context(tmp_path, leaning).model.blocks) + 3


def test_an_edge_of_a_plate_has_no_feet(tmp_path: Path) -> None:
    """About the edge and across it are two things."""
    plate = copy.deepcopy(STRUCTURES["plate"])
    edge = [n["id"] for n in plate["nodes"] if n["x"] == 0.0]
    plate["supports"] = [{"nodes": edge, "dofs": ["z", "rx", "ry"]}]
    found = [e.place.dof for e in EqualSupports().candidates(context(tmp_path, plate))]
    assert "ry" in found and None not in found


def test_each_clamped_edge_of_a_plate_may_give_way_by_itself(tmp_path: Path) -> None:
    plate = copy.deepcopy(STRUCTURES["plate"])
    x = sorted({n["x"] for n in plate["nodes"]})
    ends = [{n["id"] for n in plate["nodes"] if n["x"] == side} for side in (x[0], x[-1])]
    plate["supports"] = [{"nodes": sorted(ends[0] | ends[1]), "dofs": ["z", "ry"]}]
    turning = [
        e for e in EqualSupports().candidates(context(tmp_path, plate)) if e.place.dof == "ry"
    ]
    assert [set(e.place.nodes) for e in turning] == [ends[0] | ends[1], *ends]
    assert all("along the edge" in e.spot for e in turning[1:])


def test_sides_that_follow_one_another_straight_on_are_one_edge() -> None:
    east, north = np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.2, 0.0])
    corner = {(1, 2): east, (3, 4): east, (2, 3): -east, (4, 5): north, (7, 8): east}
    runs = straight_runs({frozenset(ends): along for ends, along in corner.items()})
    assert sorted(map(sorted, runs)) == [[1, 2, 3, 4], [4, 5], [7, 8]]


def test_cords_are_the_bar_put_together_by_hand(tmp_path: Path) -> None:
    found = {e.place.nodes: e for e in Cords().candidates(context(tmp_path, hung_bar()))}
    assert set(found) == {(i, 11 - i) for i in range(1, 6)}, "mirror images in the middle"
    wanted = eigenvalues(by_hand(tmp_path, with_springs(hung_bar(), (3, 8), "z", 700.0)))
    np.testing.assert_allclose(at(found[3, 8], 700.0), wanted, rtol=1e-7)


def test_a_plate_hangs_on_two_or_four_cords_and_not_on_any(tmp_path: Path) -> None:
    found = [e.place.nodes for e in Cords().candidates(context(tmp_path, STRUCTURES["hung"]))]
    assert found[0] == (1, 4, 9, 12) or set(found[0]) <= {1, 4, 9, 12}, "corners first"
    assert (1, 4, 9, 12) in found and {len(n) for n in found} == {2, 4}
    assert len(found) <= MOST and len(set(found)) == len(found)


def test_what_is_held_hangs_on_no_cords(tmp_path: Path) -> None:
    assert {e.place.dof for e in Cords().candidates(context(tmp_path, frame()))} == set()


def test_feet_that_give_way_are_no_cords(tmp_path: Path) -> None:
    """A frame whose feet were set free hung on "two cords" at its second storey (the laboratory's
    table 4197), for a stinger's spring there."""
    whole = context(tmp_path, frame())
    held = next(h for h in whole.supports if h[1] == "x")
    freed_ = replace(whole, model=whole.release(*held))
    assert held in freed_.held and held not in freed_.supports
    for file, hung in (((held,), False), ((), True)):
        found = Cords().candidates(replace(freed_, held=file))
        assert ("x" in {e.place.dof for e in found}) == hung


def test_a_beam_ends_at_a_post_that_goes_on(tmp_path: Path) -> None:
    """Between groups, the one that is interrupted turns; a joint in line is none."""
    structure = STRUCTURES["frame"]
    model = context(tmp_path, structure).model
    ((met, groups),) = classes(model)
    assert groups == ("beams", "posts")
    ends = {(m.element, m.node) for m in met}
    assert ends == {(11, 2), (12, 4), (13, 4), (13, 6), (14, 7), (14, 8)}, "node 9 is in line"


def test_without_groups_every_corner_is_a_joint(tmp_path: Path) -> None:
    bare = frame()
    for block in bare["elements"]:
        for row in block["rows"]:
            row["group"] = "frame"
    ((met, groups),) = classes(context(tmp_path, bare).model)
    assert groups == () and {m.node for m in met} == {2, 4, 6, 7, 8}
    assert len(met) == 6, "at node 4 lines cross: both ends of the one that is not the first"


def test_a_joint_gives_way_more_than_its_spring_in_the_file(tmp_path: Path) -> None:
    """It is sought beside that spring, once for its two sides, and the figure is of both."""
    k, total = 900.0, 300.0
    spec = problem(tmp_path, with_joints(frame(), k))
    found = JointFlexibility().candidates(context_of(spec, nuisance(undamped(build_model(spec)))))
    sprung = [e for e in found if "more than the model has it" in e.title]
    assert len(sprung) == len(JOINTS)
    real = with_joints(frame(), k)
    row = real["elements"][-1]["rows"][JOINTS.index((7, 8))]
    (one,) = (e for e in sprung if e.place.nodes[0] in row["nodes"])
    assert f"{total:.0f} N·m/rad in all" in one.says({"k": total})
    model = one.change.model
    p, own = model.zero(), model.parameters[-1:]
    rigid = float(model.blocks[-1].properties["a0"][0])
    p[-1] = (1.0 / total - 1.0 / k - rigid) / own[0].unit_size
    assert one.reported(model, own, p[-1:], p[-1:])[0]["k"] == pytest.approx(total)
    row["k"] = total
    np.testing.assert_allclose(held(model, p), held(by_hand(tmp_path, real)), rtol=1e-7)
