"""Matrices that grow piece by piece, and their modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = tuple[NDArray[np.int64], Array]  # DOF numbers and 6 x m coefficients


class System:
    """M, K and C as triplets; a subclass says how a place moves (``rows``)."""

    def __init__(self) -> None:
        self.n = 0
        self.fixed: set[int] = set()
        self.parts: dict[str, list[tuple[Any, Any, Any]]] = {"M": [], "K": [], "C": []}

    def new(self, count: int) -> NDArray[np.int64]:
        """New DOFs."""
        self.n += count
        return np.arange(self.n - count, self.n)

    def add(self, which: str, idx: NDArray[np.int64], matrix: Array) -> None:
        """Adds a small dense matrix."""
        i, j = np.meshgrid(idx, idx, indexing="ij")
        self.parts[which].append((i.ravel(), j.ravel(), np.asarray(matrix).ravel()))

    def rows(self, at: Any) -> Rows:
        """How a place moves."""
        raise NotImplementedError

    def along(self, which: str, at: Any, direction: Array, value: float) -> None:
        """A spring (K), dashpot (C) or mass (M) along one direction (of six) at a place."""
        idx, b = self.rows(at)
        r = direction @ b
        self.add(which, idx, value * np.outer(r, r))

    def lump(
        self, at: Any, m: float, offset: tuple[float, float, float] = (0, 0, 0), size: float = 0.0
    ) -> None:
        """A body of mass m whose centre lies off the place; a cube-like inertia of ``size``."""
        idx, b = self.rows(at)
        x, y, z = offset
        rigid = np.hstack([np.eye(3), np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])])
        g = m * rigid.T @ rigid
        g[3:, 3:] += np.eye(3) * m * size**2 / 6
        self.add("M", idx, b.T @ g @ b)

    def resonator(self, at: Any, direction: Array, m: float, k: float, c: float) -> None:
        """A mass on a spring and dashpot along one direction."""
        idx, b = self.rows(at)
        own = self.new(1)
        r = np.append(direction @ b, -1.0)
        both = np.append(idx, own)
        self.add("K", both, k * np.outer(r, r))
        self.add("C", both, c * np.outer(r, r))
        self.add("M", own, np.array([[m]]))

    def assemble(self) -> None:
        """Sparse matrices of the free DOFs."""
        self.free = np.array([i for i in range(self.n) if i not in self.fixed])
        out = []
        for which in "MKC":
            p = self.parts[which]
            if p:
                i, j, v = (np.concatenate([q[a] for q in p]) for a in range(3))
                full = sp.csr_matrix((v, (i, j)), shape=(self.n, self.n))
            else:
                full = sp.csr_matrix((self.n, self.n))
            out.append(full[self.free][:, self.free].tocsc())
        self.M, self.K, self.C = out

    def pick(self, at: Any, direction: Array) -> Array:
        """The row of a sensor or force, over the free DOFs."""
        idx, b = self.rows(at)
        r = np.zeros(self.n)
        np.add.at(r, idx, direction @ b)
        return r[self.free]

    def modes(self, count: int) -> tuple[Array, Array]:
        """Angular frequencies squared and mass-normalised shapes, rigid ones included."""
        count = min(count, len(self.free) - 2)
        sigma = -((2 * np.pi * 1.0) ** 2)
        start = np.random.default_rng(5).standard_normal(len(self.free))
        lam, phi = sla.eigsh(self.K, count, self.M, sigma=sigma, v0=start)
        order = np.argsort(lam)
        lam, phi = np.maximum(lam[order], 0.0), phi[:, order]
        return lam, phi / np.sqrt(np.sum(phi * (self.M @ phi), axis=0))
