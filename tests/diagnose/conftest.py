"""A chain of four masses and a bar, and a laboratory that measures them: dense inversion, nothing
of the diagnosis in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from cvxupdate.fe.build import build_model
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.spec import load_problem

CHAIN = """
title = "Chain of four"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }, { id = 4, x = 3.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 101, nodes = [1], k = 6.0e4, group = "spring 1" },
        { id = 102, nodes = [1, 2], k = 4.0e4, group = "spring 2" },
        { id = 103, nodes = [2, 3], k = 5.2e4, group = "spring 3" },
            { id = 104, nodes = [3, 4], k = 3.1e4, group = "spring 4" }]
[[model.elements]]
type = "mass"
rows = [{ id = 201, nodes = [1], m = 2.0, group = "floors" },
        { id = 202, nodes = [2], m = 1.4, group = "floors" },
        { id = 203, nodes = [3], m = 1.1, group = "floors" },
            { id = 204, nodes = [4], m = 1.7, group = "floors" }]
[model.damping]
kind = "modal"
zeta = 0.005
"""
BAR = """
title = "Pinned bar"
[model]
dofs = ["z", "ry"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.11 }, { id = 3, x = 0.23 }, { id = 4, x = 0.37 },
         { id = 5, x = 0.48 }, { id = 6, x = 0.6 }]
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.bar]
shape = "rectangle"
width = 0.04
height = 0.008
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2], group = "bar" }, { id = 2, nodes = [2, 3], group = "bar" },
        { id = 3, nodes = [3, 4], group = "bar" },
        { id = 4, nodes = [4, 5], group = "bar" }, { id = 5, nodes = [5, 6], group = "bar" }]
[[model.supports]]
nodes = [1, 6]
dofs = ["z"]
"""


def load(folder, text):
    """(spec, model) of a problem file's text; a recording that is never read stands in for those
    that tests make."""
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


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

    def receptance(self, frequency, zeta=0.005):
        """(lines, 4, 4), modal damping of 0.5 % and the dashpots of C."""
        from scipy.linalg import eigh

        lam, phi = eigh(self.K, self.M)
        modal = self.M @ phi @ np.diag(2 * zeta * np.sqrt(lam)) @ phi.T @ self.M
        s = 2j * np.pi * np.asarray(frequency)[:, None, None]
        return np.linalg.inv(s**2 * self.M + s * (self.C + modal) + self.K)


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
    lines = np.arange(5.0, 75.0, 0.1)

    def one(lab, reference, use="fit", level=None, seed=1, gain=(1, 1, 1, 1), noise=0.003):
        rng = np.random.default_rng(seed)
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
