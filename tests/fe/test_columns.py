"""A few columns of the stiffness are those of the whole matrix."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.columns import stiffness_columns
from tests.cases.cantilever import load, text
from tests.cases.fine_plate import Plate, real


def test_columns_are_those_of_the_matrix(tmp_path):
    for model in (real(tmp_path, Plate(), (2, 1)), load(tmp_path, text())[1]):
        rows = np.array([0, 3, model.size - 1])
        K = model.matrices(model.zero()).K[:, rows].toarray()
        found = stiffness_columns(model, rows)
        np.testing.assert_allclose(found, K, atol=1e-12 * np.abs(K).max())
