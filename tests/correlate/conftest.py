"""A plane frame of two bays made by hand (20 elements, 19 nodes, unequal spans, free), and what can
be changed in it."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from cvxupdate.correlate.elements import ElementBatch


@dataclass(frozen=True)
class Frame:
    K: sparse.csc_matrix
    M: sparse.csc_matrix
    batches: tuple[ElementBatch, ...]
    frequency: np.ndarray  # flexible modes, Hz
    phi: np.ndarray  # flexible modes, mass-normalised

    @property
    def size(self) -> int:
        return int(self.K.shape[0])


CORNERS = np.array([[0.0, 0.0], [0.62, 0.0], [1.1, 0.05], [1.15, 0.44], [0.6, 0.4], [0.03, 0.43]])
EDGES = ((0, 1, 3), (1, 2, 3), (2, 3, 3), (3, 4, 3), (4, 5, 3), (5, 0, 3), (1, 4, 2))


def nodes_and_elements() -> tuple[np.ndarray, np.ndarray]:
    nodes, elements = [*CORNERS], []
    for a, b, parts in EDGES:
        last = a
        for k in range(1, parts):
            nodes.append(CORNERS[a] + (CORNERS[b] - CORNERS[a]) * k / parts)
            elements.append((last, len(nodes) - 1))
            last = len(nodes) - 1
        elements.append((last, b))
    return np.array(nodes), np.array(elements)


def element(
    p: np.ndarray,
    q: np.ndarray,
    E: float = 70e9,
    A: float = 2e-4,
    I: float = 6e-9,
    rho: float = 2700.0,
) -> tuple[np.ndarray, np.ndarray]:
    d = q - p
    L = float(np.hypot(*d))
    c, s = d / L
    k, m = np.zeros((6, 6)), np.zeros((6, 6))
    ax, be = [0, 3], [1, 2, 4, 5]
    k[np.ix_(ax, ax)] = E * A / L * np.array([[1, -1], [-1, 1]])
    m[np.ix_(ax, ax)] = rho * A * L / 6 * np.array([[2, 1], [1, 2]])
    k[np.ix_(be, be)] = (
        E
        * I
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
    m[np.ix_(be, be)] = (
        rho
        * A
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
    R = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    return R.T @ k @ R, R.T @ m @ R


def make_frame(
    stiffness: dict[int, float] | None = None, mass: dict[int, float] | None = None
) -> Frame:
    """The frame; element e has (1 + stiffness[e]) times its stiffness and (1 + mass[e]) times its
    mass."""
    nodes, elements = nodes_and_elements()
    N = 3 * len(nodes)
    dofs = np.array(
        [[3 * a, 3 * a + 1, 3 * a + 2, 3 * b, 3 * b + 1, 3 * b + 2] for a, b in elements]
    )
    pairs = [element(nodes[a], nodes[b]) for a, b in elements]
    Ke = np.array([k * (1 + (stiffness or {}).get(e, 0.0)) for e, (k, _) in enumerate(pairs)])
    Me = np.array([m * (1 + (mass or {}).get(e, 0.0)) for e, (_, m) in enumerate(pairs)])
    K, M = np.zeros((N, N)), np.zeros((N, N))
    for e, at in enumerate(dofs):
        K[np.ix_(at, at)] += Ke[e]
        M[np.ix_(at, at)] += Me[e]
    value, phi = eigh(K, M)
    # Two batches, so that the order of the results is tested too.
    batches = (ElementBatch(dofs[:12], Ke[:12], Me[:12]), ElementBatch(dofs[12:], Ke[12:], Me[12:]))
    return Frame(
        sparse.csc_matrix(K),
        sparse.csc_matrix(M),
        batches,
        np.sqrt(value[3:]) / (2 * np.pi),
        phi[:, 3:],
    )


@pytest.fixture(scope="session")
def frame() -> Frame:
    return make_frame()


@pytest.fixture(scope="session")
def frame_maker():
    return make_frame
