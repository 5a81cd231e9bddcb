"""Frequencies, shapes and damping ratios of a table, each by itself."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.modes.kinds import (
    bulk,
    chance_of_one,
    chi_square,
    kinds_of,
    whole_within,
)
from cvxupdate.diagnose.settings import CHANCE
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from tests.cases.cantilever import NODES, load, text
from tests.cases.plain_evidence import PlainFit

SENSORS = range(2, len(NODES) + 1)
MODES = 5
STD = 0.01  # of an entry of a shape


def problem(folder, off, shapes=True, damping=None, only=""):
    """Five modes of the bar itself at twelve nodes, frequencies off by parts ``off``; ``only`` one
    type of effect is sought."""
    _, real = load(folder, text())
    modes, rng = model_modes(real, MODES), np.random.default_rng(7)
    at = [real.place[f"n{n}.z"] for n in SENSORS]
    rows = []
    for k in range(MODES):
        f = modes.frequencies[k] * (1.0 + off[k])
        shape = modes.shapes[at, k] / np.abs(modes.shapes[at, k]).max()
        shape = np.round(shape + STD * rng.standard_normal(len(at)), 5).tolist()
        seen = f", shape = {shape}, shape_std = {STD}" if shapes else ""
        lost = "" if damping is None else f", damping = {damping[k]}"
        rows.append(f"{{ frequency = {f:.8g}, frequency_std = {3e-4 * f:.3g}{lost}{seen} }}")
    channels = ", ".join(
        f'{{ column = {i}, quantity = "displacement", node = {n}, dof = "z" }}'
        for i, n in enumerate(SENSORS)
    )
    hold = f"channels = [{channels}]\n" * shapes
    hold += f'[diagnose]\nphysics = ["{only}"]\n' if only else ""
    return load(folder, text(", ".join(rows), hold=hold))


def evidence_of(spec, model):
    return gathered(spec, model, load_recordings(spec), lambda said: None)


OFF = np.array([0.009, -0.009, 0.009, -0.009, 0.009])  # three times what a sound model may miss


def test_frequencies_are_not_drowned_by_shapes(tmp_path):
    """All figures together are within chance, the five frequencies are not."""
    evidence = evidence_of(*problem(tmp_path, OFF))
    base = evidence.bases[-1]
    assert whole_within(base) and not evidence.clear(base)
    assert not evidence.explained(base, evidence.errors(base))
    assert evidence.departs(base).startswith("the 5 natural frequencies (3 times")
    frequencies, shapes = kinds_of((base.point,), evidence.tables.kinds)
    assert frequencies.departs and not shapes.departs
    assert frequencies.squares + shapes.squares <= base.cost


def test_a_sound_model_departs_in_no_kind(tmp_path):
    evidence = evidence_of(*problem(tmp_path, 0.2 * OFF))
    base = evidence.bases[-1]
    assert evidence.departs(base) == "" and evidence.clear(base)


def test_of_frequencies_alone_the_whole_speaks(tmp_path):
    evidence = evidence_of(*problem(tmp_path, OFF, shapes=False))
    base = evidence.bases[-1]
    assert evidence.tables.kinds == 1
    assert not whole_within(base) and not evidence.clear(base) and evidence.departs(base) == ""


def test_kinds_share_one_rate_of_false_alarms():
    """Each is as likely to alarm as the others, all together as the whole is by itself."""
    assert chance_of_one(1) == CHANCE
    for kinds in (2, 3):
        assert kinds * (1.0 - chance_of_one(kinds)) == pytest.approx(1.0 - CHANCE)
    rng = np.random.default_rng(1)
    level = chi_square(chance_of_one(2), 11)
    alarms = (rng.standard_normal((20000, 11)) ** 2).sum(axis=1) > level
    assert alarms.mean() == pytest.approx(0.5 * (1.0 - CHANCE), abs=2e-3)


def test_what_departs_and_is_not_explained_is_undetermined_and_said(tmp_path):
    spec, model = problem(tmp_path, OFF, only="axial_preload")
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    assert said["verdict"] == "undetermined" and not said["findings"]
    assert said["says"].startswith("Taken by themselves the 5 natural frequencies (3 times their")
    assert any(line.startswith("Taken by themselves the 5") for line in said["evidence"])


@pytest.mark.parametrize(
    ("ratios", "verdict"),
    [((0.005, 0.006, 0.004, 0.005, 0.0055), "consistent"),
     ((0.002, 0.03, 0.002, 0.03, 0.002), "undetermined")],
)  # fmt: skip
def test_damping_ratios_are_a_kind_too(tmp_path, ratios, verdict):
    spec, model = problem(tmp_path, 0.0 * OFF, damping=ratios)
    assert evidence_of(spec, model).tables.kinds == 3
    said = diagnose_problem(spec, model, load_recordings(spec)).to_json()
    assert said["verdict"] == verdict and not said["findings"]
    if verdict == "undetermined":
        assert "but not the damping ratios" in said["says"]


def test_the_bulk_of_a_misfit_is_without_the_mode_that_is_farthest_off(tried):
    """Its frequency and its shape; what a prior makes stays."""
    _, base, _ = tried
    point = base.point
    values, weights, _ = point.differences
    squares = np.abs(weights * values) ** 2
    modes = len(point.paired)
    by_mode = squares[:modes].copy()
    at = modes
    for _, i, _, sensors, _, _ in point.shape_rows() if point.residual.shapes else ():
        by_mode[i] += squares[at : at + len(sensors)].sum()
        at += len(sensors)
    assert at == len(squares)
    assert bulk(base) == pytest.approx((base.cost - by_mode.max()) / base.rows)
    assert bulk(PlainFit(3.0)) == 3.0
