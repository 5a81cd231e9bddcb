"""Measured modes that are none of the model's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.correlate.mac import mac
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.foreign import foreign, was_there, without
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from cvxupdate.residual.modal import modal_residual
from cvxupdate.study import diagnose
from tests.cases.cantilever import load, text

SEEN, MODES, AT = tuple(range(3, 14)), 5, 3  # nodes; modes of the bar; place of the other one
CHANNELS = ", ".join(
    f'{{ column = {k}, quantity = "acceleration", node = {n}, dof = "z" }}'
    for k, n in enumerate(SEEN)
)


def problem(folder, lump: float = 0.0, noise: float = 0.01, across=None):
    """A cantilever with five bending modes and, between them, one that moves across: noise in the
    direction that was measured. ``lump``: kg at node 9 that the model lacks."""
    extra = f'[[model.elements]]\ntype = "mass"\nrows = [{{ id = 90, nodes = [9], m = {lump} }}]'
    _, real = load(folder, text(extra=extra if lump else ""))
    modes, rng = model_modes(real, MODES), np.random.default_rng(5)
    f = modes.frequencies[:MODES]
    rows = [real.place[f"n{n}.z"] for n in SEEN]
    shapes = modes.shapes[rows, :MODES].T
    shapes = shapes / np.max(np.abs(shapes), axis=1, keepdims=True)
    shapes = shapes + noise * rng.standard_normal(shapes.shape)
    across = rng.uniform(-1.0, 1.0, len(SEEN)) if across is None else across
    f = np.insert(f, AT, 0.5 * (f[AT - 1] + f[AT]))
    shapes = np.insert(shapes, AT, across, axis=0)
    table = ", ".join(
        f"{{ frequency = {v:.7g}, frequency_std = {1e-3 * v:.3g}, "
        f"shape = {np.round(s, 5).tolist()}, shape_std = {noise} }}"
        for v, s in zip(f, shapes, strict=True)
    )
    return load(folder, text(table).rstrip() + f"\nchannels = [{CHANNELS}]\n")


def point_of(spec, model):
    (table,) = load_recordings(spec)
    return table, modal_residual(model, (table,), (), True).evaluate(model.zero())


def test_a_shape_that_no_mode_has(tmp_path) -> None:
    table, point = point_of(*problem(tmp_path))
    ((row, best),) = foreign(point)[0]
    assert row == AT and best < 0.6
    rest = without(table, [row])
    assert rest is not None and len(rest.frequency) == MODES
    assert np.allclose(rest.frequency, np.delete(table.frequency, AT))
    assert rest.shapes is not None and rest.shapes.shape == (MODES, len(SEEN))


def test_a_shape_that_another_measured_mode_has_is_nobody_s(tmp_path) -> None:
    """It resembles the first mode by more than a doubtful pair does; that one was measured, too."""
    _, real = load(tmp_path, text())
    first = model_modes(real, MODES).shapes[[real.place[f"n{n}.z"] for n in SEEN], 0]
    first = first / np.abs(first).max()
    like = first - 1.7 * np.linspace(0.0, 1.0, len(SEEN)) ** 3 * (np.arange(len(SEEN)) > 8)
    table, point = point_of(*problem(tmp_path, across=like))
    at = point.modes.shapes[[real.place[f"n{n}.z"] for n in SEEN]]
    assert 0.6 < float(np.max(mac(at, like[:, None]))) < 0.9
    assert [row for row, _ in foreign(point)[0]] == [AT]
    assert was_there(table, AT, [table])
    rest = without(table, [AT])
    assert rest is not None and not was_there(table, AT, [rest])
    assert not was_there(table, AT, [])


def test_nothing_where_others_are_doubtful_too(tmp_path) -> None:
    """What is missing bends shapes: then none is left out for it."""
    _, point = point_of(*problem(tmp_path, noise=0.3))
    assert foreign(point) == {}


def test_it_is_left_out_and_said_where_all_others_are_explained(tmp_path) -> None:
    problem(tmp_path)
    found = diagnose(tmp_path / "problem.toml")
    assert found.verdict == "consistent" and "was left out" in found.says


def test_a_row_is_no_excuse_where_something_is_missing(tmp_path) -> None:
    spec, model = problem(tmp_path, lump=0.3)
    evidence = gathered(spec, model, load_recordings(spec), lambda text: None)
    assert isinstance(evidence, ModesEvidence) and not evidence.tables.gone


@pytest.mark.parametrize("gone", [(0,), (2, 4)])
def test_pairs_are_those_of_the_file(gone) -> None:
    from cvxupdate.diagnose.modes.tables import Tables

    tables = Tables((), (), (), gone={0: dict.fromkeys(gone, "left out")})
    found = tables.pairs(0, [3, 4, -1, 6], 2)
    assert [found[i] for i in gone] == [0] * len(gone)
    assert [v for i, v in enumerate(found) if i not in gone] == [2, 3, 0, 5]


def test_of_two_modes_with_one_shape_the_nearer_was_there(tmp_path) -> None:
    """What hangs from a structure makes two modes of one: the farther came."""
    (table,) = load_recordings(problem(tmp_path)[0])
    assert table.shapes is not None
    shapes = table.shapes.copy()
    shapes[AT] = shapes[0]
    frequency = table.frequency.copy()
    frequency[AT] = 1.2 * frequency[0]
    both = replace(table, shapes=shapes, frequency=frequency)
    before = without(table, [AT])
    assert before is not None
    assert was_there(both, 0, [before]) and not was_there(both, AT, [before])
