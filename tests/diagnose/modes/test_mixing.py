"""How far close modes may be turned into each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from cvxupdate.diagnose.modes.common import common_of
from cvxupdate.diagnose.modes.mixing import mixed
from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.nominal.mesh import MeshError
from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY, REPEATED
from cvxupdate.residual.modal import modal_residual
from tests.cases.structures import PORTAL, measured, portal, structure

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")


def seen(scale=1.0):
    """(table of modes 1 to 4 of a portal, the comparison with the model itself)."""
    m = structure(portal(), PORTAL)[1]
    table = measured(m, m.zero(), [1, 2, 3, 4], channels=CHANNELS)
    table = replace(table, shapes=scale * table.shapes, frequency_std=1e-9 * table.frequency)
    return table, modal_residual(m, [table], (), False).evaluate(m.zero())


def test_as_a_coupling_of_two_modes_turns_them():
    """Against the eigenvectors of matrices in which two modes are coupled by a hundredth of what a
    sound model may miss, one other mode after the other."""
    table, point = seen(-3.0)
    m, modes = point.residual.model, point.modes
    K, M = (x.toarray() for x in (point.matrices.K, point.matrices.M))
    rows = [m.place[c] for c in CHANNELS]
    for i in range(4):
        phi, lam = modes.shapes[:, i], modes.eigenvalues[i]
        squares, scale = np.zeros(len(rows)), np.abs(phi[rows]).max() / 3.0
        for b in range(len(modes.eigenvalues)):
            if b == i:
                continue
            e = 2.0 * FREQUENCY_DISCREPANCY * np.sqrt(lam * modes.eigenvalues[b]) / 100.0
            both = np.outer(M @ phi, M @ modes.shapes[:, b])
            _, V = eigh(K + e * (both + both.T), M)
            now = V[:, np.argmax(np.abs(V.T @ M @ phi))]
            now = now * np.sign(now @ M @ phi)
            squares += (100.0 * (now - phi)[rows] / scale) ** 2
        # a coupling turns a mode by less than to first order, the more so the nearer the other is
        assert mixed(point, 0, table)[i] == pytest.approx(np.sqrt(squares), rel=0.05, abs=1e-4)


def test_noise_that_moves_frequencies_turns_modes_as_far():
    """As much as the model's own discrepancy of that size, and both together in mean square."""
    table, point = seen()
    calm = replace(table, frequency_std=0.0 * table.frequency)
    noisy = replace(table, frequency_std=0.004 * table.frequency)
    by_noise = mixed(point, 0, noisy, missed=0.0)
    assert by_noise == pytest.approx(mixed(point, 0, calm, missed=0.004), rel=1e-12)
    assert np.all(mixed(point, 0, calm, missed=0.0) == 0.0)
    assert mixed(point, 0, noisy, missed=0.003) == pytest.approx(
        mixed(point, 0, calm, missed=0.005), rel=1e-12
    )


def test_nearness_is_what_was_measured_where_both_were():
    table, point = seen()
    apart = mixed(point, 0, table)
    f = table.frequency.copy()
    f[3] = 1.0001 * f[2]
    near = replace(point.residual, fit=(replace(table, frequency=f),))
    close = mixed(replace(point, residual=near), 0, near.fit[0])
    rows = [point.residual.model.place[c] for c in CHANNELS]
    other = np.abs(point.modes.shapes[rows, 3]) / np.abs(point.modes.shapes[rows, 2]).max()
    assert np.all(close[2] >= 0.999 * other)  # turned into it wholly
    assert np.all(apart[2] < 0.3 * other.max())
    assert close[0] == pytest.approx(apart[0], rel=0.5)  # further away it hardly matters


def test_beside_a_reference_close_modes_turn_by_what_a_test_repeated_would():
    """Two modes 0.2 % apart told a loose joint as 1507 ± 50 N·m/rad for 1190 (the laboratory's
    4849): their shapes are turned from day to day though the reference has both."""
    table, point = seen()
    f = table.frequency.copy()
    f[3] = 1.002 * f[2]
    m, close = point.residual.model, replace(table, frequency=f)
    common = common_of(m, [close])
    found = prepared(m, [close], MeshError(np.zeros(0), np.zeros(0)), common).fit[0]
    turned = mixed(modal_residual(m, [close], (), False).evaluate(m.zero()), 0, close, REPEATED)
    assert found.shape_std is not None and np.all(found.shape_std >= turned)
    assert turned[2].max() > 0.2 > 5.0 * turned[0].max()


def test_without_shapes_there_is_nothing_to_turn():
    table, point = seen()
    bare = replace(table, shapes=None, shape_std=None, channels=())
    assert mixed(point, 0, bare).shape == (4, 0)
