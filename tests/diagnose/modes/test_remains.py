"""Which modes are left unexplained."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.remains import remains
from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.nominal.mesh import NONE
from cvxupdate.residual.modal import modal_residual
from tests.diagnose.modes.test_common import table


def left_of(model, factor):
    tables = prepared(model, [table(model, np.array(factor))], NONE)
    point = modal_residual(model, tables.fit, (), False).evaluate(model.zero())
    return remains(point), tables.fit[0].frequency


def test_modes_that_are_off_are_named_farthest_first(bar):
    says, f = left_of(bar[1], [1.0, 1.02, 0.97])
    first, second = f"{f[2]:.4g} Hz (+3.1 %)", f"{f[1]:.4g} Hz (−2 %)"
    assert says == f"What is left is mostly at {first} and {second} (model against measured)."


def test_nothing_is_said_within_two_deviations(bar):
    assert left_of(bar[1], [1.0, 1.004, 0.997])[0] == ""


def test_modes_without_a_partner_say_nothing(bar):
    _, model = bar
    tables = prepared(model, [table(model, np.array([1.0, 1.02, 1.0]))], NONE)
    residual = modal_residual(model, tables.fit, (), False)
    start = replace(residual.start, places=(np.array([0, -1, 2]),))
    assert remains(replace(residual, start=start).evaluate(model.zero())) == ""
