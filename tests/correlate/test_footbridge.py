"""A real footbridge (smu-modal-data): 946 DOFs from another FE program, 58 sensors, 5 measured
modes."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.io import loadmat
from scipy.sparse.linalg import eigsh

from cvxupdate.correlate import correlation, off_diagonal
from cvxupdate.reduction import guyan, irs, partition, reduced_modes, serep, visibility

FOLDER = Path(os.environ.get("CVXUPDATE_DATA", "")) / "smu-modal-data"
pytestmark = pytest.mark.skipif(
    not os.environ.get("CVXUPDATE_DATA") or not FOLDER.is_dir(),
    reason="smu-modal-data is not under CVXUPDATE_DATA",
)


@pytest.fixture(scope="module")
def bridge():
    model, test = (
        loadmat(FOLDER / "SteelPedestrianBridgeExp.mat"),
        loadmat(FOLDER / "ExpModeInfo_FEM.mat"),
    )
    K, M = (sparse.csc_matrix(model[name]) for name in ("K_whole", "M0"))
    K, M = (K + K.T) / 2, (M + M.T) / 2
    value, phi = eigsh(K, 12, M, sigma=0.0, v0=np.ones(K.shape[0]))
    return (
        K,
        M,
        np.sqrt(value) / (2 * np.pi),
        phi,
        model["measDOFs"].ravel().astype(int) - 1,
        np.sqrt(test["lambdaExp"].ravel()) / (2 * np.pi),
        test["psiExp_m"],
    )


def test_first_errors_of_the_footbridge(bridge):
    K, M, f, phi, sensors, f_x, phi_x = bridge
    out = correlation(f, phi[sensors], f_x, phi_x, K=K, M=M, transformation=serep(phi, sensors))
    assert out.pairing.model.tolist() == [1, 0, 2, 3, 4]  # the first two are swapped
    assert out.frequency_error_percent_mean == pytest.approx(8.06, abs=0.005)
    assert np.allclose(out.pairing.mac, [0.97, 0.99, 0.96, 0.97, 0.90], atol=0.006)
    assert out.mac_mean == pytest.approx(0.956, abs=0.0005)
    assert off_diagonal(out.mass_orthogonality) < 0.1
    assert np.all(out.comac[np.isfinite(out.comac)] <= 1.0)


def test_58_sensors_see_twelve_modes_and_reduce_the_model_well(bridge):
    K, M, f, phi, sensors, *_ = bridge
    seen = visibility(phi, sensors)
    assert seen.rank == 12 and seen.condition < 5 and seen.confused == ()
    split = partition(K, M, sensors)
    error = [np.max(reduced_modes(make(split), K, M, 5)[0] / f[:5] - 1) for make in (guyan, irs)]
    assert error[0] < 0.03 and 0 <= error[1] < 1e-4
