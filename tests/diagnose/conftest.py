"""A chain of four masses and a bar, and a laboratory that measures them: dense inversion, nothing
of the diagnosis in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from tests.cases.chain import BAR, CHAIN, load


@pytest.fixture(scope="session")
def chain(tmp_path_factory):
    return load(tmp_path_factory.mktemp("chain"), CHAIN)


@pytest.fixture(scope="session")
def bar(tmp_path_factory):
    return load(tmp_path_factory.mktemp("bar"), BAR)


@dataclass(frozen=True)
class Lab:
    """The real chain: nominal matrices with seeded scatter, and whatever a test changes in K, M,
    C."""

    K: np.ndarray
    M: np.ndarray
    C: np.ndarray
    eta: float = 0.0

    def receptance(self, frequency, zeta=0.005):
        """(lines, 4, 4), modal damping of 0.5 % or a loss factor instead, and the dashpots of C."""
        from scipy.linalg import eigh

        lam, phi = eigh(self.K, self.M)
        zeta = 0.0 if self.eta else zeta
        modal = self.M @ phi @ np.diag(2 * zeta * np.sqrt(lam)) @ phi.T @ self.M
        s = 2j * np.pi * np.asarray(frequency)[:, None, None]
        stiff = self.K * (1.0 + 1j * self.eta)
        return np.linalg.inv(s**2 * self.M + s * (self.C + modal) + stiff)


K_NOMINAL, M_NOMINAL = np.array([6.0e4, 4.0e4, 5.2e4, 3.1e4]), np.array([2.0, 1.4, 1.1, 1.7])
SCATTER_K, SCATTER_M = (
    np.array([0.006, -0.009, 0.004, 0.01]),
    np.array([-0.004, 0.003, 0.005, -0.003]),
)


def chain_matrix(values):
    """Springs or dashpots to ground and between neighbours, as a matrix."""
    a, b, c, d = values
    return np.array(
        [[a + b, -b, 0, 0], [-b, b + c, -c, 0], [0, -c, c + d, -d], [0, 0, -d, d]], dtype=float
    )


@pytest.fixture(scope="session")
def lab():
    """lab(k=…, m=…, c=…): factors on springs, kg added to floors, N·s/m across springs."""

    def make(k=(1, 1, 1, 1), m=(0, 0, 0, 0), c=(0, 0, 0, 0)):
        return Lab(
            chain_matrix(K_NOMINAL * (1 + SCATTER_K) * np.array(k)),
            np.diag(M_NOMINAL * (1 + SCATTER_M) + np.array(m)),
            chain_matrix(c),
        )

    return make


@pytest.fixture(scope="session")
def measure():
    """measure(lab, reference, use, …) → FrequencyResponse of all four floors with complex noise of
    known variance."""

    def one(
        lab, reference, use="fit", level=None, seed=1, gain=(1, 1, 1, 1), noise=0.003, step=0.2
    ):
        rng, lines = np.random.default_rng(seed), np.arange(5.0, 75.0, step)
        H = (
            -((2 * np.pi * lines[:, None]) ** 2)
            * lab.receptance(lines)[:, :, reference - 1]
            * np.array(gain)
        )
        std = noise * np.sqrt(np.mean(np.abs(H) ** 2, axis=0, keepdims=True)) * np.ones_like(H.real)
        H = H + std * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
        responses = tuple(Channel(n, "x", "acceleration") for n in (1, 2, 3, 4))
        return FrequencyResponse(
            Origin(f"{use}-{reference}-{seed}", "test", use, level),
            lines,
            H[:, :, None],
            "acceleration",
            responses,
            (Channel(reference, "x", "force"),),
            std[:, :, None] ** 2,
        )

    return one
