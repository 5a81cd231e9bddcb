"""The response of a model with modal damping is that of a dense solve."""

from __future__ import annotations

import numpy as np
import pytest
from cvxupdate.diagnose.responses.lines import frf_lines
from cvxupdate.diagnose.responses.synthesis import basis, respond, sensor_rows

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.signals import smooth
from cvxupdate.errors import RecordingError
from cvxupdate.fe.rigid import rigid_body_modes


def signal_of(recording, epsilon=0.03):
    return smooth(frf_lines(recording), epsilon)


@pytest.mark.parametrize("further", [False, True])
def test_response_is_that_of_a_dense_solve(chain, lab, measure, further):
    _, model = chain
    m = undamped(model).matrices(undamped(model).zero())
    K, M = m.K.toarray(), m.M.toarray()
    signal = signal_of(measure(lab(), 3), 0.01)
    modes = basis(m.K, m.M, 80.0, rigid_body_modes(model, m.K, m.M))
    zeta = np.array([0.004, 0.01, 0.007, 0.02])
    C, D = np.zeros((4, 4)), np.zeros((4, 4))
    if further:
        C[1:3, 1:3] = 9.0 * np.array([[1, -1], [-1, 1]])
        D[0, 0] = 800.0
    phi = modes.shapes
    response = respond(
        signal,
        modes,
        sensor_rows(model, signal.sensors),
        sensor_rows(model, signal.inputs),
        zeta,
        phi.T @ C @ phi if further else None,
        phi.T @ D @ phi if further else None,
    )
    modal = M @ phi @ np.diag(2 * zeta * np.sqrt(modes.eigenvalues)) @ phi.T @ M
    s = signal.s[:, None, None]
    dense = s**2 * np.linalg.inv(s**2 * M + s * (modal + C) + 1j * D + K)
    np.testing.assert_allclose(response.raw[:, :, 0], dense[:, :, 2], rtol=1e-9)


def test_a_held_sensor_reads_nothing_and_a_strange_one_is_refused(bar):
    _, model = bar
    assert sensor_rows(model, ["n1.z", "n3.z"]).tolist()[0] == -1
    with pytest.raises(RecordingError, match="n77"):
        sensor_rows(model, ["n77.z"])
