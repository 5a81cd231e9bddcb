"""A member that the model has and the structure has not."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.absent_member import AbsentMember, spare_members
from cvxupdate.physics.joint_flexibility import JointFlexibility
from cvxupdate.recordings.load import load_recordings
from tests.cases.cantilever import load
from tests.cases.effects import context_of

WORDS = """
[diagnose]
physics = ["stiffness_change", "mass_change", "added_mass", "axial_preload"]
"""
BAYS, STOREYS = (0.0, 4.0), (0.0, 3.0, 6.0)


def frame(parts=2, without=(), E=2.1e11, tail=""):
    """A braced frame of two storeys, each member in ``parts`` elements, ``without`` some members by
    the nodes at their ends; the file's text and how many elements each member has."""
    at = {10 * s + b: (x, y) for s, y in enumerate(STOREYS) for b, x in enumerate(BAYS)}
    members = [(0, 10), (1, 11), (10, 20), (11, 21), (10, 11), (20, 21), (0, 11), (10, 21)]
    nodes, rows, fresh, number = dict(at), [], 100, 0
    for a, b in members:
        chain = [a]
        for k in range(1, parts):
            w = k / parts
            nodes[fresh] = tuple((1 - w) * np.array(at[a]) + w * np.array(at[b]))
            chain.append(fresh)
            fresh += 1
        for ends in zip(chain, [*chain[1:], b], strict=True):
            number += 1
            if (a, b) not in without:
                group = "brace" if abs(a - b) == 11 else "frame"
                rows.append((number, *ends, group))
    used = {n for r in rows for n in r[1:3]}
    listed = ", ".join(
        f"{{ id = {n}, x = {x}, y = {y} }}" for n, (x, y) in nodes.items() if n in used
    )
    elements = "".join(
        f'[[model.elements]]\ntype = "beam2d"\nmaterial = "steel"\nsection = "{group}"\n'
        f'group = "{group}"\nrows = ['
        + ", ".join(f"{{ id = {i}, nodes = [{a}, {b}] }}" for i, a, b, g in rows if g == group)
        + "]\n"
        for group in ("frame", "brace")
    )
    return f"""
title = "Braced frame"
[model]
dofs = ["x", "y", "rz"]
nodes = [{listed}]
supports = [{{ nodes = [0, 1], dofs = ["x", "y", "rz"] }}]
[model.materials.steel]
E = {E}
nu = 0.3
rho = 7850.0
[model.sections.frame]
shape = "general"
A = 5.4e-3
Iz = 3.9e-5
[model.sections.brace]
shape = "general"
A = 1.5e-3
Iz = 1.0e-6
{elements}
{tail}
"""


def measured(folder, seed=1, **of):
    """The frame's text with a table of the modes of another one: 0.1 % of noise in frequencies, 1 %
    in shapes, 1 % more E."""
    _, real = load(folder, frame(9, E=2.12e11, **of))
    rng, modes = np.random.default_rng(seed), model_modes(real, 6)
    sensors = [(n, d) for n in (10, 11, 20, 21) for d in ("x", "y")]
    rows = [real.place[f"n{n}.{d}"] for n, d in sensors]
    lines = []
    for f, phi in zip(modes.frequencies, modes.shapes[rows].T, strict=True):
        phi = phi / np.abs(phi).max()
        entries = phi + 0.01 * rng.standard_normal(len(phi))
        value = f * (1 + 1e-3 * rng.standard_normal())
        lines.append(
            f"{{ frequency = {value}, frequency_std = {1e-3 * f}, damping = 0.01, shape = "
            f"{[float(x) for x in entries]}, shape_std = {[0.01] * len(phi)} }}"
        )
    channels = ", ".join(
        f'{{ column = {k}, quantity = "displacement", node = {n}, dof = "{d}" }}'
        for k, (n, d) in enumerate(sensors)
    )
    return f'[[recordings]]\nkind = "modes"\nrows = [{", ".join(lines)}]\nchannels = [{channels}]\n'


def test_members_are_those_between_joints_that_can_be_spared(tmp_path) -> None:
    _, model = load(tmp_path, frame(2))
    found = {ids: groups for ids, groups in spare_members(model)}
    assert set(found) == {(2 * k + 1, 2 * k + 2) for k in range(8)}


def test_what_hangs_on_a_member_alone_keeps_it(tmp_path) -> None:
    _, model = load(tmp_path, frame(2, without=((10, 20), (20, 21), (10, 21))))
    assert (7, 8) not in dict(spare_members(model)), "the column above the first floor"


def test_stiffness_and_mass_go_together(tmp_path) -> None:
    spec, model = load(tmp_path, frame(1))
    effect = next(
        e for e in AbsentMember().candidates(context_of(spec, model)) if e.place.elements == (7,)
    )
    assert effect.change is not None
    grown, (_, less) = effect.change.model, load(tmp_path, frame(1, ((0, 11),)))
    gone = grown.matrices(np.array([-1.0]))
    bare = less.matrices(less.zero())
    assert abs(gone.K - bare.K).max() < 1e-9 * bare.K.max()
    assert abs(gone.M - bare.M).max() < 1e-9 * bare.M.max()
    says = effect.says({"factor": 0.001})
    assert says.startswith("In group 'brace'") or says.startswith("In element 7")
    assert effect.tenable({"factor": 0.1}, 1.0, 10.0) and not effect.tenable(
        {"factor": 0.5}, 1.0, 10.0
    )


@pytest.mark.slow
def test_a_missing_brace_is_named(tmp_path) -> None:
    """Among the words for what members do; all words are tried beside the tenth hand's brace, by
    `make proof`."""
    tail = measured(tmp_path, without=((0, 11),)) + WORDS
    spec, model = load(tmp_path, frame(3, tail=tail))
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    (first,) = said["findings"]
    assert first["physics"] == "stiffness_change"
    assert first["location"]["elements"] == [19, 20, 21]
    assert first["confidence"] >= 0.9 and first["parameters"]["factor"] < 0.05


def test_a_brace_that_is_there_is_not_missed(tmp_path) -> None:
    spec, model = load(tmp_path, frame(6, tail=measured(tmp_path)))
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    assert said["verdict"] == "consistent"


def test_a_joint_that_gives_way_ends_no_member(tmp_path) -> None:
    """Its end has a further rotation, and other nodes are no supports for that."""
    spec, model = load(tmp_path, frame(2))
    joint = JointFlexibility().candidates(context_of(spec, model))[0]
    assert joint.change is not None
    assert dict(spare_members(joint.change.model)) == dict(spare_members(model))
