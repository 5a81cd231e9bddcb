"""What a strong damper does to tables is taken out of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.coupled import _moved
from cvxupdate.diagnose.results import Damper
from cvxupdate.diagnose.settings import UNSTATED_SHAPE
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.residual.modal import modal_residual


def test_frequencies_are_moved_and_shapes_less_sure(chain) -> None:
    """Deviations that nobody stated stay the usual ones; what is held out comes last."""
    model = replace(chain[1], modal_damping=())
    m = model.matrices(model.zero())
    context = SearchContext(model, m.K, m.M, 60.0, 8.0, (), (), lambda node, kind: model, 0.004)
    damper = candidates_of(context, ("viscous_damper",))[0]
    assert damper.change is not None
    channels = tuple(Channel(n, "x", "displacement") for n in (1, 2, 3, 4))
    f = np.array([10.0, 30.0])
    table = ModeTable(
        Origin("t", "t"),
        f,
        0.01 * f,
        0.1 * np.ones(2),
        np.full(2, np.nan),
        channels,
        np.array([[0.3, 0.6, 0.9, 1.0], [1.0, 0.9, -0.2, -1.0]]),
        None,
        np.array([1, 2]),
    )
    point = modal_residual(model, (table,), (), True).evaluate(model.zero())
    found = _moved(point, [table], Damper(damper, 0.0, 0.0, 0.0))
    assert found is not None and found[1] < 1e-12
    (same,), _ = found
    assert np.allclose(same.frequency, f) and np.allclose(same.shape_std, UNSTATED_SHAPE)
    found = _moved(point, [table], Damper(damper, 40.0, 0.0, 0.0))
    assert found is not None and found[1] > 1e-4
    (other,), most = found
    assert np.isclose(np.max(np.abs(f / other.frequency - 1.0)), most)
    assert other.shape_std is not None and np.all(other.shape_std > UNSTATED_SHAPE)
