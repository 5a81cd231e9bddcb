"""Lines at which a test's accuracy is looked at: as many as the model allows in a few seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.residual.frf_data import frf_data
from cvxupdate.spec import spec_of
from cvxupdate.study import open_problem
from cvxupdate.update.rfm_accuracy import FILLED, LINES, _lines

SIZE = 900


@pytest.mark.parametrize(
    ("zeta", "most"), [(0.01, int(FILLED / SIZE**3)), (0.0, LINES)], ids=["full C", "sparse C"]
)
def test_a_full_damping_matrix_is_looked_at_on_fewer_lines(zeta: float, most: int) -> None:
    springs = [{"id": i, "nodes": [i, i + 1], "k": 1e6} for i in range(1, SIZE + 1)]
    masses = [{"id": SIZE + i, "nodes": [i + 1], "m": 1.0} for i in range(1, SIZE + 1)]
    model = {
        "dofs": ["x"],
        "nodes": [{"id": i, "x": float(i)} for i in range(1, SIZE + 2)],
        "elements": [
            {"type": "spring", "dof": "x", "rows": springs},
            {"type": "mass", "rows": masses},
        ],
        "supports": [{"nodes": [1], "dofs": ["x"]}],
    }
    update = {"method": "rfm", "parameters": [{"elements": [1], "of": "k"}]}
    built = open_problem(spec_of({"model": model, "update": update}))[1]
    built = replace(built, modal_damping=(zeta,))
    f = np.linspace(1.0, 100.0, 500)
    recording = FrequencyResponse(
        Origin("test", "test.npz"),
        f,
        np.ones((500, 1, 1), dtype=complex),
        "displacement",
        (Channel(9, "x", "displacement"),),
        (Channel(5, "x", "force"),),
    )
    found = _lines(built, frf_data(recording, built), np.arange(3))
    assert most - 3 <= len(found) <= most and {0, 1, 2} <= set(found.tolist())
