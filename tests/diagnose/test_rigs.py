"""What a rig adds, concealed in small structures put together by hand: named, placed and sized."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.spec import read_text
from cvxupdate.study import correlate, diagnose
from tests.cases.rigs import (
    FEET,
    frame,
    freed,
    frfs,
    hung_bar,
    on_fixture,
    table,
    with_joints,
    with_lumps,
    with_springs,
)

LINES = np.arange(4.0, 160.0, 0.2)
SENSORS = [(n, "z") for n in (1, 3, 5, 8, 10)]
DRIVES = [(1, "z"), (8, "z")]


def sized(found, figure, value, off=0.1):
    """The one finding, whose figure is as large as it should be."""
    (first,) = found.findings
    assert first.parameters[figure] == pytest.approx(value, rel=off)
    gap = abs(first.parameters[figure] - value)
    assert gap <= 3.5 * first.deviations[figure] and first.confidence >= 0.5
    return first


def test_the_frame_as_drawn_is_consistent(tmp_path: Path) -> None:
    found = diagnose(table(tmp_path, frame(), frame(), 10))
    assert found.verdict == "consistent"


@pytest.mark.parametrize("k", [5e2])
@pytest.mark.slow
def test_joints_that_are_all_alike_have_one_number(tmp_path: Path, k: float) -> None:
    found = diagnose(table(tmp_path, with_joints(frame(), k), frame(), 10))
    first = sized(found, "k", k)
    assert first.physics == "joint_flexibility" and first.place.groups == ("beams", "posts")
    assert set(first.place.nodes) == {2, 4, 6, 7, 8} and first.place.dof == "ry"
    assert first.says.startswith("Each of the 6 joints between group 'beams' and group 'posts' ")


@pytest.mark.parametrize("k", [5e3])
@pytest.mark.slow
def test_feet_that_are_all_alike_have_one_number(tmp_path: Path, k: float) -> None:
    found = diagnose(table(tmp_path, freed(frame(), FEET, "ry", k), frame(), 10))
    first = sized(found, "k", k)
    assert first.physics == "grounding_spring" and first.place.nodes == FEET
    assert first.place.dof == "ry" and "Each of the 3 supports at nodes 1, 3 and 5" in first.says


@pytest.mark.slow
def test_feet_of_one_kind_differ_by_a_quarter_and_nothing_stands_for_that(tmp_path: Path) -> None:
    """Of a rail on stands of 4, 6 and 5 MN/m "element 1 is 51 % softer", "element 16 is 18 %
    heavier", "0.07 kg lighter" (0.93 to 0.99) were told, and the damper was not found."""
    real = freed(frame(), FEET, "ry", 5e3)
    for row, factor in zip(real["elements"][-1]["rows"], (0.75, 1.3, 1.0), strict=True):
        row["k"] *= factor
    found = diagnose(table(tmp_path, real, frame(), 10))
    first = sized(found, "k", 5e3, 0.3)
    assert first.physics == "grounding_spring" and first.place.nodes == FEET


def test_lumps_of_the_file_may_be_bodies(tmp_path: Path) -> None:
    """Of a cantilever whose tip weight was drawn as a point "76 g swing on their own at node 11"
    (0.98) was told."""
    drawn = with_lumps(hung_bar(), (1, 10), 0.4)
    real = copy.deepcopy(drawn)
    for row in real["elements"][-1]["rows"]:
        row["Iyy"] = 1.5e-4  # of a cube of steel 9e-5
    found = diagnose(table(tmp_path, real, drawn, 8))
    assert found.verdict == "consistent"
    assert any("may be bodies that resist turning" in line for line in found.evidence)


@pytest.mark.parametrize(("nodes", "k"), [((2, 9), 3e3)])
def test_the_cords_of_a_free_bar_are_found_together(
    tmp_path: Path, nodes: tuple[int, int], k: float
) -> None:
    bar = hung_bar()
    real = with_springs(bar, nodes, "z", k)
    found = diagnose(frfs(tmp_path, real, bar, SENSORS, DRIVES, LINES))
    first = sized(found, "k", k, 0.03)
    assert first.physics == "grounding_spring" and first.place.nodes == nodes
    assert "hangs on 2 cords" in first.says


@pytest.mark.slow
def test_the_fixture_under_all_feet_is_found_with_its_mass(tmp_path: Path) -> None:
    sensors = [(2, "x"), (7, "x"), (4, "x"), (13, "x"), (24, "z"), (28, "z")]
    drives, lines = [(7, "x"), (24, "z")], np.arange(5.0, 220.0, 1.0)
    real = on_fixture(frame(), "x", 1.2e6, 6.0)
    found = diagnose(frfs(tmp_path, real, frame(), sensors, drives, lines))
    first = sized(found, "k", 1.2e6)
    assert first.physics == "flexible_support" and first.place.nodes == FEET
    assert first.place.dof == "x" and first.parameters["m"] == pytest.approx(6.0, rel=0.1)
    assert "a mass of their own" in first.says and "71." in first.says
    again = build_model(read_text(found.updated.text, tmp_path / "updated.toml"))
    kept = again.matrices()
    row = again.place["n1.x"]
    assert row == again.place["n3.x"] and kept.M[row, row] > first.parameters["m"]


@pytest.mark.parametrize(("gain", "held"), [(0.85, (7, "x")), (0.9, (24, "z"))])
def test_a_force_channel_that_reads_low_is_the_measurement(
    tmp_path: Path, gain: float, held: tuple[int, str]
) -> None:
    """It is the same for all sensors of its recordings, and wherever the hammer strikes; taken out,
    the model fits as it is."""
    sensors = [(2, "x"), (7, "x"), (13, "x"), (24, "z")]
    drives, lines = [(7, "x"), held], np.arange(5.0, 220.0, 1.0)
    problem = frfs(tmp_path, frame(), frame(), sensors, drives, lines, gain)
    found = diagnose(problem)
    first = sized(found, "gain", gain, 0.03)
    assert first.physics == "sensor_fault" and first.place.nodes == (7,)
    assert first.says.startswith("The measurement, not the structure: the force channel at node 7")
    written = tmp_path / "updated.toml"
    written.write_text(found.updated.text, encoding="utf-8")
    assert correlate(written).fit["hold_out"]["frf_error"]["after"] < 0.1


@pytest.mark.parametrize("each", [pytest.param(1, marks=pytest.mark.proof), 2])
@pytest.mark.slow
def test_an_accelerometer_for_all_directions_of_a_node_or_for_each(
    tmp_path: Path, each: int
) -> None:
    sensors = [(2, "x"), (2, "z"), (4, "x"), (4, "z"), (7, "x"), (24, "z"), (13, "x")]
    drives, lines = [(7, "x"), (24, "z")], np.arange(5.0, 220.0, 1.0 / each)
    real = with_lumps(with_lumps(frame(), (7, 24, 13), 0.03), (2, 4), each * 0.03)
    found = diagnose(frfs(tmp_path, real, frame(), sensors, drives, lines))
    first = sized(found, "m", 0.03)
    assert first.physics == "sensor_mass"
    assert ("one for each direction that is measured" in first.says) == (each == 2)
