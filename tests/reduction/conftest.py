"""Small structures made by hand: unequal spans, stiffness and mass that vary, no symmetry."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh


@dataclass(frozen=True)
class Structure:
    K: sparse.csc_matrix
    M: sparse.csc_matrix
    frequency: np.ndarray  # all, Hz
    phi: np.ndarray  # all, mass-normalised

    @property
    def size(self) -> int:
        return int(self.K.shape[0])


def solved(K: np.ndarray, M: np.ndarray) -> Structure:
    value, phi = eigh(K, M)
    return Structure(
        sparse.csc_matrix(K), sparse.csc_matrix(M), np.sqrt(np.maximum(value, 0)) / (2 * np.pi), phi
    )


def beam_element(L: float, EI: float, m: float) -> tuple[np.ndarray, np.ndarray]:
    k = (
        EI
        / L**3
        * np.array(
            [
                [12, 6 * L, -12, 6 * L],
                [6 * L, 4 * L**2, -6 * L, 2 * L**2],
                [-12, -6 * L, 12, -6 * L],
                [6 * L, 2 * L**2, -6 * L, 4 * L**2],
            ]
        )
    )
    c = (
        m
        * L
        / 420
        * np.array(
            [
                [156, 22 * L, 54, -13 * L],
                [22 * L, 4 * L**2, 13 * L, -3 * L**2],
                [54, 13 * L, 156, -22 * L],
                [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
            ]
        )
    )
    return k, c


def make_beam(elements: int = 20, seed: int = 0, free: bool = False) -> Structure:
    """A cantilever (or free beam) of unequal elements; DOFs w, θ per node, even rows
    translations."""
    rng = np.random.default_rng(seed)
    n = 2 * (elements + 1)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        k, m = beam_element(
            rng.uniform(0.03, 0.07),
            210e9 * 2e-9 * rng.uniform(0.7, 1.3),
            1.9 * rng.uniform(0.7, 1.3),
        )
        at = np.arange(2 * e, 2 * e + 4)
        K[np.ix_(at, at)] += k
        M[np.ix_(at, at)] += m
    keep = slice(0, n) if free else slice(2, n)
    return solved(K[keep, keep], M[keep, keep])


def make_chain(size: int = 30, seed: int = 1) -> Structure:
    rng = np.random.default_rng(seed)
    k = 1e5 * rng.uniform(0.5, 2.0, size + 1)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    K[-1, -1] -= k[-1]
    return solved(K, np.diag(rng.uniform(0.5, 2.0, size)))


@pytest.fixture(scope="session")
def beam() -> Structure:
    return make_beam()


@pytest.fixture(scope="session")
def chain() -> Structure:
    return make_chain()


@pytest.fixture(scope="session")
def free_beam() -> Structure:
    return make_beam(free=True)


@pytest.fixture(scope="session")
def beam_maker() -> Callable[..., Structure]:
    return make_beam
