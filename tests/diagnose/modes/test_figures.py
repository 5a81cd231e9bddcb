"""What a diagnosis draws of tables of modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.figures import modes_shown
from cvxupdate.recordings.types import ModeTable, Origin
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
    got = modes_shown(residual.evaluate(np.zeros(1)), residual.evaluate(np.array([0.2])), [])
    assert [m.frequency for m in got.modes] == [12.0, 33.0] and all(
        m.use == "fit" for m in got.modes
    )
    assert all(m.after > m.before for m in got.modes)  # stiffer is faster
