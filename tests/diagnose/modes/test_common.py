"""What model and reference disagree on, mode by mode, taken out of other tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.modes.common import common_of
from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.nominal.mesh import MeshError
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.residual.modal import modal_residual

NODES = (2, 3, 4, 5)


def table(model, factor=1.0, bend=0.0, std=1e-4, scale=1.0):
    """The lowest three modes of the bar, frequencies times ``factor`` (modes,), entries of shapes
    moved by ``bend`` (channels,)."""
    modes = model_modes(model, 6).flexible()
    rows = [model.place[f"n{n}.z"] for n in NODES]
    shapes = modes.shapes[rows, :3].T
    shapes = shapes / np.abs(shapes).max(axis=1, keepdims=True) + bend
    f = modes.frequencies[:3] * factor
    nan = np.full(3, np.nan)
    return ModeTable(
        Origin("table", "test"),
        f,
        std * f,
        nan,
        nan,
        tuple(Channel(n, "z", "displacement") for n in NODES),
        scale * shapes,
        np.full(shapes.shape, 0.01 * abs(scale)),
        np.zeros(3, dtype=np.int64),
    )


def part(whole, rows, use):
    """Some rows of a table, to fit or held out."""
    kept = {
        name: getattr(whole, name)[rows]
        for name in ("frequency", "frequency_std", "damping", "damping_std", "pairs", "shapes")
    }
    std = whole.shape_std[rows]
    return replace(whole, **kept, shape_std=std, origin=replace(whole.origin, use=use))


def test_a_table_of_the_reference_itself_becomes_what_the_model_says(bar):
    _, model = bar
    off, bend = np.array([0.93, 1.04, 0.98]), np.array([0.05, 0.0, -0.08, 0.03])
    common = common_of(model, [table(model, off, bend)])
    again = table(model, off, bend, scale=-3.0)  # scaled and turned, as shapes are
    start = modal_residual(model, [again], (), False).evaluate(model.zero())
    found = common.without(again, start.places[0], start)
    wanted = table(model)
    assert found.frequency == pytest.approx(wanted.frequency, rel=1e-9)
    across = np.abs(np.sum(found.shapes * wanted.shapes, axis=1))
    sizes = [np.linalg.norm(t.shapes, axis=1) for t in (found, wanted)]
    assert across == pytest.approx(sizes[0] * sizes[1], rel=5e-3)
    assert np.all(found.frequency_std > 1e-3 * found.frequency)


def test_a_change_stays_and_a_model_that_is_far_off_may_get_it_wrong(bar):
    _, model = bar
    moved = np.array([0.97, 1.0, 0.99])
    for off, least, most in ((1.0, 0.08, 0.13), (1.1, 0.4, 0.6)):
        common = common_of(model, [table(model, off)])
        today = table(model, off * moved)
        start = modal_residual(model, [today], (), False).evaluate(model.zero())
        found = common.without(today, start.places[0], start)
        assert found.frequency / table(model).frequency == pytest.approx(moved, rel=1e-9)
        assert least * 0.03 <= found.frequency_std[0] / found.frequency[0] <= most * 0.033


def test_modes_that_the_reference_lacks_stay_as_they_are(bar):
    _, model = bar
    common = common_of(model, [table(model, 1.02)])
    fewer = replace(common, modes={k: v for k, v in common.modes.items() if k != 1})
    today = table(model, 1.02)
    start = modal_residual(model, [today], (), False).evaluate(model.zero())
    found = fewer.without(today, start.places[0], start)
    assert found.frequency[1] == today.frequency[1] and np.isnan(found.frequency_std[1])
    assert found.frequency[0] == pytest.approx(table(model).frequency[0], rel=1e-9)


def test_a_mode_that_looks_like_another_than_its_partner_is_left_as_it_is(bar):
    """What comes with a hidden oscillator is paired with some mode of the model, but is not the
    reference's that is paired with it."""
    _, model = bar
    common = common_of(model, [table(model, 1.02)])
    today = table(model, 1.02)
    shapes = today.shapes.copy()
    shapes[1] = np.linalg.qr(today.shapes.T, mode="complete")[0][:, 3]  # unlike all three
    today = replace(today, shapes=shapes)
    start = modal_residual(model, [today], (), False).evaluate(model.zero())
    found = common.without(today, [0, 1, 2], start)
    assert found.frequency[1] == today.frequency[1] and np.isnan(found.frequency_std[1])
    assert found.frequency[0] == pytest.approx(table(model).frequency[0], rel=1e-9)


def test_what_the_reference_held_out_is_common_to_what_is_held_out(bar):
    _, model = bar
    whole = table(model, 1.02)
    common = common_of(model, [part(whole, [0, 1], "fit"), part(whole, [2], "hold-out")])
    start = modal_residual(model, [whole], (), False).evaluate(model.zero())
    fitted, held = (c.without(whole, [0, 1, 2], start) for c in (common, common.held))
    wanted = table(model).frequency
    assert fitted.frequency[2] == whole.frequency[2]
    assert held.frequency == pytest.approx(wanted, rel=1e-9)


def test_what_is_held_out_is_paired_by_itself(bar):
    """The own mode of a hidden oscillator takes the place of the model's third in what was fitted;
    the reference's third, which both states hold out, is known all the same (the laboratory's
    4745: what was held out refuted the truth)."""
    _, model = bar
    whole = table(model, 1.02)
    common = common_of(model, [part(whole, [0, 1], "fit"), part(whole, [2], "hold-out")])
    swings = part(whole, [0, 1, 2], "fit")
    first, _, third = (x / np.linalg.norm(x) for x in whole.shapes)
    shapes = np.vstack([whole.shapes[:2], 0.65 * third - 0.76 * first])
    swings = replace(swings, frequency=whole.frequency * [1.0, 1.0, 0.9], shapes=shapes)
    held = part(whole, [2], "hold-out")
    start = modal_residual(model, [swings], [held], False).evaluate(model.zero())
    assert start.places[0].tolist() == [0, 1, 2] and start.places[1].tolist() != [2]
    found = prepared(model, [swings, held], MeshError(np.zeros(0), np.zeros(0)), common)
    assert found.fit[0].frequency[2] == swings.frequency[2]
    assert found.hold[0].frequency == pytest.approx(table(model).frequency[2:], rel=1e-9)
