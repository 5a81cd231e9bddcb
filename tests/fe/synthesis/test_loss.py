"""The loss of a mode: alike at its resonance whichever the kind."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.fe.synthesis import responses
from cvxupdate.fe.synthesis.loss import Loss
from tests.cases.chain import CHAIN, load


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_at_its_resonance_a_mode_loses_the_same(share):
    lam, zeta = np.array([4.0, 900.0]), np.array([0.01, 0.03])
    loss, s = Loss(zeta, share), 1j * np.sqrt(lam)
    d = s**2 + loss.viscous(lam) * s + loss.stiffness(lam)
    assert d == pytest.approx(2j * zeta * lam)
    assert loss.first(1).stiffness(lam[:1]) == pytest.approx(loss.stiffness(lam)[:1])


@pytest.mark.parametrize("way", ["direct", "modal", "reduced"])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_the_share_that_a_file_states_is_in_every_way_through(tmp_path, way, share):
    text = CHAIN.replace("zeta = 0.005", f"zeta = [0.02, 0.05]\nhysteretic = {share}")
    _, model = load(tmp_path, text)
    m = model.matrices()
    K, M = m.K.toarray(), m.M.toarray()
    lam, phi = np.linalg.eig(np.linalg.solve(M, K))
    order = np.argsort(lam)
    lam, phi = lam[order], phi[:, order]
    phi = phi / np.sqrt(np.einsum("im,ij,jm->m", phi, M, phi))
    s = 2j * np.pi * np.array([3.0, 21.0, 40.0])
    loss = Loss(np.array([0.02, 0.05, 0.05, 0.05]), share)
    d = s[:, None] ** 2 + loss.viscous(lam) * s[:, None] + loss.stiffness(lam)
    wanted = np.einsum("im,pm,jm->pij", phi, 1.0 / d, phi)
    found = responses(model, s, np.arange(4), np.arange(4), way=way)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12 * np.abs(wanted).max())


def test_a_share_is_between_none_and_all(tmp_path):
    with pytest.raises(Exception, match="hysteretic"):
        load(tmp_path, CHAIN.replace("zeta = 0.005", "zeta = 0.005\nhysteretic = 1.5"))
