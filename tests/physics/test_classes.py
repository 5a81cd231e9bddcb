"""Classes of equal places: which there are, and that one number stands for all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.fe.build import build_model
from cvxupdate.physics.cords import MOST, Cords
from cvxupdate.physics.equal_joints import EqualJoints, classes
from cvxupdate.physics.equal_supports import EqualSupports
from cvxupdate.spec import load_problem
from tests.cases.effects import STRUCTURES, context_of, nuisance, problem
from tests.cases.elements import toml
from tests.cases.rigs import FEET, frame, freed, hung_bar, with_joints, with_springs


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


def at(effect, k):
    """The eigenvalues of the model of an effect with one figure k."""
    model = effect.change.model
    unit, rigid = model.parameters[-1].unit_size, 0.0
    if effect.change.series:
        rigid = float(model.blocks[-1].properties["a0"][0])
        k = 1.0 / k
    p = model.zero()
    p[-1] = (k - rigid) / unit
    (name,) = (q.name for q in effect.figures)
    said, _ = effect.reported(model, model.parameters[-1:], p[-1:], 0.0 * p[-1:])
    assert said[name] == pytest.approx(1.0 / k if effect.change.series else k, rel=1e-9)
    return eigenvalues(model, p)


@pytest.mark.parametrize("k", [80.0, 2e4])
def test_equal_joints_are_the_frame_put_together_by_hand(tmp_path: Path, k: float) -> None:
    (whole,) = EqualJoints().candidates(context(tmp_path, frame()))
    wanted = eigenvalues(by_hand(tmp_path, with_joints(frame(), k)))
    np.testing.assert_allclose(at(whole, k), wanted, rtol=1e-7)


@pytest.mark.parametrize(("dof", "k"), [("ry", 300.0), ("x", 2e5), ("z", 1e6)])
def test_equal_supports_are_the_frame_put_together_by_hand(tmp_path, dof, k) -> None:
    found = {e.place.dof: e for e in EqualSupports().candidates(context(tmp_path, frame()))}
    assert set(found) == {"x", "z", "ry"}, "not what holds every node: the frame is a plane one"
    assert all(e.place.nodes == FEET for e in found.values())
    wanted = eigenvalues(by_hand(tmp_path, freed(frame(), FEET, dof, k)))
    np.testing.assert_allclose(at(found[dof], k), wanted, rtol=1e-7)


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
