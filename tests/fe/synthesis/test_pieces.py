"""The response of a model with modal damping is that of a dense solve."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.errors import RecordingError
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.fe.synthesis import pieces
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.pieces import basis, respond, sensor_rows
from tests.cases.chain import BAR, CHAIN, load


def driven(sensors, inputs):
    """A unit of one drive, accelerations."""
    s = 2j * np.pi * np.arange(5.0, 75.0, 0.4)
    Y = np.ones((len(s), len(sensors), 1))
    U = np.ones((len(s), 1, 1), dtype=complex)
    return Signal("a", "fit", None, s, None, Y.astype(complex), U, Y, 2, sensors, inputs)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("further", [False, True])
def test_response_is_that_of_a_dense_solve(tmp_path, further, share):
    _, model = load(tmp_path, CHAIN)
    m = undamped(model).matrices(undamped(model).zero())
    K, M = m.K.toarray(), m.M.toarray()
    signal = driven(("n1.x", "n2.x", "n3.x", "n4.x"), ("n3.x",))
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
        Loss(zeta, share),
        phi.T @ C @ phi if further else None,
        phi.T @ D @ phi if further else None,
    )
    omega = np.sqrt(modes.eigenvalues)
    C = C + M @ phi @ np.diag(2 * (1.0 - share) * zeta * omega) @ phi.T @ M
    D = D + M @ phi @ np.diag(2 * share * zeta * omega**2) @ phi.T @ M
    s = signal.s[:, None, None]
    dense = s**2 * np.linalg.inv(s**2 * M + s * C + 1j * D + K)
    np.testing.assert_allclose(response.raw[:, :, 0], dense[:, :, 2], rtol=1e-9)


def test_damping_that_is_symmetric_but_for_rounding_is_taken_by_its_few_columns(
    tmp_path, monkeypatch
):
    """φᵀ C φ of a product of matrices is symmetric to the last digits only; a gyroscopic one is
    not."""
    _, model = load(tmp_path, CHAIN)
    m = undamped(model).matrices(undamped(model).zero())
    signal = driven(("n1.x", "n4.x"), ("n3.x",))
    modes = basis(m.K, m.M, 80.0, rigid_body_modes(model, m.K, m.M))
    places = [sensor_rows(model, x) for x in (signal.sensors, signal.inputs)]
    dense = []
    real = pieces._dynamic
    monkeypatch.setattr(pieces, "_dynamic", lambda *a: dense.append(1) or real(*a))
    one = np.outer(modes.shapes[1], modes.shapes[1]) * 9.0
    blurred = one * (1.0 + 1e-15 * np.arange(16.0).reshape(4, 4))
    assert not np.array_equal(blurred, blurred.T)
    loss, nothing = Loss(np.full(4, 0.01)), np.zeros((4, 4))
    found = [respond(signal, modes, *places, loss, C, nothing).raw for C in (one, blurred)]
    np.testing.assert_allclose(*found, rtol=1e-12)
    assert not dense
    turning = np.array(one)
    turning[0, 1] += 3.0
    turning[1, 0] -= 3.0
    respond(signal, modes, *places, loss, turning, nothing)
    assert dense


def test_a_held_sensor_reads_nothing_and_a_strange_one_is_refused(tmp_path):
    _, model = load(tmp_path, BAR)
    assert sensor_rows(model, ["n1.z", "n3.z"]).tolist()[0] == -1
    with pytest.raises(RecordingError, match="n77"):
        sensor_rows(model, ["n77.z"])
