"""What a diagnosis draws of tables of modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.figures import modes_shown, with_counterparts
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.residual.modal import modal_residual
from tests.cases.three_masses import chain


def test_modes_before_and_after() -> None:
    model = replace(chain(), modal_damping=())
    table = ModeTable(
        Origin("t", "t"),
        np.array([12.0, 33.0]),
        np.full(2, 0.1),
        np.full(2, np.nan),
        np.full(2, np.nan),
        (),
        None,
        None,
        np.array([1, 2]),
    )
    residual = modal_residual(model, (table,), (), False)
    raw = replace(table, frequency=np.array([11.0, 30.0]))  # with the mesh's error
    before, after = residual.evaluate(np.zeros(1)), residual.evaluate(np.array([0.2]))
    got = modes_shown(before, after, [raw])
    assert [m.frequency for m in got.modes] == [11.0, 30.0]
    assert all(m.use == "fit" for m in got.modes)
    for m, f, g, x in zip(
        got.modes, before.frequencies(0), after.frequencies(0), (12.0, 33.0), strict=True
    ):
        assert np.allclose([m.before, m.after], [f / m.frequency - 1.0, g / x - 1.0])
    assert np.all(after.frequencies(0) > before.frequencies(0))  # stiffer is faster


def test_what_the_model_has_no_mode_for_is_not_shown_beside_one_that_is_left_over(bar):
    """A mode that came with something hidden, paired by elimination with one far up."""
    _, model = bar
    modes = model_modes(model, 8).flexible()
    rows = [model.place[f"n{n}.z"] for n in (2, 3, 4, 5)]
    shapes = modes.shapes[rows, :3].T.copy()
    f = modes.frequencies[:3].copy()
    nan = np.full(3, np.nan)
    table = ModeTable(
        Origin("table", "test"),
        f,
        1e-3 * f,
        nan,
        nan,
        tuple(Channel(n, "z", "displacement") for n in (2, 3, 4, 5)),
        shapes,
        None,
        np.zeros(3, dtype=np.int64),
    )
    point = modal_residual(model, [table], (), False).evaluate(model.zero())
    assert with_counterparts(point).places[0].tolist() == [0, 1, 2]
    left_over = replace(point, places=(np.array([0, 1, 7]),))
    assert with_counterparts(left_over).places[0].tolist() == [0, 1, -1]
    alike = replace(table, shapes=np.vstack([shapes[:2], modes.shapes[rows, 7]]))
    far = replace(left_over, residual=replace(point.residual, fit=(alike,)))
    assert with_counterparts(far).places[0].tolist() == [0, 1, 7]  # off, but it is that mode
